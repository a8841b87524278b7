#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/raster/camera.h"
#include "core/terrain/tin.h"

namespace scarp {

/// An sRGB picture, rows from the top.
struct Picture {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgb;  ///< [height * width * 3]
};

struct PreviewOptions {
  int width_px = 1600;
  int height_px = 1200;
  int margin_px = 16;                    ///< left free around a picture from above
  std::optional<Position> eye;           ///< marked in red, seen through the ground
  std::span<const std::uint8_t> culled;  ///< [triangles] or empty; not 0: drawn as wires only
  /// [vertices] or empty: what the relief is coloured by; empty takes z, which on a scene of many
  /// hundred kilometres falls with the Earth's curvature.
  std::span<const double> heights_m;
};

/// A picture of the mesh from above, north up, lit from the north-west, 45 degrees high, with as
/// much contrast as the terrain needs.
///
/// Where there are groups, each triangle has its group's colour, orphans are grey and borders
/// between groups are dark lines; otherwise colours follow the height. Void ground and what lies
/// outside is kBackground. Void groups: an empty group_of_triangle.
///
/// Requires (asserted): neighbours connected; spans empty or of the sizes above; sizes positive.
/// Cost: O(triangles + pixels); memory 32 bytes a pixel and about 110 bytes a vertex.
Picture preview_from_above(const Tin& tin, const Groups& groups, const PreviewOptions& options);

/// The same from a camera, as a block of ground with cut sides under a hazy sky. Culled triangles
/// hide what is behind them.
Picture preview_3d(const Tin& tin, const Groups& groups, const View& view,
                   const PreviewOptions& options);

/// The colours that a picture can be read by.
struct Rgb {
  double r = 0;  ///< sRGB, each in [0, 1]
  double g = 0;
  double b = 0;
};
inline constexpr Rgb kBackground = {0.98, 0.98, 0.97};
inline constexpr Rgb kOrphan = {0.62, 0.62, 0.62};
inline constexpr Rgb kMark = {0.86, 0.11, 0.12};

/// A group's colour before it is lit: hues a golden ratio of the circle apart, of even brightness
/// but for three alternating steps, so that groups made one after the other differ.
Rgb group_colour(GroupIndex group);

}  // namespace scarp
