#pragma once

#include "core/terrain/ground_grid.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// How far an interpolated position may lie from the exact one, metres, rounding to the lattice
/// not counted.
inline constexpr double kInterpolationErrorM = 0.5e-3;

/// Where the samples of a DEM lie: by row and column on the flat earth; on the ellipsoid by
/// biquadratic interpolation in blocks, as large as keeps kInterpolationErrorM. Down to blocks of
/// two samples, of which each is a node, there is no interpolation left.
///
/// The error is measured where that of quadratic interpolation is greatest, between the nodes, in
/// 9 x 9 blocks spread over the raster, at two heights; the derivatives that cause it vary slowly
/// over a raster, so half of the allowance covers what lies between.
/// A geoid has no part in it: its undulation is added to the heights, sample by sample.
/// Throws Error{kInput} where the CRS cannot place the raster.
/// Cost: three PROJ calls a node, and one node for 4096 samples where blocks are largest.
GroundGrid::Placement ground_placement(const Dem& dem);

/// part_of(ground_placement(dem), ...), bit for bit, at the cost of the part and of the error's
/// measure (some thousand PROJ calls). Requires a rectangle within the raster.
PartPlacement ground_placement_of_part(const Dem& dem, std::int32_t first_column,
                                       std::int32_t first_row, std::int32_t columns,
                                       std::int32_t rows);

}  // namespace scarp
