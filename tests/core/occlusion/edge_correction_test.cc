#include "core/occlusion/edge_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/occlusion/virtual_occluders.h"
#include "core/sight/triangle_sight.h"
#include "core/terrain/occluder.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// A plain with a round hollow, and the plain without it: its best approximation by two triangles.
struct Hollow {
  Tin tin = test::triangulated(test::grid_of(
      21, 21, 10, [](int c, int r) { return std::min(0.0, std::hypot(c - 6, r - 6) * 5 - 20); }));
  Tin plain;

  Hollow() {
    plain.vertices = {{0, 0, 0}, {200, 0, 0}, {200, 200, 0}, {0, 200, 0}};
    plain.triangles = {{0, 1, 2}, {0, 2, 3}};
    connect_neighbours(plain);
  }
};

TEST(EdgeCorrection, ShiftsAnEdgeBelowTheGround) {
  // A valley along y under an edge along x.
  const Tin valley = test::triangulated(
      test::grid_of(11, 11, 10, [](int c, int) { return std::abs(c - 5) * 2 - 10.0; }));
  Tin lid;
  lid.vertices = {{0, 0, 0}, {100, 0, 0}, {100, 100, 0}, {0, 100, 0}};
  lid.triangles = {{0, 1, 2}, {0, 2, 3}};
  connect_neighbours(lid);
  for (const CorrectedTriangle& triangle : correct_edges(lid, TinIndex(valley), 100))
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& [a, b] = triangle.edges[i];
      const bool is_across = triangle.corners[i].x_m != triangle.corners[(i + 1) % 3].x_m;
      EXPECT_NEAR(a.z_m, is_across ? -10 : 0, 1e-9);
      EXPECT_NEAR(b.z_m, a.z_m, 1e-9);
    }
}

/// The hollow's floor lies behind the triangle over it and within its edges, and the eye looks
/// straight into it.
TEST(EdgeCorrection, HidesWhatStandsInFrontOfTheGround) {
  const Hollow scene;
  const TinIndex index(scene.tin);
  const Position eye{70, 140, 120};
  const Position floor{60, 140, -20};
  TriangleIndex bottom = index.triangle_at(floor.x_m, floor.y_m);
  ASSERT_NE(bottom, kNone);
  ASSERT_EQ(judge_triangle(index, eye, bottom), TriangleSight::kVisible);

  Bounds target{floor, floor};
  for (const VertexIndex v : scene.tin.triangles[bottom]) {
    const Position& p = scene.tin.vertices[v];
    target.low = {std::min(target.low.x_m, p.x_m), std::min(target.low.y_m, p.y_m),
                  std::min(target.low.z_m, p.z_m)};
    target.high = {std::max(target.high.x_m, p.x_m), std::max(target.high.y_m, p.y_m),
                   std::max(target.high.z_m, p.z_m)};
  }
  const auto corrected = correct_edges(scene.plain, index, 100);
  EXPECT_TRUE(std::any_of(corrected.begin(), corrected.end(), [&](const CorrectedTriangle& t) {
    return claims_to_hide(t, eye, target);
  }));
  // Ours is lowered into the ground and hides nothing of it.
  const VirtualOccluders ours = find_virtual_occluders(scene.tin, {});
  EXPECT_EQ(check_under(ours.mesh.tin, scene.tin), std::nullopt);
  for (const UprightOccluder& section : ours.sections)
    EXPECT_NE(section.judge({eye, eye}, target), FullOcclusion::kHidden);
}

}  // namespace
}  // namespace scarp
