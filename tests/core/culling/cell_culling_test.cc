#include "core/culling/cell_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/culling/certified_culling.h"
#include "core/culling/certified_hiding.h"
#include "core/culling/joint_hiding.h"
#include "core/culling/occluder_hiding.h"
#include "core/occlusion/certified/box_hiding.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/virtual_occluders.h"
#include "core/sight/triangle_sight.h"
#include "tests/support/grouped_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

struct Scene {
  test::GroupedGround ground;
  GroupBatches batches;
  BoxTree tree;
  CertifiedRegions regions;
  TinIndex index;

  explicit Scene(test::GroupedGround made)
      : ground(std::move(made)),
        batches(ground.tin, ground.groups),
        tree(batches),
        index(ground.tin) {
    HidingOptions options;
    options.fans = 32;
    options.sectors = 32;
    regions = certify_groups(ground.tin, ground.groups.group_of_triangle, ground.groups.leaf_count,
                             options);
  }
};

const Scene& hills() {
  static const Scene scene(test::grouped_by_squares(
      test::triangulated(test::random_hills(36, 36, 10, 4, 150, 0.01), 1), 12));
  return scene;
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  std::size_t below(std::size_t n) { return random_() % n; }
  /// Corners and borders as often as the inside.
  Position in(const Bounds& box, bool at_border) {
    const auto within = [&](double low, double high) {
      return low + (at_border ? std::round(unit()) : unit()) * (high - low);
    };
    return round_to_lattice(Position{within(box.low.x_m, box.high.x_m),
                                     within(box.low.y_m, box.high.y_m),
                                     within(box.low.z_m, box.high.z_m)});
  }
  Bounds box_over(const Tin& tin, double size_m) {
    Position low = tin.vertices[below(tin.vertices.size())];
    low.z_m += 2;
    return {low, round_to_lattice(Position{low.x_m + size_m * unit(), low.y_m + size_m * unit(),
                                           low.z_m + size_m * unit()})};
  }

 private:
  std::mt19937 random_;
};

std::vector<GroupIndex> groups_below(const BoxTree& tree, std::span<const NodeIndex> nodes) {
  std::vector<GroupIndex> groups;
  for (const NodeIndex node : nodes)
    for (const GroupIndex g : tree.groups_of(tree.nodes()[node])) groups.push_back(g);
  return groups;
}

TEST(BoxHiding, WhatIsHiddenFromABoxIsHiddenFromEveryCameraInIt) {
  const Scene& scene = hills();
  Draw draw(1);
  std::uint64_t hidden = 0, hidden_from_middle = 0;
  for (int i = 0; i < 150; ++i) {
    const double size_m = std::exp(4 * draw.unit());
    Bounds box{draw.in({{0, 0, -20}, {360, 360, 130}}, false), {}};
    box.high = round_to_lattice(Position{box.low.x_m + size_m * draw.unit(),
                                         box.low.y_m + size_m * draw.unit(),
                                         box.low.z_m + size_m * draw.unit()});
    for (GroupIndex g = 0; g < scene.regions.groups.size(); ++g) {
      const Position middle = round_to_lattice(Position{
          (box.low.x_m + box.high.x_m) / 2, (box.low.y_m + box.high.y_m) / 2, box.high.z_m});
      hidden_from_middle += hides_group(scene.regions, g, middle);
      if (!hides_group_from(scene.regions, g, box)) continue;
      ++hidden;
      for (int k = 0; k < 12; ++k)
        ASSERT_TRUE(hides_group(scene.regions, g, draw.in(box, k < 6)))
            << "group " << g << ", box " << i;
    }
  }
  EXPECT_GT(hidden, hidden_from_middle / 4) << "it must also find something";
}

TEST(BoxTree, IsNumberedInPreOrder) {
  const BoxTree& tree = hills().tree;
  for (NodeIndex n = 0; n < tree.nodes().size(); ++n) {
    const BoxTree::Node& node = tree.nodes()[n];
    if (node.is_leaf()) {
      EXPECT_EQ(tree.last_below(n), n);
      continue;
    }
    EXPECT_EQ(node.left, n + 1);
    EXPECT_EQ(node.right, tree.last_below(node.left) + 1);
    EXPECT_EQ(tree.last_below(node.right), tree.last_below(n));
  }
  EXPECT_EQ(tree.last_below(0) + 1, tree.nodes().size());
}

/// Whatever the active list was, the walk ends at what a walk from the root ends at.
TEST(JointWalk, TakesAnyActiveListToTheLeavesThatAreNotHidden) {
  const BoxTree& tree = hills().tree;
  const std::uint64_t all = tree.nodes().size();
  Draw draw(3);
  std::vector<ActiveNode> active{{0, false}};
  for (int i = 0; i < 200; ++i) {
    std::vector<NodeIndex> hidden;
    for (NodeIndex n = 0; n < all; ++n)
      if (draw.unit() < 0.05 * (i % 5)) {
        hidden.push_back(n);
        n = tree.last_below(n);
      }
    std::vector<std::uint8_t> is_hidden(tree.nodes()[0].count, 0);
    for (const GroupIndex g : groups_below(tree, hidden)) is_hidden[g] = 1;
    std::vector<ActiveNode> expected;
    for (NodeIndex n = 0; n < all; ++n) {
      const bool hides = std::binary_search(hidden.begin(), hidden.end(), n);
      const bool is_leaf = tree.nodes()[n].is_leaf();
      if (hides)
        expected.push_back({n, true});
      else if (is_leaf && !is_hidden[tree.groups_of(tree.nodes()[n]).front()])
        expected.push_back({n, false});
    }
    const std::size_t before = active.size();
    const std::uint64_t visited = walk_jointly(tree, hidden, active);
    ASSERT_EQ(active, expected) << i;
    EXPECT_LE(visited, before + 2 * expected.size());
    const auto again = active;
    EXPECT_LE(walk_jointly(tree, hidden, active), active.size());
    EXPECT_EQ(active, again);
  }
}

TEST(OccluderHiding, WhatIsHiddenFromABoxIsSeenByNoEyeInIt) {
  const Scene& scene = hills();
  const OccluderHiding hiding(scene.tree, scene.batches, scene.ground.tin,
                              find_virtual_occluders(scene.ground.tin, {}).sections);
  Draw draw(5);
  std::uint64_t hidden = 0, inner = 0;
  for (int i = 0; i < 60; ++i) {
    const Bounds box = draw.box_over(scene.ground.tin, i % 3 == 0 ? 0 : 15);
    const std::vector<NodeIndex> nodes = hiding.find_hidden(box, {});
    for (const NodeIndex node : nodes) inner += !scene.tree.nodes()[node].is_leaf();
    const std::vector<GroupIndex> groups = groups_below(scene.tree, nodes);
    hidden += groups.size();
    for (int k = 0; k < 3; ++k) {
      const Position eye = draw.in(box, k < 2);
      for (const GroupIndex g : groups)
        for (const TriangleSight sight : judge_each(scene.index, eye, scene.batches.triangles(g)))
          ASSERT_EQ(sight, TriangleSight::kHidden) << "box " << i << ", group " << g;
    }
    // What is known is not found again, and the rest is.
    const std::vector<NodeIndex> known(nodes.begin(), nodes.begin() + nodes.size() / 2);
    std::vector<GroupIndex> both = groups_below(scene.tree, hiding.find_hidden(box, known));
    for (const GroupIndex g : groups_below(scene.tree, known)) both.push_back(g);
    std::vector<GroupIndex> once = groups;
    std::sort(both.begin(), both.end());
    std::sort(once.begin(), once.end());
    EXPECT_EQ(both, once);
  }
  EXPECT_GT(hidden, 1000U);
  EXPECT_GT(inner, 50U) << "whole nodes are found";
}

TEST(JointHiding, FindsWhatEitherFinds) {
  const Scene& scene = hills();
  const auto by_regions = [&] {
    return std::make_unique<CertifiedHiding>(scene.tree, scene.regions);
  };
  const auto by_occluders = [&] {
    return std::make_unique<OccluderHiding>(scene.tree, scene.batches, scene.ground.tin,
                                            find_virtual_occluders(scene.ground.tin, {}).sections);
  };
  const auto regions = by_regions();
  const auto occluders = by_occluders();
  const JointHiding joint(by_regions(), by_occluders());
  Draw draw(7);
  std::size_t more_than_regions = 0;
  for (int i = 0; i < 20; ++i) {
    const Bounds box = draw.box_over(scene.ground.tin, 10);
    std::set<GroupIndex> either;
    for (const NodeHiding* one : {static_cast<const NodeHiding*>(regions.get()),
                                  static_cast<const NodeHiding*>(occluders.get())})
      for (const GroupIndex g : groups_below(scene.tree, one->find_hidden(box, {})))
        either.insert(g);
    const std::vector<NodeIndex> nodes = joint.find_hidden(box, {});
    const auto found = groups_below(scene.tree, nodes);
    EXPECT_EQ(std::set<GroupIndex>(found.begin(), found.end()), either);
    EXPECT_EQ(found.size(), either.size()) << "none twice";
    EXPECT_TRUE(std::is_sorted(nodes.begin(), nodes.end()));
    more_than_regions +=
        either.size() - groups_below(scene.tree, regions->find_hidden(box, {})).size();
  }
  EXPECT_GT(more_than_regions, 20U);
}

TEST(GroundHeights, AreThoseOfTheGroundInTheRectangle) {
  const Scene& scene = hills();
  const GroundHeights heights(scene.ground.tin);
  Draw draw(6);
  for (int i = 0; i < 100; ++i) {
    Bounds square{draw.in({{0, 0, 0}, {300, 300, 0}}, false), {}};
    square.high = {square.low.x_m + 4 + 40 * draw.unit(), square.low.y_m + 4 + 40 * draw.unit(), 0};
    const auto range_m = heights.over(square);
    ASSERT_TRUE(range_m);
    double least_m = 1e9, greatest_m = -1e9;
    for (int k = 0; k < 400; ++k) {
      const Position p = draw.in(square, k < 8);
      const auto z_m = scene.index.ground_height_m(p.x_m, p.y_m);
      if (!z_m) continue;
      least_m = std::min(least_m, *z_m);
      greatest_m = std::max(greatest_m, *z_m);
    }
    EXPECT_LE((*range_m)[0], least_m + 1e-2);
    EXPECT_GE((*range_m)[1], greatest_m - 1e-2);
    EXPECT_NEAR((*range_m)[0], least_m, 10) << "and no more than that";
    EXPECT_NEAR((*range_m)[1], greatest_m, 10);
  }
  EXPECT_FALSE(heights.over({{900, 900, 0}, {910, 910, 0}}));
}

/// Eyes of walkers and of flights, in one order for all.
std::vector<Position> eyes_over(const Tin& tin, int count) {
  Draw draw(2);
  std::vector<Position> eyes;
  for (int i = 0; i < count; ++i) {
    Position eye = tin.vertices[draw.below(tin.vertices.size())];
    eye.z_m += i % 2 == 0 ? 2 : 100 * draw.unit();
    eyes.push_back(round_to_lattice(eye));
  }
  return eyes;
}

TEST(CellCulling, NeverLeavesOutWhatCertifiedShowsAndComesCloseToIt) {
  const Scene& scene = hills();
  CertifiedCulling certified(scene.regions);
  const auto cells = [&](double least_m) {
    return CellCulling("cells", std::make_unique<CertifiedHiding>(scene.tree, scene.regions),
                       walk_and_flight(scene.ground.tin, least_m));
  };
  CellCulling coarse = cells(100), fine = cells(6);
  std::size_t by_certified = 0, by_fine = 0, by_coarse = 0, all = 0;
  for (const Position& eye : eyes_over(scene.ground.tin, 30)) {
    const auto exact = certified.visible({eye, {}}).visible_groups;
    const auto from_fine = fine.visible({eye, {}}).visible_groups;
    const auto from_coarse = coarse.visible({eye, {}}).visible_groups;
    ASSERT_TRUE(std::includes(from_fine.begin(), from_fine.end(), exact.begin(), exact.end()));
    all += scene.regions.groups.size();
    by_certified += exact.size();
    by_fine += from_fine.size();
    by_coarse += from_coarse.size();
  }
  EXPECT_LT(by_fine, by_coarse);
  EXPECT_GT(2 * (all - by_fine), all - by_certified)
      << "half of what certified leaves out, at least";
}

TEST(CellCulling, SetsOfParentAndChildrenAreWhatIsFoundForTheCellAlone) {
  const Scene& scene = hills();
  const CertifiedHiding hiding(scene.tree, scene.regions);
  for (const CellSpace& space : walk_and_flight(scene.ground.tin, 40)) {
    CellTree cells(hiding, space);
    cells.divide_all();
    const std::size_t size = cells.size();
    EXPECT_EQ(size % (space.ground ? 4 : 8), 1U);
    for (const Position& eye : eyes_over(scene.ground.tin, 20)) {
      std::vector<NodeIndex> hidden;
      const std::uint32_t cell = cells.hidden_from(eye, hidden);
      if (cell == kNone) continue;  // a flight over the cells of walks
      EXPECT_TRUE(std::is_sorted(hidden.begin(), hidden.end()));
      for (const GroupIndex g : groups_below(scene.tree, hidden))
        EXPECT_TRUE(hides_group(scene.regions, g, eye));
    }
    EXPECT_EQ(cells.size(), size) << "all was divided before";
  }
}

TEST(CellCulling, WithVirtualOccludersHidesNothingThatIsSeen) {
  const Scene& scene = hills();
  CellCulling cells(
      "law-tan",
      std::make_unique<OccluderHiding>(scene.tree, scene.batches, scene.ground.tin,
                                       find_virtual_occluders(scene.ground.tin, {}).sections),
      walk_and_flight(scene.ground.tin, 6));
  std::uint64_t hidden = 0;
  for (const Position& eye : eyes_over(scene.ground.tin, 20)) {
    const CullingAnswer answer = cells.visible({eye, {}});
    EXPECT_GT(answer.nodes_tested, 0U);
    for (GroupIndex g = 0; g < scene.batches.groups(); ++g) {
      if (std::binary_search(answer.visible_groups.begin(), answer.visible_groups.end(), g))
        continue;
      ++hidden;
      for (const TriangleSight sight : judge_each(scene.index, eye, scene.batches.triangles(g)))
        ASSERT_EQ(sight, TriangleSight::kHidden) << "group " << g;
    }
    EXPECT_EQ(cells.visible({eye, {}}).visible_groups, answer.visible_groups);
    EXPECT_EQ(cells.visible({eye, {}}).nodes_tested, 0U) << "the same cell is not walked again";
  }
  EXPECT_GT(hidden, 200U);
}

TEST(CellCulling, SeesEverythingFromOutsideItsSpace) {
  const Scene& scene = hills();
  CellCulling cells("cells", std::make_unique<CertifiedHiding>(scene.tree, scene.regions),
                    {{{{0, 0, 0}, {100, 100, 100}}, 10}});
  EXPECT_EQ(cells.visible({{500, 0, 0}, {}}).visible_groups.size(), scene.regions.groups.size());
  EXPECT_EQ(cells.trees()[0].size(), 1U);
}

}  // namespace
}  // namespace scarp
