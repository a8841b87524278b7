#pragma once

#include <cstdint>

#include "core/terrain/sample_grid.h"

namespace scarp {

/// Every stride-th sample of a grid, from the first on: the samples of a coarser level. A coarse
/// cell is ground where all cells are that it is made of, so that no coarse ground covers void.
///
/// Coarsening twice by 2 is coarsening by 4; and rows depend on nothing but the grid's rows from
/// theirs to the next coarse row, so that strips of stride + 1 rows give the rows of the whole, but
/// for void_cells of each strip's last row. Cells and their bend are the grid's times stride.
///
/// @param grid    of a window, its first sample on the coarse lattice
/// @param stride  a power of two; 1 copies
/// @return        (columns - 1) / stride + 1 columns, and so for rows; void_cells filled
/// Requires at least one sample. Cost: O(samples).
SampleGrid coarsened(const SampleGrid& grid, std::int32_t stride);

}  // namespace scarp
