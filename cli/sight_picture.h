#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/sight/line_of_sight.h"

namespace scarp {

/// A profile as it is drawn: distances along the ground and heights above the datum, metres.
struct PictureProfile {
  struct Ground {
    double distance_m, height_m;
    bool void_before;  ///< no ground is drawn between the point before and this one
  };
  struct Line {
    double distance_m, height_m;
    double fresnel_radius_m;  ///< 0: no zone is drawn
  };
  struct Mark {
    double distance_m, height_m;
    std::string label;
  };
  std::vector<Ground> ground;                       ///< by rising distance
  std::vector<Line> line;                           ///< from the eye to the target
  std::optional<double> eye_foot_m, target_foot_m;  ///< the ground under each end
  std::optional<Mark> blocker;
  Sight sight = Sight::kVisible;
  bool flat_earth = false;
  std::string title;
  std::vector<std::string> notes;  ///< up to two lines
};

/// Draws a profile as SVG. Heights are drawn as they are above the datum, so both axes read true;
/// the straight sight line therefore bends as the Earth falls away below it.
/// Requires at least two points of the line, at different distances.
std::string draw_profile(const PictureProfile& profile);

}  // namespace scarp
