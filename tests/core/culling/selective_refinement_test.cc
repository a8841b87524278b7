#include "core/culling/selective_refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "core/raster/rasterise.h"
#include "core/sight/tin_index.h"
#include "tests/support/grouped_ground.h"

namespace scarp {
namespace {

std::vector<Shot> shots_over(const Tin& tin, int count, unsigned seed) {
  std::mt19937 random(seed);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  std::vector<Shot> shots;
  for (int i = 0; i < count; ++i) {
    Shot shot;
    shot.width_px = 160;
    shot.height_px = 90;
    shot.view.eye = tin.vertices[random() % tin.vertices.size()];
    shot.view.eye.z_m += i % 2 == 0 ? 2 : 60;
    const double azimuth_rad = 6.3 * unit();
    shot.view.target = shot.view.eye;
    shot.view.target.x_m += 100 * std::cos(azimuth_rad);
    shot.view.target.y_m += 100 * std::sin(azimuth_rad);
    shot.view.target.z_m -= 30 * unit();
    shots.push_back(shot);
  }
  return shots;
}

Target picture_of(const Tin& tin, const SelectiveRefinement::Drawing& drawing, const Shot& shot) {
  Target target = empty_target(shot.width_px, shot.height_px);
  rasterise(target, project_all(look_at(shot.view, shot.width_px, shot.height_px), tin.vertices),
            drawing.triangles, drawing.objects);
  return target;
}

/// The groups with a pixel in the picture of all triangles.
std::vector<GroupIndex> seen_in(const Groups& groups, const Target& picture) {
  std::set<GroupIndex> seen;
  for (const std::uint32_t object : picture.object)
    if (object != kNone && groups.group_of_triangle[object] != kNone)
      seen.insert(groups.group_of_triangle[object]);
  return {seen.begin(), seen.end()};
}

TEST(SelectiveRefinement, IsOneWholeSurfaceWithoutCracks) {
  const test::GroupedGround scene = test::grouped_hills(1);
  const SelectiveRefinement refinement(scene.tin, scene.groups);
  for (const Shot& shot : shots_over(scene.tin, 12, 1)) {
    for (const double most_px : {0.0, 0.5, 4.0, 50.0}) {
      const auto drawing = refinement.draw(shot, most_px, std::nullopt);
      Tin active;
      active.vertices = scene.tin.vertices;
      std::vector<VertexIndex> renamed(scene.tin.vertices.size(), kNone);
      active.vertices.clear();
      double area2_m2 = 0;
      for (const TriangleIndex t : drawing.active) {
        auto corners = refinement.history().triangles[t];
        for (VertexIndex& v : corners) {
          if (renamed[v] == kNone) {
            renamed[v] = static_cast<VertexIndex>(active.vertices.size());
            active.vertices.push_back(scene.tin.vertices[v]);
          }
          v = renamed[v];
        }
        active.triangles.push_back(corners);
        const Position &a = active.vertices[corners[0]], &b = active.vertices[corners[1]],
                       &c = active.vertices[corners[2]];
        area2_m2 += (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
      }
      connect_neighbours(active);
      ASSERT_EQ(check_tin(active), std::nullopt);
      EXPECT_NEAR(area2_m2, 2 * 390.0 * 390.0, 1e-3) << "all of the ground, once";
    }
  }
}

TEST(SelectiveRefinement, WithoutErrorAndWithWhatIsSeenThePictureIsThatOfAllTriangles) {
  const test::GroupedGround scene = test::grouped_hills(2);
  const GroupBatches batches(scene.tin, scene.groups);
  const SelectiveRefinement refinement(scene.tin, scene.groups);
  std::vector<GroupIndex> all;
  for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
  std::uint64_t drawn = 0, in_view = 0;
  for (const Shot& shot : shots_over(scene.tin, 20, 2)) {
    const Target whole = test::picture_of(batches, all, shot);
    const auto everything = refinement.draw(shot, 0, std::nullopt);
    EXPECT_EQ(picture_of(scene.tin, everything, shot).object, whole.object);
    const auto seen = refinement.draw(shot, 0, seen_in(scene.groups, whole));
    EXPECT_EQ(picture_of(scene.tin, seen, shot).object, whole.object);
    drawn += seen.triangles.size();
    in_view += everything.triangles.size();
  }
  EXPECT_LT(drawn, in_view * 2 / 3) << "what is not seen is not drawn";
}

TEST(SelectiveRefinement, PlacesAreOffByNoMoreThanAllowed) {
  const test::GroupedGround scene = test::grouped_hills(3);
  const SelectiveRefinement refinement(scene.tin, scene.groups);
  const TinIndex ground(scene.tin);
  std::mt19937 random(3);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  double worst_px = 0;
  std::uint64_t least = ~0U, most = 0;
  for (const Shot& shot : shots_over(scene.tin, 20, 3)) {
    const Projection projection = look_at(shot.view, shot.width_px, shot.height_px);
    const auto drawing = refinement.draw(shot, 2, std::nullopt);
    least = std::min<std::uint64_t>(least, drawing.active.size());
    most = std::max<std::uint64_t>(most, drawing.active.size());
    for (const auto& [a, b, c] : drawing.triangles) {
      const double u = unit(), v = unit() * (1 - u);
      const Position &p = scene.tin.vertices[a], &q = scene.tin.vertices[b],
                     &r = scene.tin.vertices[c];
      Position place{p.x_m + u * (q.x_m - p.x_m) + v * (r.x_m - p.x_m),
                     p.y_m + u * (q.y_m - p.y_m) + v * (r.y_m - p.y_m), 0};
      Position drawn = place, there = place;
      drawn.z_m = p.z_m + u * (q.z_m - p.z_m) + v * (r.z_m - p.z_m);
      const auto z_m = ground.ground_height_m(place.x_m, place.y_m);
      if (!z_m) continue;
      there.z_m = *z_m;
      const ClipPosition at = projection.project(drawn), true_at = projection.project(there);
      if (at.w <= 0.1 || true_at.w <= 0.1) continue;
      const double x_px = (at.x / at.w - true_at.x / true_at.w) * shot.width_px / 2;
      const double y_px = (at.y / at.w - true_at.y / true_at.w) * shot.height_px / 2;
      const bool is_in = std::abs(at.x) < at.w && std::abs(at.y) < at.w;
      if (is_in) worst_px = std::max(worst_px, std::hypot(x_px, y_px));
    }
  }
  EXPECT_LE(worst_px, 2.001);
  EXPECT_GT(worst_px, 0.2) << "and what is allowed is used";
  EXPECT_LT(least, most);
}

TEST(SelectiveRefinement, LeavingOutWhatTheOutlineHidesChangesNoPicture) {
  const test::GroupedGround scene = test::grouped_hills(4);
  const SelectiveRefinement refinement(scene.tin, scene.groups);
  std::uint64_t drawn = 0, left = 0;
  for (const Shot& shot : shots_over(scene.tin, 20, 4)) {
    for (const double most_px : {0.0, 1.0}) {
      auto drawing = refinement.draw(shot, most_px, std::nullopt);
      const Target whole = picture_of(scene.tin, drawing, shot);
      const std::size_t active = drawing.active.size();
      drawn += drawing.triangles.size();
      refinement.leave_out_hidden(shot, drawing);
      left += drawing.triangles.size();
      EXPECT_EQ(drawing.objects.size(), drawing.triangles.size());
      EXPECT_EQ(drawing.active.size(), active);
      EXPECT_EQ(picture_of(scene.tin, drawing, shot).object, whole.object);
    }
  }
  EXPECT_LT(left, drawn / 2);
}

TEST(SelectiveRefinement, AnEyeThatIsNotOverTheGroundLosesNothing) {
  const test::GroupedGround scene = test::grouped_hills(5);
  const SelectiveRefinement refinement(scene.tin, scene.groups);
  for (const double below_m : {30.0, 5000.0}) {
    Shot shot = shots_over(scene.tin, 1, 5).front();
    // Under the ground, and beside it.
    (below_m < 1000 ? shot.view.eye.z_m : shot.view.eye.x_m) -= below_m;
    auto drawing = refinement.draw(shot, 1, std::nullopt);
    const std::size_t all = drawing.triangles.size();
    refinement.leave_out_hidden(shot, drawing);
    EXPECT_EQ(drawing.triangles.size(), all);
  }
}

}  // namespace
}  // namespace scarp
