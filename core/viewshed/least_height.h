#pragma once

#include <cstdint>

#include "core/terrain/ground_grid.h"
#include "core/viewshed/grid_sight.h"

namespace scarp {

/// Height above a sample, along its normal, of a flattened height, metres, rounded up; 0 where that
/// is not above it, infinite beyond the lattice.
float height_up_to(const GroundGrid& stands, double z_m, std::int32_t column, std::int32_t row);

/// Least height over a sample at which a target is seen, from all lines between: metres, rounded up
/// as sweep_heights has it. 0 exactly where the sample is seen; NaN where the line is over
/// void ground; infinite straight above an eye under ground.
/// @param sight   of the eye over the grid that blocks
/// @param stands  of the same placement; requires the sample known in both
/// Cost: O(columns + rows) predicates.
float least_height_m(const GridSight& sight, const GroundGrid& stands, std::int32_t column,
                     std::int32_t row);

}  // namespace scarp
