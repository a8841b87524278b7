#include "core/occlusion/certified/tile_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"
#include "tests/support/tile_cameras.h"

namespace scarp {
namespace {

constexpr std::int32_t kTilesAcross = 4;

/// Rough ground with ridges across it, its groups by squares, shared out to 4 x 4 tiles.
struct Hills {
  std::vector<Groups> tiles;  ///< row by row, without triangles
  std::vector<TileNode> nodes;
};

Hills hills(std::uint64_t seed) {
  constexpr std::int32_t kSide = 48;
  constexpr double kCellM = 30;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> rough(0, 8);
  const Tin tin = test::triangulated(
      test::grid_of(kSide, kSide, kCellM, [&](std::int32_t column, std::int32_t) {
        const double ridge = std::max(0.0, 1 - std::abs(column % 20 - 10) / 4.0);
        return 220 * ridge + rough(random);
      }));
  const LeafGroups groups = group_by_squares(tin, 24);
  HidingOptions options;
  options.fans = 32;
  options.sectors = 32;
  const CertifiedRegions all = certify_groups(tin, groups.group_of_triangle, groups.count, options);
  Hills made;
  made.tiles.resize(kTilesAcross * kTilesAcross);
  const Bounds bounds = bounds_of(tin.vertices);
  const double width_m = (bounds.high.x_m - bounds.low.x_m) / kTilesAcross;
  const double height_m = (bounds.high.y_m - bounds.low.y_m) / kTilesAcross;
  const auto place = [](double at_m, double low_m, double tile_m) {
    return std::clamp(static_cast<std::int32_t>((at_m - low_m) / tile_m), 0, kTilesAcross - 1);
  };
  for (std::uint32_t g = 0; g < all.groups.size(); ++g) {
    const CertifiedGroup& group = all.groups[g];
    Groups& tile = made.tiles[static_cast<std::size_t>(
        place(group.centre_y_m, bounds.low.y_m, height_m) * kTilesAcross +
        place(group.centre_x_m, bounds.low.x_m, width_m))];
    ++tile.leaf_count;
    tile.certified.layout = all.layout;
    tile.certified.groups.push_back(group);
    for (std::int32_t s = 0; s < all.layout.sectors; ++s)
      tile.certified.steps.push_back(all.at(g, s));
  }
  for (std::int32_t i = 0; i < kTilesAcross * kTilesAcross; ++i) {
    const std::int32_t column = i % kTilesAcross, row = i / kTilesAcross;
    Bounds own = bounds;
    own.low.x_m += column * width_m, own.high.x_m = own.low.x_m + width_m;
    own.low.y_m += row * height_m, own.high.y_m = own.low.y_m + height_m;
    made.nodes.push_back(tile_node({2, column, row}, own, made.tiles[static_cast<std::size_t>(i)]));
  }
  return made;
}

class TileTreeOfHills : public testing::Test {
 protected:
  static inline const Hills hills_ = hills(3);
  static inline const TileTree tree_ = tree_over(hills_.nodes);
};

/// Cameras at and just under what a node says: every group below is hidden by its own region too.
TEST_F(TileTreeOfHills, NodesHideNothingThatAGroupBelowShows) {
  ASSERT_EQ(tree_.nodes.size(), 1U + 4 + 16);
  EXPECT_EQ(check_tile_tree(tree_), std::nullopt);
  EXPECT_EQ(check_tile_tree_bounds(tree_), std::nullopt);
  std::mt19937_64 random(5);
  std::array<int, 3> hidden{};
  for (int i = 0; i < 6000; ++i) {
    const TileNode& node = tree_.nodes[static_cast<std::size_t>(i) % tree_.nodes.size()];
    const std::optional<Position> eye = test::highest_hidden_camera(node.horizon, random);
    if (!eye) continue;
    ++hidden[static_cast<std::size_t>(node.tile.level)];
    const std::int32_t wide = kTilesAcross >> node.tile.level;
    for (std::int32_t k = 0; k < wide * wide; ++k) {
      const std::int32_t column = node.tile.column * wide + k % wide;
      const std::int32_t row = node.tile.row * wide + k / wide;
      const Groups& tile = hills_.tiles[static_cast<std::size_t>(row * kTilesAcross + column)];
      ASSERT_TRUE(test::hides_all_groups(tile.certified, *eye))
          << name_of(node.tile) << " " << eye->x_m << " " << eye->y_m << " " << eye->z_m;
    }
  }
  // Nothing stands around all of the ground that could hide the root.
  EXPECT_GT(hidden[1], 10);
  EXPECT_GT(hidden[2], 50);
}

TEST_F(TileTreeOfHills, FindsTheTilesThatHideByThemselves) {
  std::mt19937_64 random(6);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::size_t found = 0, tested = 0;
  for (int i = 0; i < 500; ++i) {
    const Position eye{uniform(-3000, 4500), uniform(-4500, 3000), uniform(-300, 250)};
    std::vector<TileId> expected;
    for (const TileNode& node : hills_.nodes)
      if (hides_tile(node.horizon, eye)) expected.push_back(node.tile);
    const HiddenTiles hidden = hidden_tiles(tree_, eye);
    std::ranges::sort(expected);
    ASSERT_EQ(hidden.tiles, expected);
    found += expected.size();
    tested += hidden.nodes_tested;
  }
  EXPECT_GT(found, 500U);
  EXPECT_LT(tested, 500 * tree_.nodes.size());
}

TEST_F(TileTreeOfHills, NothingIsHiddenOfWhatHasOrphansOrNoRegions) {
  Groups with_orphan = hills_.tiles[5], without = hills_.tiles[5];
  with_orphan.group_of_triangle = {0, kNone};
  without.certified = {};
  for (const Groups* groups : {&with_orphan, &without}) {
    const TileNode node = tile_node({2, 1, 1}, {{0, 0, 0}, {300, 300, 100}}, *groups);
    EXPECT_FALSE(hides_tile(node.horizon, {2000, 150, -1e6}));
    const TileTree tree = tree_over({node});
    EXPECT_EQ(hidden_tiles(tree, {2000, 150, -1e6}).tiles.size(), 0U);
  }
}

TEST(TileTree, OfNothingHidesNothing) {
  const TileTree tree = tree_over({});
  EXPECT_EQ(check_tile_tree(tree), std::nullopt);
  EXPECT_TRUE(hidden_tiles(tree, {}).tiles.empty());
}

TEST_F(TileTreeOfHills, CheckNamesWhatIsBroken) {
  const auto broken = [](const auto& damage) {
    TileTree tree = tree_;
    damage(tree);
    return check_tile_tree(tree).value_or("");
  };
  EXPECT_EQ(broken([](TileTree& t) { t.nodes[3].horizon.slopes.pop_back(); }),
            "node 3 has not a slope for each cell");
  EXPECT_EQ(broken([](TileTree& t) { t.nodes[2].horizon.radius_m = 0; }),
            "node 2 has no proper circle");
  EXPECT_EQ(broken([](TileTree& t) { t.nodes[7].horizon.slopes[9] = std::nanf(""); }),
            "node 7 has a slope that is no number");
  EXPECT_EQ(broken([](TileTree& t) { std::swap(t.nodes[5], t.nodes[6]); }),
            "node 6 is not in its order");
  EXPECT_EQ(broken([](TileTree& t) { t.nodes.erase(t.nodes.begin() + 1); }),
            "node 4 has no node above it");
  EXPECT_EQ(broken([](TileTree& t) { t.nodes.erase(t.nodes.begin()); }),
            "node 1 has no node above it");
  TileTree tree = tree_;
  for (float& slope : tree.nodes[1].horizon.slopes)
    if (slope > TileHorizon::kNothingHidden) slope += 1;
  EXPECT_NE(check_tile_tree_bounds(tree).value_or("").find("node 1 hides what node"),
            std::string::npos);
}

}  // namespace
}  // namespace scarp
