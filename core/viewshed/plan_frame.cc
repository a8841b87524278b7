#include "core/viewshed/plan_frame.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

/// Samples to each side over which the local map is measured: wide enough that the lattice does
/// not show.
constexpr std::int32_t kReach = 4;

/// Sets the affine part of the frame from the samples around one of them.
void measure_around(const GroundGrid& grid, std::int32_t column, std::int32_t row,
                    PlanFrame& frame) {
  const std::int32_t west = std::max(0, column - kReach);
  const std::int32_t east = std::min(grid.columns() - 1, column + kReach);
  const std::int32_t north = std::max(0, row - kReach);
  const std::int32_t south = std::min(grid.rows() - 1, row + kReach);
  const Position w = grid.at(west, row), e = grid.at(east, row);
  const Position n = grid.at(column, north), s = grid.at(column, south);
  const double column_x = (e.x_m - w.x_m) / (east - west),
               column_y = (e.y_m - w.y_m) / (east - west);
  const double row_x = (s.x_m - n.x_m) / (south - north), row_y = (s.y_m - n.y_m) / (south - north);
  const double area = column_x * row_y - column_y * row_x;
  frame.across_x = row_y / area;
  frame.across_y = -row_x / area;
  frame.down_x = -column_y / area;
  frame.down_y = column_x / area;
}

}  // namespace

PlanFrame plan_frame(const GroundGrid& grid, const Position& eye) {
  assert(grid.columns() >= 2 && grid.rows() >= 2);
  PlanFrame frame;
  frame.eye_x_m = eye.x_m;
  frame.eye_y_m = eye.y_m;
  // Newton's method on the samples; the map is nearly affine, so a few steps arrive.
  constexpr int kSteps = 8;
  double column = (grid.columns() - 1) / 2.0, row = (grid.rows() - 1) / 2.0;
  for (int step = 0; step < kSteps; ++step) {
    const auto at_column = static_cast<std::int32_t>(
        std::lround(std::clamp(column, 0.0, static_cast<double>(grid.columns() - 1))));
    const auto at_row = static_cast<std::int32_t>(
        std::lround(std::clamp(row, 0.0, static_cast<double>(grid.rows() - 1))));
    measure_around(grid, at_column, at_row, frame);
    const Position p = grid.at(at_column, at_row);
    const double next_column = at_column - frame.across(p.x_m, p.y_m);
    const double next_row = at_row - frame.down(p.x_m, p.y_m);
    const bool arrived = std::abs(next_column - column) + std::abs(next_row - row) < 1e-9;
    column = next_column;
    row = next_row;
    if (arrived) break;
  }
  frame.eye_column = column;
  frame.eye_row = row;
  return frame;
}

}  // namespace scarp
