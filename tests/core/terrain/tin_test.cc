#include "core/terrain/tin.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

/// Two triangles over a square: 0-1-2 and 1-3-2.
Tin square() {
  Tin tin;
  tin.vertices = {{0, 0, 0}, {10, 0, 1}, {0, 10, 2}, {10, 10, 3}};
  tin.triangles = {{0, 1, 2}, {1, 3, 2}};
  connect_neighbours(tin);
  return tin;
}

TEST(Tin, NeighboursLieAcrossTheOppositeEdge) {
  const Tin tin = square();
  EXPECT_EQ(tin.neighbours[0], (std::array<TriangleIndex, 3>{1, kNone, kNone}));
  EXPECT_EQ(tin.neighbours[1], (std::array<TriangleIndex, 3>{kNone, 0, kNone}));
  EXPECT_EQ(check_tin(tin), std::nullopt);
}

TEST(Tin, CheckNamesTheFirstBrokenInvariant) {
  Tin tin = square();
  std::swap(tin.triangles[0][0], tin.triangles[0][1]);
  EXPECT_EQ(check_tin(tin), "triangle 0 is not counter-clockwise");

  tin = square();
  tin.triangles[1][1] = 9;
  EXPECT_EQ(check_tin(tin), "triangle 1 has a vertex that does not exist");

  tin = square();
  tin.vertices[2].z_m = 0.1;
  EXPECT_EQ(check_tin(tin), "vertex 2 is not on the lattice");

  tin = square();
  tin.vertices.push_back({5, -5, 0});
  EXPECT_EQ(check_tin(tin), "vertex 4 has no triangle");

  tin = square();
  tin.vertices.push_back({0, 0, 7});
  tin.vertices.push_back({20, 0, 7});
  tin.triangles.push_back({4, 5, 3});
  EXPECT_EQ(check_tin(tin), "vertices 0 and 4 are at the same place");

  tin = square();
  tin.neighbours[0][0] = kNone;
  EXPECT_EQ(check_tin(tin), "edge 1-2 names a wrong neighbour");

  tin = square();
  tin.triangles.push_back({0, 1, 3});
  EXPECT_EQ(check_tin(tin), "neighbours are missing");
  tin.neighbours.push_back({kNone, kNone, kNone});
  EXPECT_EQ(check_tin(tin), "edge 0-1 is used twice in one direction");
}

TEST(Tin, BoundsHoldEveryVertex) {
  const Bounds bounds = bounds_of(square().vertices);
  EXPECT_EQ(bounds.low, (Position{0, 0, 0}));
  EXPECT_EQ(bounds.high, (Position{10, 10, 3}));
}

}  // namespace
}  // namespace scarp
