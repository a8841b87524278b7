#pragma once

#include <cstdint>
#include <vector>

#include "core/skyline/march_ground.h"
#include "core/skyline/ray_fan.h"

namespace scarp {

/// How the horizons of a tile are looked for.
struct MarchSearch {
  /// Ground that might rise less than this above the horizon found is not looked at, slope.
  float tolerance = 0;
  /// Metres above ground, along the normal.
  double eye_height_m = 0;
  bool measures_distance = false;
};

/// Elevations of a tile's horizons, steps of 0.01 degree, [lines * lanes].
struct TileHorizons {
  std::vector<std::int16_t> estimate, lower, upper;
  std::vector<float> run_m;  ///< to the estimate's place, in the plane; only if measured
};

/// Horizons of all cells of a tile in one azimuth.
///
/// The first lines are crossed one by one. Farther ground is met in squares that grow with
/// distance: a line of each is crossed, so that low bounds are good; then only squares whose
/// highest sample might rise above the low bound by more than the tolerance are opened, down to
/// squares of 8 x 8, whose lines are crossed. So upper and lower bound differ by the tolerance at
/// most, but for roundings and where a ray grazes the border of the data or of void; and no ground
/// is ever left out that could matter more.
///
/// Every crossing that is compared is on the ray itself, at a place known within RayFan::slack.
/// Cost: on real ground about 100 operations on bundles of 64 rays a bundle.
void march_tile(const GroundGrid& grid, const MarchGround& ground, const RayFan& fan,
                const MarchTile& tile, const MarchSearch& search, TileHorizons& horizons);

}  // namespace scarp
