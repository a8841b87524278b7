#pragma once

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "core/occlusion/certified/tile_horizon.h"

namespace scarp::test {

/// A camera somewhere around a tile, raised to the highest place of the lattice that the tile's
/// horizon hides it from; none where that hides nothing far below either.
inline std::optional<Position> highest_hidden_camera(const TileHorizon& horizon,
                                                     std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double away_m = horizon.radius_m * std::exp2(uniform(-0.1, 6.1));
  const double azimuth = uniform(0, 2 * std::numbers::pi);
  Position eye{round_to_lattice(horizon.centre_x_m + away_m * std::cos(azimuth)),
               round_to_lattice(horizon.centre_y_m + away_m * std::sin(azimuth)),
               horizon.height_m - 3 * away_m};
  if (!hides_tile(horizon, eye)) return {};
  double low_m = eye.z_m, high_m = horizon.height_m + 3 * away_m;
  while (high_m - low_m > 2 * kLatticeStepM) {
    eye.z_m = round_to_lattice((low_m + high_m) / 2);
    (hides_tile(horizon, eye) ? low_m : high_m) = eye.z_m;
  }
  eye.z_m = low_m;
  return eye;
}

/// Whether each group's own region hides it.
inline bool hides_all_groups(const CertifiedRegions& regions, const Position& eye) {
  for (std::uint32_t g = 0; g < regions.groups.size(); ++g)
    if (!hides_group(regions, g, eye)) return false;
  return true;
}

}  // namespace scarp::test
