#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "ingest/dem/dem.h"
#include "ingest/mesh/walls_and_roofs.h"

namespace scarp {

/// A building as its source gives it: one polygon and how high it stands.
struct Footprint {
  /// The outline first, then courtyards; x, y in the CRS of the DEM, the last point not repeated.
  std::vector<std::vector<std::array<double, 2>>> rings;
  double height_m = 0;  ///< of the roof above the lowest ground at the outline, > 0
};

/// Reads the building polygons that meet a DEM's rectangle from any vector file that OGR reads and
/// brings them into the DEM's CRS. Multipolygons and collections are split, curves straightened,
/// invalid polygons repaired. Layers without CRS are taken to have the DEM's.
///
/// @param height_field  attribute with the height in metres, a number or text such as "12.5" or
///                      "12.5 m"; features without it, or with a height that is not positive, are
///                      left out
/// @param warnings[out] one line for each reason why features were left out or changed, with count
///
/// Throws Error{kInput} where the file is no vector file, no layer has the field (the message
/// lists the fields found), there is no polygon, or none lies inside the DEM.
std::vector<Footprint> read_footprints(const std::string& file, const std::string& height_field,
                                       const Dem& dem, std::vector<std::string>& warnings);

/// Width of a wall's strip, metres: steep enough to be a wall (a storey in 6 cm is 89 degrees),
/// wide enough that rounding to the lattice (0.24 mm) does not matter.
inline constexpr double kWallRunM = 1.0 / 16;

/// A wall's strip is never wider than this part of a cell.
inline constexpr double kWallRunCells = 1.0 / 8;

/// Pieces of building smaller than this, and gaps and courtyards smaller than this, belong to
/// what surrounds them: what is left where outlines were drawn twice, not quite alike.
inline constexpr double kSliverAreaM2 = 0.5;

/// Buildings keep this far, in cells, from the border of the ground, where the mesh has to follow
/// the samples.
inline constexpr double kBorderClearanceCells = 1.0 / 2;

/// Makes walls and roofs of footprints.
///
/// Roofs are flat and lie at the lowest ground along the outline plus the height, as building data
/// mean it (OpenStreetMap's `height`, CityGML's measuredHeight); where the ground at the outline
/// rises above that, at the highest ground (counted). Where footprints overlap the higher roof
/// wins; pieces of one level that touch become one. Walls are raised along the frame's verticals;
/// the foot follows the ground (bilinear between samples) to within foot_error_m. Corners are
/// rounded to half a wall's run. What reaches over void or beside the DEM is cut off.
///
/// @param foot_error_m   >= 0, how far the foot of a wall may leave the ground, vertically
/// @param warnings[out]  as read_footprints
/// @return               walls for which check_walls finds nothing; none where all were left out
///
/// Same bits for any number of threads. Cost: about 0.1 ms a corner.
WallsAndRoofs build_walls(const std::vector<Footprint>& footprints, const Dem& dem,
                          const SampleGrid& grid, double foot_error_m,
                          std::vector<std::string>& warnings);

/// All of the above for `--footprints FILE --height-field NAME`.
/// Throws Error{kInput} as read_footprints, and where none stands on the ground of the DEM.
WallsAndRoofs add_footprints(const Dem& dem, const SampleGrid& grid, const std::string& file,
                             const std::string& height_field, double foot_error_m,
                             std::vector<std::string>& warnings);

/// Names the first broken invariant, or nothing where all hold: positions on the lattice, places on
/// ticks and on the ground, at different places, edges that meet only in their ends (exact), in
/// both planes, covered samples marked. Cost: O(n log n) for edges of like length.
std::optional<std::string> check_walls(const SampleGrid& grid, const WallsAndRoofs& walls);

}  // namespace scarp
