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
/// The first lines are crossed one by one. Farther ground is met in strips of lines that grow with
/// distance and know the highest that a ray meets in them; those which might rise above the low
/// bound by more than the tolerance are opened, down to strips of 8 lines, whose lines are crossed.
/// Low bounds are good beforehand, because the strips in which the cells of the line before met
/// their horizons are crossed first. So upper and lower bound differ by the tolerance at most, but
/// for roundings and where a ray grazes the border of the data or of void; and no ground is ever
/// left out that could matter more.
///
/// Every crossing that is compared is on the ray itself, at a place known within RayFan::slack.
/// Cost: on real ground, for bundles of 16 rays, about 60 crossings and 20 questions to strips.
/// Source: rays side by side as in Timonen and Westerholm 2010, who keep a hull for each line of
/// rays instead and so move them sideways by up to half a cell; the strips are a maximum pyramid
/// (Tevs, Ihrke and Seidel 2008) that leans with the rays.
void march_tile(const GroundGrid& grid, const MarchGround& ground, const RayFan& fan,
                const MarchTile& tile, const MarchSearch& search, TileHorizons& horizons);

}  // namespace scarp
