#include "core/culling/swept_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/sight/triangle_sight.h"
#include "tests/support/grouped_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Regions that hide nothing, so that all is left to the sweep.
CertifiedRegions regions_of_nothing(const GroupBatches& batches) {
  CertifiedRegions regions;
  regions.layout.sectors = 8;
  for (GroupIndex g = 0; g < batches.groups(); ++g) {
    const Bounds& box = batches.box(g);
    CertifiedGroup group;
    group.centre_x_m = (box.low.x_m + box.high.x_m) / 2;
    group.centre_y_m = (box.low.y_m + box.high.y_m) / 2;
    group.height_m = box.high.z_m;
    group.radius_m =
        static_cast<float>(std::hypot(box.high.x_m - box.low.x_m, box.high.y_m - box.low.y_m));
    regions.groups.push_back(group);
  }
  regions.steps.resize(8 * regions.groups.size());
  return regions;
}

/// Hills with houses: blocks of samples that stand out by tens of metres.
test::GroupedGround town(std::uint64_t seed) {
  const SampleGrid hills = test::random_hills(40, 40, 10, seed, 40, 0.01);
  std::mt19937_64 random(seed);
  std::vector<double> raised(1600, 0);
  for (int house = 0; house < 30; ++house) {
    const std::size_t column = random() % 37, row = random() % 37;
    for (std::size_t i = 0; i < 9; ++i)
      raised[(row + i / 3) * 40 + column + i % 3] = 10 + static_cast<double>(random() % 30);
  }
  return test::grouped_by_squares(
      test::triangulated(test::grid_of(40, 40, 10,
                                       [&](std::int32_t column, std::int32_t row) {
                                         const auto i = static_cast<std::size_t>(row * 40 + column);
                                         return hills.at(column, row).z_m + raised[i];
                                       }),
                         seed),
      24);
}

struct Scene {
  test::GroupedGround ground;
  GroupBatches batches;
  CertifiedRegions regions;
  TinIndex index;

  explicit Scene(test::GroupedGround made)
      : ground(std::move(made)),
        batches(ground.tin, ground.groups),
        regions(regions_of_nothing(batches)),
        index(ground.tin) {}
};

/// From above ground: from under it pictures show undersides, which nobody promises.
Shot random_shot(const TinIndex& index, std::mt19937_64& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  const Position& near = index.tin().vertices[random() % index.tin().vertices.size()];
  Shot shot;
  shot.width_px = 160;
  shot.height_px = 90;
  Position eye = round_to_lattice({near.x_m + 9 * unit(), near.y_m + 9 * unit(), 0});
  const double ground_m = index.ground_height_m(eye.x_m, eye.y_m).value_or(near.z_m);
  eye.z_m = round_to_lattice(ground_m + 2 + 40 * unit() * unit());
  shot.view.eye = eye;
  const double turn = 6.28 * unit();
  shot.view.target = {shot.view.eye.x_m + std::cos(turn), shot.view.eye.y_m + std::sin(turn),
                      shot.view.eye.z_m - 0.3 * unit()};
  return shot;
}

/// Whether a triangle has all its corners well within a view.
bool is_within(const ViewRange& view, const Position& eye, const Tin& tin, TriangleIndex t) {
  const double middle_rad = (view.from_rad + view.to_rad) / 2;
  const auto& corners = tin.triangles[t];
  return std::all_of(corners.begin(), corners.end(), [&](VertexIndex v) {
    const Position& p = tin.vertices[v];
    const double off_rad =
        std::remainder(std::atan2(p.y_m - eye.y_m, p.x_m - eye.x_m) - middle_rad, 2 * M_PI);
    return std::abs(off_rad) < (view.to_rad - view.from_rad) / 2;
  });
}

TEST(SweptCulling, LeavesEveryPixelAsItIsAndHidesNoTriangleThatTheJudgeSees) {
  std::size_t left_out = 0, in_view = 0, judged = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Scene scene(seed % 2 == 0 ? town(seed)
                                    : test::grouped_hills(static_cast<unsigned>(seed)));
    SweptCulling swept(scene.regions, scene.batches);
    CertifiedCulling nothing(scene.regions);
    std::vector<GroupIndex> all;
    for (GroupIndex g = 0; g < scene.batches.groups(); ++g) all.push_back(g);
    std::mt19937_64 random(seed);
    for (int i = 0; i < 12; ++i) {
      const Shot shot = random_shot(scene.index, random);
      const Camera camera = camera_of(shot);
      const auto visible = swept.visible(camera).visible_groups;
      ASSERT_TRUE(std::is_sorted(visible.begin(), visible.end()));
      for (const int scale : {1, 3})
        ASSERT_EQ(test::picture_of(scene.batches, visible, shot, scale).object,
                  test::picture_of(scene.batches, all, shot, scale).object)
            << "seed " << seed << ", shot " << i << ", scale " << scale;
      const auto candidates = nothing.visible(camera).visible_groups;
      in_view += candidates.size();
      left_out += candidates.size() - visible.size();
      for (const GroupIndex g : candidates) {
        if (std::binary_search(visible.begin(), visible.end(), g)) continue;
        const auto triangles = scene.batches.triangles(g);
        const auto sights = judge_each(scene.index, shot.view.eye, triangles);
        for (std::size_t t = 0; t < triangles.size(); ++t) {
          if (!is_within(*camera.view, shot.view.eye, scene.ground.tin, triangles[t])) continue;
          ++judged;
          ASSERT_EQ(sights[t], TriangleSight::kHidden) << "seed " << seed << ", shot " << i;
        }
      }
    }
  }
  EXPECT_GT(judged, 10'000U);
  EXPECT_GT(left_out, in_view / 4) << "it must also leave something out";
}

TEST(SweptCulling, ComesCloseToWhatThePictureShows) {
  const Scene scene(test::grouped_hills(3));
  SweptCulling swept(scene.regions, scene.batches);
  std::vector<GroupIndex> all;
  for (GroupIndex g = 0; g < scene.batches.groups(); ++g) all.push_back(g);
  std::mt19937_64 random(5);
  std::size_t drawn = 0, seen = 0;
  for (int i = 0; i < 12; ++i) {
    const Shot shot = random_shot(scene.index, random);
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    for (const GroupIndex g : swept.visible(camera_of(shot)).visible_groups)
      drawn += frustum.may_show(scene.batches.box(g));
    std::vector<std::uint8_t> is_seen(scene.batches.groups(), 0);
    for (const std::uint32_t object : test::picture_of(scene.batches, all, shot, 3).object)
      if (object != kNone) is_seen[scene.ground.groups.group_of_triangle[object]] = 1;
    seen += static_cast<std::size_t>(std::count(is_seen.begin(), is_seen.end(), 1));
  }
  EXPECT_LT(drawn, 1.6 * static_cast<double>(seen));
}

TEST(SweptCulling, AnswersAsTheRegionsDoWhereItLooksAllAround) {
  const Scene scene(test::grouped_hills(2));
  SweptCulling swept(scene.regions, scene.batches);
  const Position eye{200, 200, 150};
  EXPECT_EQ(swept.visible({eye, {}}).visible_groups.size(), scene.batches.groups());
  EXPECT_TRUE(swept.may_show({{0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(swept.visible({eye, ViewRange{0, 3}}).visible_groups,
            CertifiedCulling(scene.regions).visible({eye, ViewRange{0, 3}}).visible_groups);
}

TEST(SweptCulling, OfNoGroupsAreNone) {
  const Tin tin;
  const GroupBatches batches(tin, {});
  const CertifiedRegions regions;
  EXPECT_TRUE(
      SweptCulling(regions, batches).visible({{0, 0, 0}, ViewRange{0, 1}}).visible_groups.empty());
}

}  // namespace
}  // namespace scarp
