#include "tests/support/terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

namespace scarp::test {
namespace {

/// In [0, 1), the same on every platform.
double unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// A sum of waves with random directions, from `longest` cells down by halves; in about [-1, 1].
class Waves {
 public:
  Waves(std::uint64_t seed, double longest_cells) {
    std::mt19937_64 random(seed);
    double weight = 0.4;
    for (double length = longest_cells; length > 2; length /= 2, weight *= 0.6) {
      for (int i = 0; i < 3; ++i) {
        const double direction = 2 * std::numbers::pi * unit(random);
        const double wave_number = 2 * std::numbers::pi / (length * (0.7 + 0.6 * unit(random)));
        waves_.push_back({wave_number * std::cos(direction), wave_number * std::sin(direction),
                          2 * std::numbers::pi * unit(random), weight / 2});
      }
    }
  }

  double at(double column, double row) const {
    double sum = 0;
    for (const Wave& w : waves_) sum += w.weight * std::sin(w.x * column + w.y * row + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double x, y, phase, weight;
  };
  std::vector<Wave> waves_;
};

}  // namespace

SampleGrid grid_of(std::int32_t columns, std::int32_t rows, double cell_m,
                   const std::function<double(std::int32_t, std::int32_t)>& height_m) {
  SampleGrid grid;
  grid.columns = columns;
  grid.rows = rows;
  grid.cell_x_m = grid.cell_y_m = cell_m;
  for (std::int32_t row = 0; row < rows; ++row) {
    for (std::int32_t column = 0; column < columns; ++column) {
      const double z_m = height_m(column, row);
      const bool known = !std::isnan(z_m);
      grid.positions.push_back(
          round_to_lattice(Position{column * cell_m, (rows - 1 - row) * cell_m, known ? z_m : 0}));
      grid.known.push_back(known);
    }
  }
  return grid;
}

SampleGrid drawn_grid(const std::string& text, double cell_m) {
  std::vector<std::vector<double>> heights;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; words >> word;)
      row.push_back(word == "?" ? std::numeric_limits<double>::quiet_NaN() : std::stod(word));
    if (!row.empty()) heights.push_back(row);
  }
  return grid_of(
      static_cast<std::int32_t>(heights.at(0).size()), static_cast<std::int32_t>(heights.size()),
      cell_m, [&](std::int32_t column, std::int32_t row) {
        return heights[static_cast<std::size_t>(row)].at(static_cast<std::size_t>(column));
      });
}

SampleGrid extruded_profile(const std::vector<double>& heights_m, double cell_m,
                            std::int32_t rows) {
  return grid_of(static_cast<std::int32_t>(heights_m.size()), rows, cell_m,
                 [&](std::int32_t column, std::int32_t) {
                   return heights_m[static_cast<std::size_t>(column)];
                 });
}

SampleGrid random_hills(std::int32_t columns, std::int32_t rows, double cell_m, std::uint64_t seed,
                        double relief_m, double step_m, double void_share) {
  const double longest = std::max(8.0, 0.5 * std::max(columns, rows));
  const Waves ground(seed, longest), patches(seed + 1'000'003, longest / 2);
  std::vector<double> patch;
  for (std::int32_t row = 0; row < rows; ++row)
    for (std::int32_t column = 0; column < columns; ++column)
      patch.push_back(patches.at(column, row));
  std::vector<double> sorted = patch;
  std::sort(sorted.begin(), sorted.end());
  const auto voids = static_cast<std::size_t>(void_share * static_cast<double>(sorted.size()));
  return grid_of(columns, rows, cell_m, [&](std::int32_t column, std::int32_t row) {
    const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column);
    if (voids > 0 && patch[i] < sorted[voids]) return std::numeric_limits<double>::quiet_NaN();
    return std::round(relief_m / 2 * ground.at(column, row) / step_m) * step_m;
  });
}

SampleGrid cone(std::int32_t columns, std::int32_t rows, double cell_m, double top_m,
                double slope) {
  return grid_of(columns, rows, cell_m, [&](std::int32_t column, std::int32_t row) {
    const double distance_m = cell_m * std::hypot(column - columns / 2, row - rows / 2);
    return std::max(0.0, top_m - slope * distance_m);
  });
}

Tin triangulated(const SampleGrid& grid, std::uint64_t diagonal_seed) {
  std::mt19937_64 random(diagonal_seed);
  Tin tin;
  std::vector<VertexIndex> vertex(grid.positions.size(), kNone);
  const auto vertex_at = [&](std::int32_t column, std::int32_t row) {
    VertexIndex& v = vertex[grid.index(column, row)];
    if (v == kNone) {
      v = static_cast<VertexIndex>(tin.vertices.size());
      tin.vertices.push_back(grid.at(column, row));
    }
    return v;
  };
  for (std::int32_t row = 0; row + 1 < grid.rows; ++row) {
    for (std::int32_t column = 0; column + 1 < grid.columns; ++column) {
      if (!grid.is_ground_cell(column, row)) continue;
      const VertexIndex nw = vertex_at(column, row), ne = vertex_at(column + 1, row);
      const VertexIndex sw = vertex_at(column, row + 1), se = vertex_at(column + 1, row + 1);
      if (diagonal_seed != 0 && (random() & 1) != 0) {
        tin.triangles.push_back({nw, sw, ne});
        tin.triangles.push_back({ne, sw, se});
      } else {
        tin.triangles.push_back({nw, sw, se});
        tin.triangles.push_back({nw, se, ne});
      }
    }
  }
  connect_neighbours(tin);
  return tin;
}

}  // namespace scarp::test
