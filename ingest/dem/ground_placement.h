#pragma once

#include <optional>

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

/// The interpolating one with a given block side, or nothing where its error is too large. For
/// ground_placement and its tests. Requires an ellipsoidal frame, side a power of two.
std::optional<BlockPlacement> interpolated_placement(const Dem& dem, std::int32_t side);

}  // namespace scarp
