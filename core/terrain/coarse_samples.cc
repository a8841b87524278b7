#include "core/terrain/coarse_samples.h"

namespace scarp {
namespace {

/// Whether all cells that a coarse one is made of are ground.
bool is_all_ground(const SampleGrid& grid, std::int32_t column, std::int32_t row,
                   std::int32_t stride) {
  for (std::int32_t r = row; r < row + stride; ++r)
    for (std::int32_t c = column; c < column + stride; ++c)
      if (!grid.is_ground_cell(c, r)) return false;
  return true;
}

}  // namespace

SampleGrid coarsened(const SampleGrid& grid, std::int32_t stride) {
  assert(grid.columns >= 1 && grid.rows >= 1 && stride >= 1 && (stride & (stride - 1)) == 0);
  SampleGrid coarse;
  coarse.columns = (grid.columns - 1) / stride + 1;
  coarse.rows = (grid.rows - 1) / stride + 1;
  coarse.cell_x_m = grid.cell_x_m * stride;
  coarse.cell_y_m = grid.cell_y_m * stride;
  // A chord of as many cells strays from its samples by the square of its length, and cells grow.
  coarse.bend_cells = grid.bend_cells * stride;
  const auto samples =
      static_cast<std::size_t>(coarse.columns) * static_cast<std::size_t>(coarse.rows);
  coarse.positions.reserve(samples);
  coarse.known.reserve(samples);
  coarse.void_cells.reserve(samples);
  for (std::int32_t r = 0; r < coarse.rows; ++r) {
    for (std::int32_t c = 0; c < coarse.columns; ++c) {
      coarse.positions.push_back(grid.at(c * stride, r * stride));
      coarse.known.push_back(grid.is_known(c * stride, r * stride));
      coarse.void_cells.push_back(!is_all_ground(grid, c * stride, r * stride, stride));
    }
  }
  return coarse;
}

}  // namespace scarp
