#include "core/occlusion/certified/tile_horizon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"
#include "tests/support/tile_cameras.h"

namespace scarp {
namespace {

struct Valley {
  CertifiedRegions regions;  ///< of the groups in the valley alone
  TileHorizon horizon;
};

/// Rough ground within a ring of ridges of uneven height; the tile is what lies within the ring.
Valley valley_in_ridges(std::uint64_t seed, const HorizonLayout& layout = kTilesetHorizon) {
  constexpr int kSide = 44;
  constexpr double kCellM = 30, kRingM = 460, kTileM = 250;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> rough(0, 8);
  const double turn = rough(random);
  const Tin tin = test::triangulated(
      test::grid_of(kSide, kSide, kCellM, [&](std::int32_t column, std::int32_t row) {
        const double x = (column - kSide / 2) * kCellM, y = (row - kSide / 2) * kCellM;
        const double from_ring = (std::hypot(x, y) - kRingM) / 110;
        const double ridge = 180 + 80 * std::sin(3 * std::atan2(y, x) + turn);
        return ridge * std::exp(-from_ring * from_ring) + rough(random);
      }));
  const LeafGroups groups = group_by_squares(tin, 24);
  HidingOptions options;
  options.fans = 32;
  options.sectors = 32;
  const CertifiedRegions all = certify_groups(tin, groups.group_of_triangle, groups.count, options);
  const double middle_m = kSide / 2 * kCellM;
  Valley valley;
  valley.regions.layout = all.layout;
  double radius_m = 0, highest_m = 0;
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    const CertifiedGroup& group = all.groups[g];
    const double away_m = std::hypot(group.centre_x_m - middle_m, group.centre_y_m - middle_m);
    if (away_m > kTileM) continue;
    valley.regions.groups.push_back(group);
    for (std::int32_t s = 0; s < all.layout.sectors; ++s)
      valley.regions.steps.push_back(all.at(g, s));
    radius_m = std::max(radius_m, away_m + static_cast<double>(group.radius_m));
    highest_m = std::max(highest_m, group.height_m);
  }
  valley.horizon = horizon_of_nothing(layout, middle_m, middle_m, highest_m, radius_m);
  cover_groups(valley.regions, valley.horizon);
  return valley;
}

/// Cameras at and just under what the horizon says: every group's own region hides it too.
TEST(TileHorizon, HidesNothingThatAGroupsRegionShows) {
  std::mt19937_64 random(5);
  for (const std::uint32_t seed : {1U, 2U}) {
    const Valley valley = valley_in_ridges(seed, seed == 1 ? kTilesetHorizon : kTreeHorizon);
    const TileHorizon& horizon = valley.horizon;
    int hidden = 0;
    for (int i = 0; i < 4000; ++i) {
      std::optional<Position> eye = test::highest_hidden_camera(horizon, random);
      if (!eye) continue;
      ++hidden;
      ASSERT_TRUE(test::hides_all_groups(valley.regions, *eye)) << eye->x_m << " " << eye->y_m;
      const double away_m =
          std::hypot(eye->x_m - horizon.centre_x_m, eye->y_m - horizon.centre_y_m);
      eye->z_m -= std::uniform_real_distribution<double>(0, away_m)(random);
      ASSERT_TRUE(test::hides_all_groups(valley.regions, round_to_lattice(*eye)));
    }
    EXPECT_GT(hidden, 100) << seed;
  }
}

TEST(TileHorizon, OfSeveralTilesIsTheLeast) {
  const Valley valley = valley_in_ridges(4);
  TileHorizon both = valley.horizon, none = valley.horizon;
  cover_uncertified(none);
  cover(valley.horizon, both);
  EXPECT_EQ(both.slopes, valley.horizon.slopes);
  cover(none, both);
  EXPECT_EQ(both.slopes, none.slopes);
  EXPECT_FALSE(hides_tile(none, {none.centre_x_m + 2 * none.radius_m, none.centre_y_m, -1e6}));
}

}  // namespace
}  // namespace scarp
