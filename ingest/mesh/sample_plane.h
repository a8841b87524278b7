#pragma once

#include <cstdint>

#include "core/terrain/sample_grid.h"

namespace scarp {

/// A sample by its place in the grid.
struct GridNode {
  std::int32_t column = 0;
  std::int32_t row = 0;

  friend bool operator==(const GridNode&, const GridNode&) = default;
};

/// The plane that meshes are Delaunay in: sample (column, row) lies at (column step_x, -row step_y)
/// with small whole steps in the proportion of the cell. All coordinates are whole numbers below
/// 2^25, so that grid lines are exactly straight and predicates exact.
struct SamplePlane {
  std::int32_t step_x = 1;
  std::int32_t step_y = 1;

  std::int64_t x(const GridNode& n) const { return std::int64_t{n.column} * step_x; }
  std::int64_t y(const GridNode& n) const { return -std::int64_t{n.row} * step_y; }
};

/// Nearest proportion to cell_x_m : cell_y_m of whole numbers up to 32; 1 : 1 for square cells.
SamplePlane sample_plane_of(const SampleGrid& grid);

}  // namespace scarp
