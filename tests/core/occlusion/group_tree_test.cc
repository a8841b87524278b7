#include "core/occlusion/group_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/occlusion/build_groups.h"
#include "core/occlusion/region.h"
#include "core/occlusion/squares.h"
#include "core/threads/parallel_for.h"
#include "tests/support/horizon_scenes.h"

namespace scarp {
namespace {

double rolling_m(double x_m, double y_m) {
  return 60 * std::sin(x_m / 90) * std::cos(y_m / 70) + 25 * std::sin((x_m + y_m) / 37);
}

struct Scene {
  Tin tin = lattice_tin(40, 40, 10, rolling_m);
  HorizonTable horizon = exhaustive_horizon(tin, {8, 2});
};

const Scene& rolling() {
  static const Scene scene;
  return scene;
}

CrystalOptions small_groups() {
  CrystalOptions options;
  options.group_triangles = 40;
  options.min_group_triangles = 10;
  return options;
}

/// Four groups in a row over a strip, with given collisions between neighbours.
LeafGroups four_in_a_row(const Tin& tin, std::uint64_t first, std::uint64_t second,
                         std::uint64_t third) {
  LeafGroups leaves;
  leaves.count = 4;
  leaves.collisions.resize(4);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    leaves.group_of_triangle.push_back(static_cast<GroupIndex>(4 * t / tin.triangles.size()));
  const std::uint64_t times[] = {first, second, third};
  for (GroupIndex g = 0; g < 3; ++g) {
    if (times[g] == 0) continue;
    leaves.collisions[g][g + 1] = leaves.collisions[g + 1][g] = times[g];
  }
  return leaves;
}

/// A scene so wide that no circle of the strip covers a quarter of it.
struct Strip {
  Tin tin = lattice_tin(9, 2, 1, [](double, double) { return 0.0; });
  HorizonTable horizon;

  Strip() {
    const auto far = static_cast<VertexIndex>(tin.vertices.size());
    tin.vertices.insert(tin.vertices.end(), {{100, 100, 0}, {200, 100, 0}, {200, 200, 0}});
    tin.triangles.push_back({far, far + 1, far + 2});
    connect_neighbours(tin);
    horizon = {{8, 1}, std::vector<VertexIndex>(8 * tin.vertices.size(), kNone)};
  }

  Groups tree(std::uint64_t first, std::uint64_t second, std::uint64_t third) const {
    Tin strip = tin;
    strip.triangles.pop_back();
    LeafGroups leaves = four_in_a_row(strip, first, second, third);
    leaves.group_of_triangle.push_back(kNone);
    return build_group_tree(tin, horizon, leaves);
  }
};

TEST(GroupTree, PairsWithMostCollisionsMergeFirst) {
  const Groups groups = Strip().tree(2, 9, 3);
  ASSERT_EQ(groups.nodes.size(), 7U);
  EXPECT_EQ(groups.nodes[4].children, (std::array<GroupIndex, 2>{1, 2}));
  EXPECT_EQ(groups.nodes[5].children, (std::array<GroupIndex, 2>{3, 4}));  // 3 against 2
  EXPECT_EQ(groups.nodes[6].children, (std::array<GroupIndex, 2>{0, 5}));
  EXPECT_EQ(groups.nodes[6].triangles, 16U);
  EXPECT_EQ(groups.nodes[6].parent, kNone);
}

TEST(GroupTree, AMergedPairIsCombinedOnlyOnceALevel) {
  const Groups groups = Strip().tree(5, 2, 5);
  ASSERT_EQ(groups.nodes.size(), 7U);
  EXPECT_EQ(groups.nodes[4].children, (std::array<GroupIndex, 2>{0, 1}));
  EXPECT_EQ(groups.nodes[5].children, (std::array<GroupIndex, 2>{2, 3}));
  EXPECT_EQ(groups.nodes[6].children, (std::array<GroupIndex, 2>{4, 5}));
}

TEST(GroupTree, WithoutCollisionsANodeIsTopLevel) {
  const Groups groups = Strip().tree(5, 0, 0);
  EXPECT_EQ(groups.nodes.size(), 5U);
  EXPECT_EQ(groups.nodes[2].parent, kNone);
  EXPECT_EQ(groups.nodes[3].parent, kNone);
  EXPECT_EQ(groups.nodes[4].parent, kNone);
}

TEST(GroupTree, NodesThatSpanMoreThanAQuarterAreNotMergedOn) {
  const Groups groups = build_groups(rolling().tin, rolling().horizon, small_groups());
  const double area_m2 = 390.0 * 390.0;
  std::size_t large = 0;
  for (const GroupNode& node : groups.nodes)
    if (std::numbers::pi * node.radius_m * node.radius_m > 0.25 * area_m2) {
      EXPECT_EQ(node.parent, kNone);
      ++large;
    }
  EXPECT_GT(large, 0U);
}

TEST(GroupTree, KeepsItsInvariants) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    CrystalOptions options = small_groups();
    options.seed = seed;
    const Groups groups = build_groups(rolling().tin, rolling().horizon, options);
    EXPECT_GT(groups.nodes.size(), groups.leaf_count);
    EXPECT_EQ(check_groups(rolling().tin, groups), std::nullopt);
  }
  const Groups squares =
      build_group_tree(rolling().tin, rolling().horizon, group_by_squares(rolling().tin, 40));
  EXPECT_EQ(check_groups(rolling().tin, squares), std::nullopt);
}

TEST(GroupTree, RegionsAreThePointwiseIntersectionOfAllVertices) {
  const Groups groups = build_groups(rolling().tin, rolling().horizon, small_groups());
  const auto& tin = rolling().tin;
  int hidden = 0, seen = 0;
  for (GroupIndex leaf = 0; leaf < groups.leaf_count; ++leaf)
    for (GroupIndex node = leaf; node != kNone; node = groups.nodes[node].parent)
      for (std::int32_t sector = 0; sector < 8; ++sector) {
        const SectorAxis axis = sector_axis({8, 2}, sector);
        const RegionView region = groups.regions.at(node, sector);
        if (region.count == 0) continue;
        // Of the whole node where it is the leaf, of one leaf's vertices (a bound) above.
        for (int i = 0; i < 20; ++i) {
          const double u_m = region.points[0].u_m - 20 + 15 * i;
          for (const double z_m : {-120.0, -40.0, 0.0, 40.0, 120.0}) {
            bool all = true;
            for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
              if (groups.group_of_triangle[t] != leaf) continue;
              for (const VertexIndex v : tin.triangles[t]) {
                const Position& h = tin.vertices[rolling().horizon.at(v, sector)];
                all = all && hides(region_of_vertex(tin.vertices[v], h, axis).view(), u_m, z_m);
              }
            }
            const bool answer = hides(region, u_m, z_m);
            ASSERT_TRUE(node == leaf ? answer == all : all || !answer);
            (answer ? hidden : seen)++;
          }
        }
      }
  EXPECT_GT(hidden, 100);
  EXPECT_GT(seen, 100);
}

TEST(GroupTree, AVertexWithoutHorizonEmptiesTheRegionsAbove) {
  HorizonTable horizon = rolling().horizon;
  const Groups groups = build_groups(rolling().tin, horizon, small_groups());
  TriangleIndex t = 0;
  while (groups.group_of_triangle[t] == kNone ||
         groups.regions.at(groups.group_of_triangle[t], 2).count == 0)
    ++t;
  LeafGroups leaves;
  leaves.group_of_triangle = groups.group_of_triangle;
  leaves.count = groups.leaf_count;
  leaves.collisions.resize(leaves.count);
  horizon.horizon_vertex[rolling().tin.triangles[t][1] * 8 + 2] = kNone;
  const Groups fewer = build_group_tree(rolling().tin, horizon, leaves);
  EXPECT_EQ(fewer.regions.at(groups.group_of_triangle[t], 2).count, 0U);
}

bool same_bits(const Groups& a, const Groups& b) {
  const auto same_points = [](const RegionPoint& p, const RegionPoint& q) {
    return p.u_m == q.u_m && p.z_m == q.z_m;
  };
  const auto same_node = [](const GroupNode& p, const GroupNode& q) {
    return p.parent == q.parent && p.children == q.children && p.triangles == q.triangles &&
           p.centre_x_m == q.centre_x_m && p.centre_y_m == q.centre_y_m && p.radius_m == q.radius_m;
  };
  return a.group_of_triangle == b.group_of_triangle && a.leaf_count == b.leaf_count &&
         std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(), same_node) &&
         a.regions.first == b.regions.first && a.regions.end_slope == b.regions.end_slope &&
         std::equal(a.regions.points.begin(), a.regions.points.end(), b.regions.points.begin(),
                    b.regions.points.end(), same_points);
}

TEST(BuildGroups, SameBitsForAnyThreadCount) {
  const Groups reference = build_groups(rolling().tin, rolling().horizon, small_groups());
  for (const int threads : {1, 2, 7}) {
    set_thread_count(threads);
    EXPECT_TRUE(
        same_bits(reference, build_groups(rolling().tin, rolling().horizon, small_groups())));
  }
  set_thread_count(0);
  CrystalOptions options = small_groups();
  options.seed = 99;
  EXPECT_FALSE(same_bits(reference, build_groups(rolling().tin, rolling().horizon, options)));
}

TEST(BuildGroups, ReportsPassesOrphansAndRisingProgress) {
  GroupingReport report;
  double last = 0;
  const Groups groups = build_groups(
      rolling().tin, rolling().horizon, small_groups(),
      [&](double done) {
        EXPECT_GE(done, last);
        EXPECT_LE(done, 1);
        last = done;
      },
      &report);
  EXPECT_EQ(last, 1);
  EXPECT_GE(report.passes, 1U);
  std::uint32_t grouped = 0;
  for (GroupIndex g = 0; g < groups.leaf_count; ++g) grouped += groups.nodes[g].triangles;
  EXPECT_EQ(report.orphans + grouped, rolling().tin.triangles.size());
}

TEST(CheckGroups, NamesTheFirstBrokenInvariant) {
  const Tin& tin = rolling().tin;
  const Groups good = build_groups(tin, rolling().horizon, small_groups());
  const GroupIndex inner = good.leaf_count;
  Groups bad = good;
  bad.nodes[3].triangles += 1;
  bad.nodes[inner].children[0] = bad.nodes[inner].children[1];
  EXPECT_EQ(check_groups(tin, bad), "node " + std::to_string(good.nodes[inner].children[0]) +
                                        " is not a child of its parent");
  bad = good;
  bad.nodes.back().radius_m /= 2;
  EXPECT_TRUE(check_groups(tin, bad)->starts_with("the circle of node"));
  bad = good;
  bad.nodes[inner].triangles += 1;
  EXPECT_EQ(check_groups(tin, bad),
            "node " + std::to_string(inner) + " has not the triangles of its children");
  bad = good;
  const auto grouped = std::find_if(bad.group_of_triangle.begin(), bad.group_of_triangle.end(),
                                    [](GroupIndex g) { return g != kNone; });
  const GroupIndex robbed = std::exchange(*grouped, GroupIndex{kNone});
  EXPECT_EQ(check_groups(tin, bad),
            "node " + std::to_string(robbed) + " has a wrong number of triangles");
  bad = good;
  bad.regions.end_slope.pop_back();
  EXPECT_EQ(check_groups(tin, bad), "a region is missing");
  bad = good;
  for (std::size_t row = good.leaf_count * 8; row < bad.regions.end_slope.size(); ++row)
    if (bad.regions.first[row] < bad.regions.first[row + 1]) {
      bad.regions.points[bad.regions.first[row]].u_m -= 1;
      break;
    }
  EXPECT_NE(check_groups(tin, bad)->find("reaches out of node"), std::string::npos);
}

TEST(BuildGroups, FlatOneTriangleAndEverythingOrphaned) {
  const Tin flat = lattice_tin(20, 20, 10, [](double, double) { return 5.0; });
  const Groups groups = build_groups(flat, exhaustive_horizon(flat, {8, 1}), small_groups());
  EXPECT_GT(groups.leaf_count, 0U);
  EXPECT_EQ(check_groups(flat, groups), std::nullopt);

  CrystalOptions too_large;
  too_large.min_group_triangles = 100000;
  const Groups none = build_groups(flat, exhaustive_horizon(flat, {8, 1}), too_large);
  EXPECT_EQ(none.leaf_count, 0U);
  EXPECT_TRUE(none.nodes.empty());
  EXPECT_EQ(check_groups(flat, none), std::nullopt);

  Tin one;
  one.vertices = {{0, 0, 0}, {10, 0, 3}, {0, 10, 6}};
  one.triangles = {{0, 1, 2}};
  connect_neighbours(one);
  CrystalOptions options;
  options.min_group_triangles = 1;
  const Groups single = build_groups(one, exhaustive_horizon(one, {8, 1}), options);
  EXPECT_EQ(single.leaf_count, 1U);
  EXPECT_EQ(check_groups(one, single), std::nullopt);
}

}  // namespace
}  // namespace scarp
