#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "core/geodesy/flattening.h"
#include "core/terrain/sample_grid.h"

namespace scarp::test {

using HeightAt = std::function<double(std::int32_t column, std::int32_t row)>;

/// A flat grid of known samples with the given cells.
inline SampleGrid flat_grid(std::int32_t columns, std::int32_t rows, double cell_x_m,
                            double cell_y_m, const HeightAt& height_m) {
  SampleGrid grid;
  grid.columns = columns;
  grid.rows = rows;
  grid.cell_x_m = cell_x_m;
  grid.cell_y_m = cell_y_m;
  for (std::int32_t r = 0; r < rows; ++r)
    for (std::int32_t c = 0; c < columns; ++c)
      grid.positions.push_back(
          round_to_lattice(Position{c * cell_x_m, -r * cell_y_m, height_m(c, r)}));
  grid.known.assign(grid.positions.size(), 1);
  return grid;
}

/// How far grid lines bend over one cell, as SampleGrid::bend_cells says.
inline double measured_bend_cells(const SampleGrid& grid) {
  double worst_m = 0;
  const auto miss = [&](const Position& p, const Position& a, const Position& b) {
    worst_m =
        std::max(worst_m, std::hypot(p.x_m - 0.5 * (a.x_m + b.x_m), p.y_m - 0.5 * (a.y_m + b.y_m)));
  };
  for (std::int32_t r = 0; r < grid.rows; ++r) {
    for (std::int32_t c = 0; c < grid.columns; ++c) {
      if (c > 0 && c + 1 < grid.columns) miss(grid.at(c, r), grid.at(c - 1, r), grid.at(c + 1, r));
      if (r > 0 && r + 1 < grid.rows) miss(grid.at(c, r), grid.at(c, r - 1), grid.at(c, r + 1));
      if (c > 0 && c + 1 < grid.columns && r > 0 && r + 1 < grid.rows) {
        miss(grid.at(c, r), grid.at(c - 1, r - 1), grid.at(c + 1, r + 1));
        miss(grid.at(c, r), grid.at(c - 1, r + 1), grid.at(c + 1, r - 1));
      }
    }
  }
  return worst_m / std::min(grid.cell_x_m, grid.cell_y_m);
}

/// Samples at whole steps of longitude and latitude on the sphere around (0, latitude), flattened
/// there: grid lines bend.
inline SampleGrid bent_grid(std::int32_t columns, std::int32_t rows, double cell_deg,
                            double latitude_deg, const HeightAt& height_m) {
  constexpr double kDegree = std::numbers::pi / 180;
  const auto ecef = [&](double longitude_deg, double up_deg, double radius_m) {
    const double longitude = longitude_deg * kDegree, latitude = up_deg * kDegree;
    return EcefPoint{radius_m * std::cos(latitude) * std::cos(longitude),
                     radius_m * std::cos(latitude) * std::sin(longitude),
                     radius_m * std::sin(latitude)};
  };
  const Flattening frame(ecef(0, latitude_deg, kEarthRadiusM), 0);
  SampleGrid grid;
  grid.columns = columns;
  grid.rows = rows;
  for (std::int32_t r = 0; r < rows; ++r)
    for (std::int32_t c = 0; c < columns; ++c)
      grid.positions.push_back(round_to_lattice(frame.flatten(
          ecef((c - 0.5 * (columns - 1)) * cell_deg,
               latitude_deg - (r - 0.5 * (rows - 1)) * cell_deg, kEarthRadiusM + height_m(c, r)))));
  grid.known.assign(grid.positions.size(), 1);
  grid.cell_y_m = kEarthRadiusM * cell_deg * kDegree;
  grid.cell_x_m = grid.cell_y_m * std::cos(latitude_deg * kDegree);
  grid.bend_cells = measured_bend_cells(grid);
  return grid;
}

/// Marks samples void where a drawing has a space: one string a row.
inline void cut_out(SampleGrid& grid, const std::vector<std::string>& drawing) {
  for (std::int32_t r = 0; r < grid.rows; ++r)
    for (std::int32_t c = 0; c < grid.columns; ++c)
      if (drawing[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] == ' ')
        grid.known[grid.index(c, r)] = 0;
}

}  // namespace scarp::test
