#include "core/culling/image_culling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/raster/rasterise.h"
#include "tests/support/grouped_ground.h"

namespace scarp {
namespace {

Shot random_shot(const Tin& tin, std::mt19937& random) {
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  const Position& under = tin.vertices[random() % tin.vertices.size()];
  Shot shot;
  shot.width_px = 160;
  shot.height_px = 90;
  shot.view.eye = {under.x_m, under.y_m, under.z_m + 2 + 40 * unit() * unit()};
  const double turn = 6.28 * unit();
  shot.view.target = {shot.view.eye.x_m + std::cos(turn), shot.view.eye.y_m + std::sin(turn),
                      shot.view.eye.z_m - 0.4 * unit()};
  return shot;
}

TEST(HzbCulling, LeavesEveryPixelAsItIsAtAnyResolution) {
  std::size_t left_out = 0, asked = 0;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const test::GroupedGround scene = test::grouped_hills(seed);
    const GroupBatches batches(scene.tin, scene.groups);
    ImageCullingOptions options;
    options.width_px = 96;
    options.occluder_triangles = seed % 2 == 0 ? 1000 : 100'000;
    HzbCulling hzb(scene.tin, batches, options);
    std::vector<GroupIndex> all;
    for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
    std::mt19937 random(seed);
    for (int i = 0; i < 12; ++i) {
      const Shot shot = random_shot(scene.tin, random);
      const CullingAnswer answer = hzb.visible(camera_of(shot));
      asked += answer.nodes_tested;
      left_out += answer.nodes_tested - answer.visible_groups.size();
      for (const int scale : {1, 3})
        ASSERT_EQ(test::picture_of(batches, answer.visible_groups, shot, scale).object,
                  test::picture_of(batches, all, shot, scale).object)
            << "seed " << seed << ", shot " << i << ", scale " << scale;
    }
  }
  EXPECT_GT(left_out, asked / 4) << "it must also leave something out";
}

/// The groups that methods leave out of the same pictures of some hills.
struct LeftOut {
  std::size_t groups = 0, wrong_px = 0, asked = 0;
};

template <class Method, class... Arguments>
LeftOut left_out_by(const ImageCullingOptions& options, Arguments... arguments) {
  LeftOut out;
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const test::GroupedGround scene = test::grouped_hills(seed);
    const GroupBatches batches(scene.tin, scene.groups);
    Method method(batches, arguments..., options);
    std::vector<GroupIndex> all;
    for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
    std::mt19937 random(seed);
    for (int i = 0; i < 8; ++i) {
      const Shot shot = random_shot(scene.tin, random);
      const CullingAnswer answer = method.visible(camera_of(shot));
      out.asked += answer.nodes_tested;
      out.groups += answer.nodes_tested - answer.visible_groups.size();
      const Target drawn = test::picture_of(batches, answer.visible_groups, shot);
      const Target whole = test::picture_of(batches, all, shot);
      for (std::size_t p = 0; p < whole.object.size(); ++p)
        out.wrong_px += whole.object[p] != drawn.object[p];
    }
  }
  return out;
}

TEST(HomCulling, AnEstimateOfDepthHidesLessThanAPyramidAndAThresholdMore) {
  ImageCullingOptions options;
  options.width_px = 160;
  options.occluder_triangles = 400;  // an estimate hides only what is behind all occluders
  const LeftOut estimate = left_out_by<HomCulling>(options, DepthTest::kEstimate);
  const LeftOut hybrid = left_out_by<HomCulling>(options, DepthTest::kPyramid);
  options.opacity = 0.5F;
  const LeftOut aggressive = left_out_by<HomCulling>(options, DepthTest::kPyramid);
  EXPECT_GT(estimate.groups, 0U);
  EXPECT_LT(estimate.groups, hybrid.groups);
  EXPECT_LT(hybrid.groups, aggressive.groups);
  EXPECT_LE(hybrid.wrong_px, aggressive.wrong_px);
}

TEST(VolumeScanCulling, BoxesThemselvesHideMoreThanTheirRectangles) {
  ImageCullingOptions options;
  options.width_px = 160;
  const LeftOut rectangles = left_out_by<HomCulling>(options, DepthTest::kPyramid);
  const LeftOut volumes = left_out_by<VolumeScanCulling>(options);
  EXPECT_GT(volumes.groups, rectangles.groups);
  EXPECT_LT(volumes.wrong_px, 40U) << "of 345,600: only what falls between centres";
  options.threshold_px = 20;
  EXPECT_GT(left_out_by<VolumeScanCulling>(options).groups, volumes.groups);
}

TEST(VolumeScanCulling, CountsThePixelsOfEachBoxOfAPassApart) {
  // The answers do not depend on which boxes share a pass: one box alone is answered as among all.
  const test::GroupedGround scene = test::grouped_hills(2);
  const GroupBatches batches(scene.tin, scene.groups);
  VolumeScanCulling method(batches);
  std::mt19937 random(2);
  const Shot shot = random_shot(scene.tin, random);
  const auto visible = method.visible(camera_of(shot)).visible_groups;
  std::size_t hidden = 0;
  for (GroupIndex g = 0; g < batches.groups(); ++g) {
    const bool shows = std::binary_search(visible.begin(), visible.end(), g);
    hidden += !shows;
    EXPECT_EQ(method.may_show(batches.box(g)), shows) << g;
  }
  EXPECT_GT(hidden, 0U);
}

TEST(ImageCulling, GroupsThatAreNotThereHideNothingAndAreNotListed) {
  const test::GroupedGround scene = test::grouped_hills(3);
  const GroupBatches batches(scene.tin, scene.groups);
  HzbCulling hzb(scene.tin, batches);
  std::mt19937 random(3);
  for (int i = 0; i < 10; ++i) {
    std::vector<std::uint8_t> present(batches.groups());
    std::vector<GroupIndex> there;
    for (GroupIndex g = 0; g < batches.groups(); ++g)
      if ((present[g] = random() % 3 != 0)) there.push_back(g);
    ASSERT_TRUE(hzb.set_present(present));
    const Shot shot = random_shot(scene.tin, random);
    const CullingAnswer answer = hzb.visible(camera_of(shot));
    for (const GroupIndex g : answer.visible_groups) EXPECT_TRUE(present[g]);
    EXPECT_EQ(test::picture_of(batches, answer.visible_groups, shot, 2).object,
              test::picture_of(batches, there, shot, 2).object);
  }
}

TEST(Frustum, ShowsEveryBoxOfWhichATriangleIsDrawn) {
  const test::GroupedGround scene = test::grouped_hills(7);
  const GroupBatches batches(scene.tin, scene.groups);
  std::vector<GroupIndex> all;
  for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
  std::mt19937 random(7);
  std::size_t beside = 0;
  for (int i = 0; i < 20; ++i) {
    const Shot shot = random_shot(scene.tin, random);
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    for (const std::uint32_t object : test::picture_of(batches, all, shot, 1).object) {
      if (object == kNone) continue;
      const GroupIndex group = scene.groups.group_of_triangle[object];
      if (group != kNone) {
        ASSERT_TRUE(frustum.may_show(batches.box(group)));
      }
    }
    for (const GroupIndex g : all) beside += !frustum.may_show(batches.box(g));
  }
  EXPECT_GT(beside, 10 * all.size()) << "half the groups are behind the eye";
}

TEST(CameraOf, HoldsTheAzimuthOfEveryRay) {
  std::mt19937 random(3);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  int all_around = 0;
  for (int i = 0; i < 300; ++i) {
    Shot shot;
    shot.width_px = 100 + static_cast<int>(200 * unit());
    shot.height_px = 100;
    shot.view.vertical_field_of_view_rad = 0.2 + 1.5 * unit();
    const double turn = 6.28 * unit(), pitch = 3 * (unit() - 0.5);
    shot.view.target = {std::cos(turn) * std::cos(pitch), std::sin(turn) * std::cos(pitch),
                        std::sin(pitch)};
    const Camera camera = camera_of(shot);
    if (!camera.view) {
      ++all_around;
      continue;
    }
    const Projection projection = look_at(shot.view, shot.width_px, shot.height_px);
    for (int k = 0; k < 50; ++k) {
      const Position ray = ray_through(projection, 2 * unit() - 1, 2 * unit() - 1);
      const double middle = (camera.view->from_rad + camera.view->to_rad) / 2;
      const double turn_rad = std::remainder(std::atan2(ray.y_m, ray.x_m) - middle, 2 * M_PI);
      ASSERT_LE(std::abs(turn_rad), (camera.view->to_rad - camera.view->from_rad) / 2);
    }
  }
  EXPECT_GT(all_around, 20);
  EXPECT_LT(all_around, 250);
}

}  // namespace
}  // namespace scarp
