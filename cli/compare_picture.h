#pragma once

#include <string>
#include <vector>

namespace scarp {

/// A setting of a culling method as it is drawn: what it costs and what it culls.
struct PicturePoint {
  double seconds = 0;                   ///< to prepare
  double bytes_per_triangle = 0;        ///< to keep
  double share = 0;                     ///< culled, 0 to 1
  std::string time_label, bytes_label;  ///< in each chart; not drawn in it where empty
  bool is_default = false;
  bool is_safe = true;  ///< culled nothing that is visible
};

struct PictureMethod {
  std::string name;
  bool is_joined = false;  ///< by a line: its points differ in one parameter in each chart
  std::vector<PicturePoint> points;
};

struct PictureComparison {
  std::string title;
  std::vector<std::string> notes;      ///< up to two lines
  std::vector<PictureMethod> methods;  ///< at most three
};

/// Draws culled share against preparation time and against bytes, side by side, both on logarithmic
/// axes, as SVG. Filled marks are safe, hollow ones culled what is visible, rings are defaults.
/// Requires a point, and seconds and bytes above zero.
std::string draw_comparison(const PictureComparison& comparison);

}  // namespace scarp
