#include "core/occlusion/certified/tile_horizon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

struct Hills {
  Tin tin;
  CertifiedRegions regions;
  TileHorizon horizon;
};

Hills hills_of(Tin tin) {
  Hills hills{std::move(tin), {}, {}};
  const LeafGroups groups = group_by_squares(hills.tin, 24);
  HidingOptions options;
  options.fans = 64;
  options.sectors = 64;
  hills.regions = certify_groups(hills.tin, groups.group_of_triangle, groups.count, options);
  const Bounds bounds = bounds_of(hills.tin.vertices);
  const double x = (bounds.low.x_m + bounds.high.x_m) / 2,
               y = (bounds.low.y_m + bounds.high.y_m) / 2;
  hills.horizon = horizon_of_nothing(x, y, bounds.high.z_m,
                                     std::hypot(bounds.high.x_m - x, bounds.high.y_m - y) + 1e-3);
  cover_groups(hills.regions, hills.horizon);
  return hills;
}

bool hides_all_groups(const CertifiedRegions& regions, const Position& eye) {
  for (std::uint32_t g = 0; g < regions.groups.size(); ++g)
    if (!hides_group(regions, g, eye)) return false;
  return true;
}

/// Cameras at and just under what the horizon says: every group's own region hides it too.
TEST(TileHorizon, HidesNothingThatAGroupsRegionShows) {
  std::mt19937_64 random(5);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const Hills hills =
        hills_of(test::triangulated(test::random_hills(40, 40, 30, seed, 300, 0.5)));
    const TileHorizon& horizon = hills.horizon;
    int hidden = 0;
    for (int i = 0; i < 4000; ++i) {
      const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
      };
      const double away_m = horizon.radius_m * std::exp2(uniform(-0.1, 6.1));
      const double azimuth = uniform(0, 2 * std::numbers::pi);
      Position eye{round_to_lattice(horizon.centre_x_m + away_m * std::cos(azimuth)),
                   round_to_lattice(horizon.centre_y_m + away_m * std::sin(azimuth)),
                   horizon.height_m - 3 * away_m};
      if (!hides_tile(horizon, eye)) continue;
      // Climbs to the highest lattice height that is hidden.
      double low_m = eye.z_m, high_m = horizon.height_m + 3 * away_m;
      while (high_m - low_m > 2 * kLatticeStepM) {
        eye.z_m = round_to_lattice((low_m + high_m) / 2);
        (hides_tile(horizon, eye) ? low_m : high_m) = eye.z_m;
      }
      eye.z_m = low_m;
      ++hidden;
      ASSERT_TRUE(hides_all_groups(hills.regions, eye)) << eye.x_m << " " << eye.y_m;
      eye.z_m = low_m - uniform(0, away_m);
      ASSERT_TRUE(hides_all_groups(hills.regions, round_to_lattice(eye)));
    }
    EXPECT_GT(hidden, 100) << seed;
  }
}

TEST(TileHorizon, OfSeveralTilesIsTheLeast) {
  const Hills hills = hills_of(test::triangulated(test::random_hills(24, 24, 30, 4, 300, 0.5)));
  TileHorizon both = hills.horizon, none = hills.horizon;
  cover_uncertified(none);
  cover(hills.horizon, both);
  EXPECT_EQ(both.slopes, hills.horizon.slopes);
  cover(none, both);
  EXPECT_EQ(both.slopes, none.slopes);
  EXPECT_FALSE(hides_tile(none, {none.centre_x_m + 2 * none.radius_m, none.centre_y_m, -1e6}));
}

}  // namespace
}  // namespace scarp
