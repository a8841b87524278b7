#pragma once

#include <cstdint>

#include "core/terrain/ground_grid.h"

namespace scarp {

/// Plan coordinates around an eye that nearly count samples: across grows with the column, down
/// with the row, both 0 at the eye and about 1 a sample near it. Affine in x and y, so straight
/// lines stay straight; it steers searches and never decides anything.
struct PlanFrame {
  double eye_x_m = 0, eye_y_m = 0;
  double across_x = 0, across_y = 0;  ///< per metre
  double down_x = 0, down_y = 0;
  /// The eye in columns and rows; extrapolated outside the data.
  double eye_column = 0, eye_row = 0;

  double across(double x_m, double y_m) const {
    return (x_m - eye_x_m) * across_x + (y_m - eye_y_m) * across_y;
  }
  double down(double x_m, double y_m) const {
    return (x_m - eye_x_m) * down_x + (y_m - eye_y_m) * down_y;
  }
};

/// Requires at least 2 x 2 samples.
PlanFrame plan_frame(const GroundGrid& grid, const Position& eye);

}  // namespace scarp
