#include "core/sight/tin_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/geodesy/predicates.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Thin and fat triangles of very unequal size, with voids.
Tin uneven_terrain(std::uint64_t seed) {
  SampleGrid grid = test::random_hills(17, 13, 10, seed, 60, 1, 0.15);
  for (Position& p : grid.positions) {
    // Columns and rows move closer together by the square: the order stays, the cells differ.
    p.x_m = round_to_lattice(p.x_m * p.x_m / 10);
    p.y_m = round_to_lattice(p.y_m * p.y_m / 300);
  }
  return test::triangulated(grid, seed);
}

Position random_place(std::mt19937_64& random, const Tin& tin) {
  if (random() % 3 == 0) return tin.vertices[random() % tin.vertices.size()];
  const Bounds bounds = bounds_of(tin.vertices);
  const auto between = [&](double low, double high) {
    const double share = static_cast<double>(random() % 1201) / 1000 - 0.1;
    return round_to_lattice(low + share * (high - low));
  };
  return {between(bounds.low.x_m, bounds.high.x_m), between(bounds.low.y_m, bounds.high.y_m),
          between(bounds.low.z_m, bounds.high.z_m)};
}

TEST(TinIndex, EveryEdgeIsListedOnce) {
  const Tin tin = uneven_terrain(1);
  const TinIndex index(tin);
  std::set<std::pair<VertexIndex, VertexIndex>> listed, expected;
  for (const MeshEdge& edge : index.edges()) {
    EXPECT_TRUE(listed.insert(std::minmax(edge.from, edge.to)).second);
    EXPECT_EQ(edge.is_border(), edge.right == kNone);
  }
  for (const auto& [a, b, c] : tin.triangles)
    for (const auto& [u, v] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
      expected.insert(std::minmax(u, v));
  EXPECT_EQ(listed, expected);
}

TEST(TinIndex, TriangleAtIsTheFirstThatHoldsThePlace) {
  std::mt19937_64 random(2);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Tin tin = uneven_terrain(seed);
    ASSERT_EQ(check_tin(tin), std::nullopt);
    const TinIndex index(tin);
    for (int i = 0; i < 500; ++i) {
      const Position p = random_place(random, tin);
      TriangleIndex expected = kNone;
      for (TriangleIndex t = 0; t < tin.triangles.size() && expected == kNone; ++t) {
        const auto& [a, b, c] = tin.triangles[t];
        if (orient2d(tin.vertices[a], tin.vertices[b], p) >= 0 &&
            orient2d(tin.vertices[b], tin.vertices[c], p) >= 0 &&
            orient2d(tin.vertices[c], tin.vertices[a], p) >= 0)
          expected = t;
      }
      ASSERT_EQ(index.triangle_at(p.x_m, p.y_m), expected);
    }
  }
}

TEST(TinIndex, VisitedEdgesHoldAllThatMeetTheSegment) {
  std::mt19937_64 random(3);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Tin tin = uneven_terrain(seed);
    const TinIndex index(tin);
    for (int i = 0; i < 300; ++i) {
      const std::array<Position, 2> ends{random_place(random, tin), random_place(random, tin)};
      std::set<std::uint32_t> visited;
      index.visit_edges(ends, {}, [&](std::uint32_t e) { return visited.insert(e), false; });
      for (std::uint32_t e = 0; e < index.edges().size(); ++e) {
        const Position& u = tin.vertices[index.edges()[e].from];
        const Position& v = tin.vertices[index.edges()[e].to];
        const bool may_meet = orient2d(ends[0], ends[1], u) * orient2d(ends[0], ends[1], v) <= 0 &&
                              orient2d(u, v, ends[0]) * orient2d(u, v, ends[1]) < 0;
        ASSERT_TRUE(!may_meet || visited.contains(e)) << "edge " << e << " missed";
      }
    }
  }
}

TEST(TinIndex, GroundHeightInterpolatesAndVoidHasNone) {
  const Tin tin = test::triangulated(test::drawn_grid("0 10 ?\n0 10 ?\n20 30 40", 10));
  const TinIndex index(tin);
  EXPECT_EQ(index.ground_height_m(5, 15), 5);
  EXPECT_EQ(index.ground_height_m(0, 20), 0);
  EXPECT_EQ(index.ground_height_m(15, 15), std::nullopt);
  EXPECT_EQ(index.above_ground({5, 15, 5}), 0);
  EXPECT_EQ(index.above_ground({5, 15, 5 + kLatticeStepM}), 1);
  EXPECT_EQ(index.above_ground({5, 15, 5 - kLatticeStepM}), -1);
  EXPECT_EQ(index.above_ground({-1, 15, 5}), std::nullopt);
}

TEST(TinIndex, AHoleIsAVoidThatGroundEncloses) {
  // An island in a lake without data, and a bay that is open to the east.
  const Tin tin = test::triangulated(test::drawn_grid(R"(
      0 0 0 0 0 0 0 0 0 0
      0 0 0 0 0 0 0 0 0 0
      0 0 ? ? ? ? 0 0 ? ?
      0 0 ? 1 1 ? 0 0 ? ?
      0 0 ? 1 1 ? 0 0 ? ?
      0 0 ? ? ? ? 0 0 0 0
      0 0 0 0 0 0 0 0 0 0
      0 0 0 0 0 0 0 0 0 0)",
                                                      10));
  const TinIndex index(tin);
  const auto at = [&](double column, double row) {
    return index.is_in_hole(column * 10, (7 - row) * 10);
  };
  EXPECT_TRUE(at(2, 3));
  EXPECT_TRUE(at(3.5, 2.25));
  EXPECT_TRUE(at(5.5, 3.5));
  EXPECT_FALSE(at(8.5, 3));
  EXPECT_FALSE(at(-1, 3));
  EXPECT_FALSE(at(20, 3));
  EXPECT_FALSE(at(3, -5));
}

TEST(TinIndex, VoidsThatMeetInAVertexStaySeparate) {
  // The upper void is open to the outside; the lower one touches it in one vertex.
  const Tin tin = test::triangulated(test::drawn_grid(R"(
      0 0 0 0 0 0
      0 ? 0 0 0 0
      0 0 0 0 0 0
      0 0 0 ? 0 0
      0 0 0 0 0 0
      0 0 0 0 0 0)",
                                                      10));
  const TinIndex index(tin);
  EXPECT_TRUE(index.is_in_hole(30, 20));
  EXPECT_TRUE(index.is_in_hole(25, 25));
  EXPECT_FALSE(index.is_in_hole(10, 40));
  EXPECT_FALSE(index.is_in_hole(-5, 25));
}

TEST(TinIndex, BorderEdgesAlongALineAreTheCrossedOnesAndNoInnerOnes) {
  const Tin tin = test::triangulated(test::drawn_grid(R"(
      0 0 0 0 0
      0 0 ? 0 0
      0 0 0 0 0)",
                                                      10));
  const TinIndex index(tin);
  std::set<std::pair<VertexIndex, VertexIndex>> seen;
  const Position a{1, 9, 0}, b{39, 9, 0};
  index.visit_border_edges_along(a, b, [&](const MeshEdge& edge) {
    EXPECT_TRUE(edge.is_border());
    seen.insert({edge.from, edge.to});
  });
  for (const MeshEdge& edge : index.edges()) {
    const Position &u = tin.vertices[edge.from], &v = tin.vertices[edge.to];
    const bool crossed =
        orient2d(a, b, u) * orient2d(a, b, v) <= 0 && orient2d(u, v, a) * orient2d(u, v, b) <= 0;
    if (edge.is_border() && crossed) {
      EXPECT_TRUE(seen.count({edge.from, edge.to}));
    }
  }
}

TEST(TinIndex, EmptyTinHasNothingAnywhere) {
  const Tin tin;
  const TinIndex index(tin);
  EXPECT_EQ(index.triangle_at(0, 0), kNone);
  EXPECT_FALSE(index.is_in_hole(0, 0));
  index.visit_border_edges_along({0, 0, 0}, {10, 10, 0}, [](const MeshEdge&) { FAIL(); });
}

}  // namespace
}  // namespace scarp
