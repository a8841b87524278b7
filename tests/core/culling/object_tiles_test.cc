#include "core/culling/object_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/support/grouped_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr std::uint32_t kSquares = 91, kStrips = 6;

/// A field of 390 m in cells of 10 m: seven rows of 13 squares of 30 m, and between them strips of
/// that width, from west to east or from south to north; every group has triangles. One orphan.
test::GroupedGround strips(bool to_north) {
  test::GroupedGround ground = test::grouped_hills(1);
  ground.groups.leaf_count = kSquares + kStrips;
  for (TriangleIndex t = 0; t < ground.tin.triangles.size(); ++t) {
    double x_m = 0, y_m = 0;
    for (const VertexIndex v : ground.tin.triangles[t])
      x_m += ground.tin.vertices[v].x_m / 3, y_m += ground.tin.vertices[v].y_m / 3;
    if (to_north) std::swap(x_m, y_m);
    const auto along = static_cast<std::uint32_t>(x_m / 30);
    const auto row = static_cast<std::uint32_t>(y_m / 30);
    ground.groups.group_of_triangle[t] = row % 2 == 1 ? kSquares + row / 2 : row / 2 * 13 + along;
  }
  ground.groups.group_of_triangle[7] = kNone;
  return ground;
}

class ObjectTilesOfStrips : public testing::TestWithParam<bool> {};

TEST_P(ObjectTilesOfStrips, AreNarrowAndEachOfOneGroup) {
  const test::GroupedGround ground = strips(GetParam());
  const ObjectTiles tiles = cut_into_tiles(ground.tin, ground.groups, {0.25, 600'000});
  ASSERT_EQ(tiles.group_of_tile.size(), tiles.tiles.leaf_count);
  EXPECT_TRUE(std::is_sorted(tiles.group_of_tile.begin(), tiles.group_of_tile.end()));
  std::vector<std::vector<Position>> corners(tiles.tiles.leaf_count);
  for (TriangleIndex t = 0; t < ground.tin.triangles.size(); ++t) {
    const GroupIndex group = ground.groups.group_of_triangle[t],
                     tile = tiles.tiles.group_of_triangle[t];
    ASSERT_EQ(tile == kNone, group == kNone);
    if (tile == kNone) continue;
    ASSERT_EQ(tiles.group_of_tile[tile], group);
    for (const VertexIndex v : ground.tin.triangles[t])
      corners[tile].push_back(ground.tin.vertices[v]);
  }
  for (const std::vector<Position>& of_tile : corners) {
    ASSERT_FALSE(of_tile.empty()) << "no tile is empty";
    const Bounds box = bounds_of(of_tile);
    EXPECT_LE(box.high.x_m - box.low.x_m, 390 * 0.25 + 20) << "none is wider, but for triangles";
    EXPECT_LE(box.high.y_m - box.low.y_m, 390 * 0.25 + 20);
  }
  EXPECT_EQ(tiles.tiles.leaf_count, kSquares + 4 * kStrips) << "squares stay whole";
}

INSTANTIATE_TEST_SUITE_P(EitherWay, ObjectTilesOfStrips, testing::Bool());

TEST(ObjectTiles, OfManyTrianglesAreCutThoughTheyAreNarrow) {
  const test::GroupedGround ground = test::grouped_hills(2);
  const ObjectTiles as_they_are = cut_into_tiles(ground.tin, ground.groups, {1, 600'000});
  EXPECT_EQ(as_they_are.tiles.group_of_triangle, ground.groups.group_of_triangle);
  const ObjectTiles cut = cut_into_tiles(ground.tin, ground.groups, {1, 10});
  EXPECT_GT(cut.tiles.leaf_count, 2 * ground.groups.leaf_count);
}

TEST(ObjectTiles, OfAWallAreCutAlongIt) {
  Tin wall;
  for (int i = 0; i <= 40; ++i)
    for (const double z_m : {0.0, 5.0}) wall.vertices.push_back({7, 1.0 * i, z_m});
  for (VertexIndex v = 0; v < 80; v += 2) {
    wall.triangles.push_back({v, v + 2, v + 3});
    wall.triangles.push_back({v, v + 3, v + 1});
  }
  Groups groups;
  groups.leaf_count = 1;
  groups.group_of_triangle.assign(wall.triangles.size(), 0);
  const ObjectTiles cut = cut_into_tiles(wall, groups, {1, 10});
  ASSERT_EQ(cut.tiles.leaf_count, 8U);
  for (GroupIndex tile = 0; tile < 8; ++tile)
    EXPECT_EQ(
        std::count(cut.tiles.group_of_triangle.begin(), cut.tiles.group_of_triangle.end(), tile),
        10);
}

/// Answers some tiles, and remembers which are there.
class SomeTiles : public CullingMethod {
 public:
  explicit SomeTiles(std::vector<GroupIndex> tiles) : tiles_(std::move(tiles)) {}
  std::string_view name() const override { return "some"; }
  CullingAnswer visible(const Camera&) override { return {tiles_, 1}; }
  bool may_show(const Bounds&) override { return false; }
  bool set_present(std::span<const std::uint8_t> is_present) override {
    present.assign(is_present.begin(), is_present.end());
    return true;
  }

  std::vector<std::uint8_t> present;

 private:
  std::vector<GroupIndex> tiles_;
};

TEST(TiledCulling, AGroupIsVisibleWhereATileOfItIs) {
  ObjectTiles tiles;
  tiles.tiles.leaf_count = 6;
  tiles.group_of_tile = {0, 0, 1, 2, 2, 3};
  auto some = std::make_unique<SomeTiles>(std::vector<GroupIndex>{1, 3, 4});
  const SomeTiles& inner = *some;
  TiledCulling culling(tiles, std::move(some));
  EXPECT_EQ(culling.name(), "some");
  EXPECT_EQ(culling.visible({}).visible_groups, (std::vector<GroupIndex>{0, 2}));
  EXPECT_FALSE(culling.may_show({}));
  EXPECT_TRUE(culling.set_present(std::vector<std::uint8_t>{1, 0, 1, 0}));
  EXPECT_EQ(inner.present, (std::vector<std::uint8_t>{1, 1, 0, 1, 1, 0}));
}

}  // namespace
}  // namespace scarp
