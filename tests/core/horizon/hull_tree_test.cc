#include "core/horizon/hull_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace scarp {
namespace {

/// The definition of HullTree::steepest.
Steepest steepest_judge(const std::vector<PlanePoint>& by_rank, const std::vector<bool>& inserted,
                        std::size_t end, std::int64_t u, std::int64_t z) {
  Steepest best;
  for (std::size_t rank = 0; rank < end; ++rank) {
    const PlanePoint& q = by_rank[rank];
    if (!inserted[rank] || q.u <= u) continue;
    const Slope slope{q.z - z, q.u - u};
    const int sign = best.vertex == kNone ? 1 : compare_slopes(slope, best.slope);
    const bool nearer =
        slope.run < best.slope.run || (slope.run == best.slope.run && q.vertex < best.vertex);
    if (sign > 0 || (sign == 0 && nearer)) best = {slope, q.vertex};
  }
  return best;
}

/// Inserts points of the given spread in random order; checks the tree and some questions after
/// each. Narrow spreads give equal u, equal z, collinear and equal points in plenty.
void insert_and_ask(std::size_t ranks, std::int64_t u_spread, std::int64_t z_spread,
                    std::int64_t lowest_u, std::uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "ranks " << ranks << ", u spread " << u_spread << ", z spread "
                                  << z_spread << ", seed " << seed);
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::int64_t> u(0, u_spread), z(-z_spread, z_spread);
  std::vector<std::size_t> order(ranks);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  std::vector<PlanePoint> points;
  for (std::size_t rank = 0; rank < ranks; ++rank)
    points.push_back({u(random), z(random), static_cast<VertexIndex>(ranks - rank)});
  std::vector<bool> inserted(ranks, false);
  HullTree tree;
  tree.reset(points);
  for (const std::size_t rank : order) {
    inserted[rank] = true;
    tree.insert(rank);
    ASSERT_EQ(tree.check().value_or(""), "");
    for (int question = 0; question < 4; ++question) {
      const std::size_t end = random() % (ranks + 1);
      const std::int64_t from_u = lowest_u + u(random) / 4, from_z = 2 * z(random);
      const Steepest expected = steepest_judge(points, inserted, end, from_u, from_z);
      const Steepest found = tree.steepest(end, from_u, from_z);
      ASSERT_EQ(found.vertex, expected.vertex);
      ASSERT_EQ(found.slope.rise, expected.slope.rise);
      ASSERT_EQ(found.slope.run, expected.slope.run);
    }
  }
}

TEST(HullTree, AgreesWithTheDefinitionFromTheLeft) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    insert_and_ask(1, 100, 100, -200, seed);
    insert_and_ask(HullTree::kBlock, 1000, 1000, -2000, seed);
    insert_and_ask(1000, 1'000'000, 1'000'000, -2'000'000, seed);
    insert_and_ask(300, 30, 5, -60, seed);
    insert_and_ask(200, 500, 0, -1000, seed);
    insert_and_ask(300, std::int64_t{1} << 44, std::int64_t{1} << 39, -(std::int64_t{1} << 44),
                   seed);
  }
}

TEST(HullTree, AgreesWithTheDefinitionFromAmongThePoints) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    insert_and_ask(300, 1'000'000, 1'000'000, 0, seed);
    insert_and_ask(300, 20, 20, 0, seed);
  }
}

TEST(HullTree, KeepsEveryPointOfADome) {
  constexpr std::int64_t kPoints = 500;
  std::vector<PlanePoint> points;
  for (std::int64_t i = 0; i < kPoints; ++i) {
    const std::int64_t u = (i * 7) % kPoints;
    points.push_back({u, -u * u, static_cast<VertexIndex>(u)});
  }
  HullTree tree;
  tree.reset(points);
  for (std::size_t rank = 0; rank < points.size(); ++rank) tree.insert(rank);
  EXPECT_EQ(tree.check().value_or(""), "");
  // The line through (-100, 9881) touches z = -u^2 at u = 41.
  EXPECT_EQ(tree.steepest(kPoints, -100, 9881).vertex, 41U);
}

TEST(HullTree, ResetForgets) {
  const std::vector<PlanePoint> many(3 * HullTree::kBlock, PlanePoint{5, 5, 1});
  HullTree tree;
  tree.reset(many);
  for (std::size_t rank = 0; rank < many.size(); ++rank) tree.insert(rank);
  const std::vector<PlanePoint> few(HullTree::kBlock, PlanePoint{7, 1, 9});
  tree.reset(few);
  EXPECT_EQ(tree.steepest(few.size(), 0, 0).vertex, kNone);
  tree.insert(3);
  EXPECT_EQ(tree.steepest(few.size(), 0, 0).vertex, 9U);
  EXPECT_EQ(tree.steepest(4, 0, 0).vertex, 9U);
  EXPECT_EQ(tree.steepest(3, 0, 0).vertex, kNone);
}

}  // namespace
}  // namespace scarp
