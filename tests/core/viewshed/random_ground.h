#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "core/terrain/ground_grid.h"

namespace scarp::test {

/// Ground to try viewsheds on, with samples about 30 m apart.
enum class Relief { kRough, kSmooth, kPlateaus, kSpikes, kPits, kWalls, kPlane, kCount };

struct GroundRecipe {
  Relief relief = Relief::kRough;
  std::int32_t columns = 24;
  std::int32_t rows = 20;
  double bend = 0;        ///< sideways shift of the grid lines at the corners, in cells
  double void_share = 0;  ///< of the samples, in patches of one to nine
  std::uint32_t seed = 1;
};

GroundGrid random_ground(const GroundRecipe& recipe);

/// The sample's height by relief, metres.
inline double relief_height_m(Relief relief, std::int32_t c, std::int32_t r, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double noise = unit(random);
  switch (relief) {
    case Relief::kRough:
      return 60 * noise;
    case Relief::kSmooth:
      return 40 * std::sin(c * 0.31) * std::cos(r * 0.23) + 25 * std::sin(0.11 * (c + r)) + noise;
    case Relief::kPlateaus:
      return 10 * std::floor(3 * std::sin(c * 0.35) + 3 * std::cos(r * 0.3));
    case Relief::kSpikes:
      return noise < 0.03 ? 80 : 0;
    case Relief::kPits:
      return noise < 0.05 ? -80 : 5;
    case Relief::kWalls:
      return c % 9 == 4 || r % 8 == 5 || (c + r) % 11 == 0 || (c - r + 60) % 13 == 0 ? 12 : 0;
    default:
      return 0.25 * c - 0.5 * r;
  }
}

inline GroundGrid random_ground(const GroundRecipe& recipe) {
  constexpr double kCellM = 30;
  std::mt19937 random(recipe.seed);
  SampleGrid grid;
  grid.columns = recipe.columns;
  grid.rows = recipe.rows;
  for (std::int32_t r = 0; r < recipe.rows; ++r) {
    for (std::int32_t c = 0; c < recipe.columns; ++c) {
      const double u = 2.0 * c / (recipe.columns - 1) - 1, v = 2.0 * r / (recipe.rows - 1) - 1;
      const double x = c + recipe.bend * (v * v - 0.3 * u * v), y = r + recipe.bend * (u * u * 0.7);
      const double z = relief_height_m(recipe.relief, c, r, random);
      grid.positions.push_back(round_to_lattice(Position{x * kCellM, -y * kCellM, z}));
      grid.known.push_back(1);
    }
  }
  std::uniform_int_distribution<std::int32_t> column(0, recipe.columns - 1),
      row(0, recipe.rows - 1), size(1, 3);
  const auto patches = static_cast<int>(recipe.void_share * recipe.columns * recipe.rows / 4);
  for (int i = 0; i < patches; ++i) {
    const std::int32_t c0 = column(random), r0 = row(random), n = size(random);
    for (std::int32_t r = r0; r < std::min(recipe.rows, r0 + n); ++r)
      for (std::int32_t c = c0; c < std::min(recipe.columns, c0 + n); ++c)
        grid.known[grid.index(c, r)] = 0;
  }
  return GroundGrid(grid);
}

}  // namespace scarp::test
