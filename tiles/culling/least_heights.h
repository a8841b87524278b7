#pragma once

#include <cstdint>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// Heights that the ground is nowhere under, cell by cell of a grid over the plane: cell (column,
/// row) is [column, column + 1) * cell_m by [row, row + 1) * cell_m, columns and rows counted from
/// the frame's origin.
///
/// Side: never above the ground. A cell that is not all over ground has no height (-infinity).
struct LeastHeights {
  double cell_m = 1;
  std::int32_t first_column = 0, first_row = 0;
  std::int32_t columns = 0, rows = 0;
  std::vector<float> height_m;  ///< [rows * columns], rounded down

  std::size_t at(std::int32_t column, std::int32_t row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
};

/// @param tin  with its neighbours: an edge without one is where ground ends
/// Requires cell_m > 0, and at most 2^15 columns and rows.
/// Cost: O(triangles + cells).
LeastHeights least_heights(const Tin& tin, double cell_m);

}  // namespace scarp
