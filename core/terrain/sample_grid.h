#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"

namespace scarp {

/// The DEM's samples (pixel centres) placed in the flattened frame: the surface `grid`.
/// Row 0 is the northern (upper) row, column 0 the western (left) one, so that columns x
/// decreasing rows is counter-clockwise seen from above.
struct SampleGrid {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  std::vector<Position> positions;  ///< [rows * columns], row by row
  std::vector<std::uint8_t> known;  ///< [rows * columns], 0 where the sample is void
  /// Empty, or [rows * columns], 1 where the cell with that upper left sample is void even if its
  /// corners are known: on coarser levels, where it holds void between them.
  std::vector<std::uint8_t> void_cells;
  /// Cell size at the scene's centre, metres, both positive. Nominal: positions decide.
  double cell_x_m = 0;
  double cell_y_m = 0;
  /// Greatest distance, in cells, between a sample's position and the affine interpolation of its
  /// neighbours' over one cell: how far grid lines bend. 0 for an affine grid (flat earth).
  double bend_cells = 0;

  std::size_t index(std::int32_t column, std::int32_t row) const {
    assert(column >= 0 && column < columns && row >= 0 && row < rows);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  const Position& at(std::int32_t column, std::int32_t row) const {
    return positions[index(column, row)];
  }
  bool is_known(std::int32_t column, std::int32_t row) const {
    return known[index(column, row)] != 0;
  }
  /// A cell is ground where its four corner samples are known and nothing says that there is void
  /// between them; (column, row) is its upper left.
  bool is_ground_cell(std::int32_t column, std::int32_t row) const {
    return column >= 0 && row >= 0 && column + 1 < columns && row + 1 < rows &&
           is_known(column, row) && is_known(column + 1, row) && is_known(column, row + 1) &&
           is_known(column + 1, row + 1) &&
           (void_cells.empty() || void_cells[index(column, row)] == 0);
  }
};

}  // namespace scarp
