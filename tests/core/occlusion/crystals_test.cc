#include "core/occlusion/crystals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/occlusion/squares.h"
#include "tests/support/horizon_scenes.h"

namespace scarp {
namespace {

double rolling_m(double x_m, double y_m) {
  return 60 * std::sin(x_m / 90) * std::cos(y_m / 70) + 25 * std::sin((x_m + y_m) / 37);
}

/// Two valleys, floors at x = 0 and x = 300, and a ridge along x = 150.
double ridge_m(double x_m, double) {
  return 150 - std::abs(x_m - 150);
}

struct Scene {
  Tin tin;
  HorizonTable horizon;
};

Scene scene_of(int columns, int rows, const std::function<double(double, double)>& height_m,
               const SectorLayout& layout = {8, 2}) {
  Scene scene{lattice_tin(columns, rows, 10, height_m), {}};
  scene.horizon = exhaustive_horizon(scene.tin, layout);
  return scene;
}

const Scene& rolling() {
  static const Scene scene = scene_of(45, 45, rolling_m);
  return scene;
}

std::vector<std::uint32_t> sizes_of(const LeafGroups& groups) {
  std::vector<std::uint32_t> sizes(groups.count, 0);
  for (const GroupIndex g : groups.group_of_triangle)
    if (g != kNone) ++sizes[g];
  return sizes;
}

std::size_t orphans_of(const LeafGroups& groups) {
  return static_cast<std::size_t>(
      std::count(groups.group_of_triangle.begin(), groups.group_of_triangle.end(), kNone));
}

/// Number of parts of all groups that are connected by edges.
std::size_t parts_of(const Tin& tin, const LeafGroups& groups) {
  std::vector<bool> seen(tin.triangles.size(), false);
  std::size_t parts = 0;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    if (groups.group_of_triangle[t] == kNone || seen[t]) continue;
    ++parts;
    std::vector<TriangleIndex> open = {t};
    seen[t] = true;
    while (!open.empty()) {
      const TriangleIndex at = open.back();
      open.pop_back();
      for (const TriangleIndex n : tin.neighbours[at]) {
        if (n == kNone || seen[n] || groups.group_of_triangle[n] != groups.group_of_triangle[t])
          continue;
        seen[n] = true;
        open.push_back(n);
      }
    }
  }
  return parts;
}

TEST(Crystals, AreConnectedAndLargeEnoughWithSymmetricCollisions) {
  for (const bool merge_small : {false, true}) {
    CrystalOptions options;
    options.group_triangles = 50;
    options.merge_small = merge_small;
    const LeafGroups groups = grow_crystals(rolling().tin, rolling().horizon, options);
    ASSERT_GT(groups.count, 10U);
    for (const std::uint32_t size : sizes_of(groups)) EXPECT_GE(size, options.min_group_triangles);
    EXPECT_EQ(parts_of(rolling().tin, groups), groups.count);
    ASSERT_EQ(groups.collisions.size(), groups.count);
    for (GroupIndex a = 0; a < groups.count; ++a)
      for (const auto& [b, times] : groups.collisions[a]) {
        EXPECT_NE(a, b);
        EXPECT_GT(times, 0U);
        EXPECT_EQ(groups.collisions[b].at(a), times);
      }
  }
}

TEST(Crystals, MergingSmallOnesLeavesFewerOrphans) {
  CrystalOptions options;
  options.group_triangles = 40;
  const LeafGroups merged = grow_crystals(rolling().tin, rolling().horizon, options);
  options.merge_small = false;
  const LeafGroups freed = grow_crystals(rolling().tin, rolling().horizon, options);
  EXPECT_LT(orphans_of(merged), orphans_of(freed));
  EXPECT_GT(merged.count, freed.count);
}

TEST(Crystals, SameSeedSameGroupsOtherSeedOthers) {
  CrystalOptions options;
  options.group_triangles = 50;
  const LeafGroups first = grow_crystals(rolling().tin, rolling().horizon, options);
  const LeafGroups again = grow_crystals(rolling().tin, rolling().horizon, options);
  EXPECT_EQ(first.group_of_triangle, again.group_of_triangle);
  EXPECT_EQ(first.collisions, again.collisions);
  EXPECT_EQ(first.passes, again.passes);
  options.seed = 2;
  const LeafGroups other = grow_crystals(rolling().tin, rolling().horizon, options);
  EXPECT_NE(first.group_of_triangle, other.group_of_triangle);
}

TEST(Crystals, DoNotGrowOverARidge) {
  const Scene scene = scene_of(31, 31, ridge_m);
  CrystalOptions options;
  options.min_group_triangles = 1;
  options.seeds = 1;  // free to take everything
  for (options.seed = 0; options.seed < 5; ++options.seed) {
    const LeafGroups groups = grow_crystals(scene.tin, scene.horizon, options);
    // A quarter up either slope and below, away from the rows whose view of the ridge is cut off.
    std::vector<bool> west(groups.count, false), east(groups.count, false);
    for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t) {
      const GroupIndex g = groups.group_of_triangle[t];
      const Position& p = scene.tin.vertices[scene.tin.triangles[t][0]];
      if (g == kNone || std::abs(p.y_m - 150) > 60) continue;
      if (p.x_m < 40) west[g] = true;
      if (p.x_m > 260) east[g] = true;
    }
    for (GroupIndex g = 0; g < groups.count; ++g) EXPECT_FALSE(west[g] && east[g]) << g;
    EXPECT_GE(std::count(west.begin(), west.end(), true), 1);
    EXPECT_GE(std::count(east.begin(), east.end(), true), 1);
  }
}

TEST(Crystals, GrowOverEverythingWhereNothingIsHidden) {
  Scene scene = scene_of(12, 12, rolling_m, {8, 1});
  std::fill(scene.horizon.horizon_vertex.begin(), scene.horizon.horizon_vertex.end(), kNone);
  CrystalOptions options;
  options.seeds = 3;
  const LeafGroups groups = grow_crystals(scene.tin, scene.horizon, options);
  EXPECT_EQ(orphans_of(groups), 0U);
  EXPECT_EQ(groups.count, 3U);
  EXPECT_EQ(groups.passes, 1U);
  // In rounds of one triangle each, nobody is left far behind.
  for (const std::uint32_t size : sizes_of(groups)) EXPECT_GT(size, 30U);
}

/// The horizon that limits growth is that of the lowest vertex so far, not of the seed.
TEST(Crystals, HorizonOfTheLowestVertexLimitsGrowth) {
  // A strip that falls to the east, then rises: from the bottom its end is beyond a shoulder.
  Tin tin;
  const double heights_m[] = {9, 8, 0, 6, 9, 9};
  for (int i = 0; i < 6; ++i)
    tin.vertices.push_back({10.0 * i, i % 2 == 0 ? 0.0 : 10.0, heights_m[i]});
  tin.triangles = {{0, 2, 1}, {1, 2, 3}, {2, 4, 3}, {3, 4, 5}};
  connect_neighbours(tin);
  ASSERT_EQ(check_tin(tin), std::nullopt);
  HorizonTable horizon{{8, 1}, std::vector<VertexIndex>(6 * 8, kNone)};
  horizon.horizon_vertex[2 * 8 + 0] = 3;  // over vertex 3, vertex 5 at (50, 10) is under the ray
  CrystalOptions options;
  options.seeds = 1;
  options.max_passes = 1;
  options.min_group_triangles = 1;
  // The last triangle is in a group only where it is the seed: one in four times.
  int without_the_last = 0;
  for (options.seed = 0; options.seed < 40; ++options.seed) {
    const LeafGroups groups = grow_crystals(tin, horizon, options);
    without_the_last += groups.group_of_triangle == std::vector<GroupIndex>{0, 0, 0, kNone} ? 1 : 0;
  }
  EXPECT_GE(without_the_last, 24);
  EXPECT_LT(without_the_last, 40);
}

TEST(Crystals, SettingsOfTheThesisCanBeAskedFor) {
  CrystalOptions options;
  options.seeds = 100;
  options.max_passes = 10;
  options.max_groups = 40;
  options.merge_small = false;
  const LeafGroups groups = grow_crystals(rolling().tin, rolling().horizon, options);
  EXPECT_LE(groups.count, 40U);
  EXPECT_LE(groups.passes, 10U);
  EXPECT_GE(groups.passes, 1U);
  options.max_passes = 1;
  EXPECT_EQ(grow_crystals(rolling().tin, rolling().horizon, options).passes, 1U);
}

TEST(Crystals, FurtherPassesTakeOrphansUp) {
  CrystalOptions options;
  options.group_triangles = 60;
  options.max_passes = 1;
  const std::size_t once = orphans_of(grow_crystals(rolling().tin, rolling().horizon, options));
  options.max_passes = 10;
  const LeafGroups groups = grow_crystals(rolling().tin, rolling().horizon, options);
  EXPECT_LT(orphans_of(groups), once);
  EXPECT_GT(groups.passes, 1U);
}

TEST(Crystals, OneTriangleAndNone) {
  Tin tin;
  HorizonTable horizon{{8, 1}, {}};
  EXPECT_EQ(grow_crystals(tin, horizon, {}).count, 0U);
  tin.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  tin.triangles = {{0, 1, 2}};
  connect_neighbours(tin);
  horizon.horizon_vertex.assign(3 * 8, kNone);
  EXPECT_EQ(orphans_of(grow_crystals(tin, horizon, {})), 1U);
  CrystalOptions options;
  options.min_group_triangles = 1;
  EXPECT_EQ(grow_crystals(tin, horizon, options).group_of_triangle, (std::vector<GroupIndex>{0}));
}

TEST(Collisions, FusingAddsUpAndForgetsTheirOwn) {
  Collisions collisions(4);
  for (int i = 0; i < 3; ++i) count_collision(collisions, 0, 1);
  count_collision(collisions, 0, 2);
  count_collision(collisions, 1, 2);
  fuse_collisions(collisions, 0, 1, 3);
  EXPECT_TRUE(collisions[0].empty() && collisions[1].empty());
  EXPECT_EQ(collisions[3], (std::map<GroupIndex, std::uint64_t>{{2, 2}}));
  EXPECT_EQ(collisions[2], (std::map<GroupIndex, std::uint64_t>{{3, 2}}));
  drop_collisions(collisions, 2);
  EXPECT_TRUE(collisions[2].empty() && collisions[3].empty());
}

TEST(Squares, HaveTheMeanSizeAndNoOrphans) {
  const LeafGroups groups = group_by_squares(rolling().tin, 50);
  EXPECT_EQ(orphans_of(groups), 0U);
  const double mean = static_cast<double>(rolling().tin.triangles.size()) / groups.count;
  EXPECT_NEAR(mean, 50, 5);
  for (const std::uint32_t size : sizes_of(groups)) EXPECT_GT(size, 0U);
  std::uint64_t shared = 0;
  for (TriangleIndex t = 0; t < rolling().tin.triangles.size(); ++t)
    for (const TriangleIndex n : rolling().tin.neighbours[t])
      if (n != kNone && groups.group_of_triangle[t] != groups.group_of_triangle[n]) ++shared;
  for (const auto& met : groups.collisions)
    for (const auto& [other, times] : met) shared -= times;
  EXPECT_EQ(shared, 0U);
}

TEST(Squares, OfFourCellsAreTheQuarters) {
  const Tin tin = lattice_tin(9, 9, 10, rolling_m);
  const LeafGroups groups = group_by_squares(tin, 32);
  EXPECT_EQ(groups.count, 4U);
  EXPECT_EQ(sizes_of(groups), (std::vector<std::uint32_t>{32, 32, 32, 32}));
  EXPECT_EQ(group_by_squares(tin, 1).count, 128U);
  EXPECT_EQ(group_by_squares(tin, 1000).count, 1U);
}

}  // namespace
}  // namespace scarp
