#include "core/culling/mask_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <random>

#include "core/culling/image_culling.h"
#include "core/raster/rasterise.h"
#include "tests/support/grouped_ground.h"

namespace scarp {
namespace {

/// The farthest that a place at least distance_m deep moves in a picture, for eyes on a ball.
double greatest_move_px(double ball_m, double distance_m, double half_angle_rad, double size_px) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const double focal_px = size_px / (2 * std::tan(half_angle_rad));
  double greatest = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double z_m = distance_m * (i % 4 == 0 ? 1 : 1 + 3 * unit(random));
    const double x_m = z_m * std::tan(half_angle_rad) * (i % 3 == 0 ? 1 : 2 * unit(random) - 1);
    const double turn = 2 * M_PI * unit(random);
    const double a_m = ball_m * std::cos(turn), c_m = ball_m * std::sin(turn);
    greatest = std::max(greatest, std::abs(focal_px * ((x_m - a_m) / (z_m - c_m) - x_m / z_m)));
  }
  return greatest;
}

/// Equation (1) as it is printed.
double printed_ball_m(double margin_px, double distance_m, double half_angle_rad, double size_px) {
  return 2 * margin_px * distance_m / (size_px * std::tan(half_angle_rad));
}

TEST(BallOfMargin, NothingMovesFartherThanTheMarginAcrossThePicture) {
  for (const double angle_deg : {20.0, 60.0, 90.0, 120.0})
    for (const double margin_px : {1.0, 6.0, 20.0}) {
      const double half_rad = angle_deg * M_PI / 360;
      const double ball_m = ball_of_margin_m(margin_px, 100, half_rad, 512);
      EXPECT_LE(greatest_move_px(ball_m, 100, half_rad, 512), margin_px * (1 + 1e-9));
      EXPECT_GT(greatest_move_px(ball_m, 100, half_rad, 512), 0.9 * margin_px) << "and not by far";
    }
}

TEST(BallOfMargin, AsPrintedItIsThreeTimesTooLargeAtSixtyDegrees) {
  const double half_rad = M_PI / 6;
  EXPECT_GT(greatest_move_px(printed_ball_m(6, 100, half_rad, 512), 100, half_rad, 512), 3 * 6);
}

TEST(Erode, TakesTheFarthestAround) {
  std::mt19937 random(2);
  OcclusionMap map{23, 17, {}};
  for (int i = 0; i < 23 * 17; ++i)
    map.depth.push_back(random() % 40 == 0 ? 0 : static_cast<float>(random() % 1000) + 1);
  const OcclusionMap before = map;
  erode(map, 2);
  for (int y = 0; y < 17; ++y)
    for (int x = 0; x < 23; ++x) {
      float least = HUGE_VALF;
      for (int ny = std::max(0, y - 2); ny <= std::min(16, y + 2); ++ny)
        for (int nx = std::max(0, x - 2); nx <= std::min(22, x + 2); ++nx)
          least = std::min(least, before.depth[static_cast<std::size_t>(ny * 23 + nx)]);
      ASSERT_EQ(map.depth[static_cast<std::size_t>(y * 23 + x)], least);
    }
}

/// Upright walls across the view, each two triangles, unconnected.
struct Walls {
  Tin tin;

  void add(double low_x_m, double high_x_m, double y_m, double high_z_m) {
    const auto first = static_cast<VertexIndex>(tin.vertices.size());
    for (const auto& [x_m, z_m] :
         {std::pair{low_x_m, -50.0}, {high_x_m, -50.0}, {high_x_m, high_z_m}, {low_x_m, high_z_m}})
      tin.vertices.push_back({x_m, y_m, z_m});
    tin.triangles.push_back({first, first + 1, first + 2});
    tin.triangles.push_back({first, first + 2, first + 3});
  }
};

TEST(Erode, AnErodedUnionOfOccludersLeaksBetweenThem) {
  // Two walls, the right one farther away, whose edges meet in the picture: from a little to the
  // right one looks between them.
  Walls walls;
  walls.add(-60, 0, 100, 50);
  walls.add(0, 120, 200, 50);
  connect_neighbours(walls.tin);
  const std::vector<TriangleIndex> all{0, 1, 2, 3};
  View view;
  view.eye = {0, 0, 0};
  view.target = {0, 100, 0};
  constexpr int kSizePx = 128, kMarginPx = 6;
  OcclusionMap map{kSizePx, kSizePx, {}};
  OcclusionMapper mapper(walls.tin);
  mapper.draw(look_at(view, kSizePx, kSizePx), all, map);
  const std::size_t middle = kSizePx / 2 * kSizePx + kSizePx / 2;
  // Drawn as pictures are, the union has no gap, and keeps none when it is eroded.
  Target target = empty_depth_target(kSizePx, kSizePx);
  const Projection projection = look_at(view, kSizePx, kSizePx);
  rasterise(target, project_all(projection, walls.tin.vertices), walls.tin.triangles);
  OcclusionMap united{kSizePx, kSizePx, target.depth};
  erode(united, kMarginPx);
  ASSERT_GT(united.depth[middle], 0) << "the middle counts as covered";
  // From within the ball that the margin pays for, a ray between the walls reaches what is behind.
  const double ball_m =
      ball_of_margin_m(kMarginPx, 100, view.vertical_field_of_view_rad / 2, kSizePx);
  view.eye.x_m += ball_m / 2;
  view.target.x_m += ball_m / 2;
  Target later = empty_depth_target(kSizePx, kSizePx);
  rasterise(later, project_all(look_at(view, kSizePx, kSizePx), walls.tin.vertices),
            walls.tin.triangles);
  std::size_t gaps = 0;
  for (int x = kSizePx / 4; x < 3 * kSizePx / 4; ++x)
    gaps += later.depth[static_cast<std::size_t>(kSizePx / 2 * kSizePx + x)] == 0;
  EXPECT_GT(gaps, 0U);
  // The conservative map knows of the edge between them.
  EXPECT_EQ(map.depth[middle], 0);
}

/// Walks over hills and calls visit(step, answer, method) at each of the frames.
void walk(std::uint32_t seed, double step_m, const MaskOptions& options,
          const std::function<void(const GroupBatches&, const Shot&, const CullingAnswer&,
                                   const MaskCulling&)>& visit) {
  const test::GroupedGround scene = test::grouped_hills(seed);
  const GroupBatches batches(scene.tin, scene.groups);
  const BoxTree tree(batches);
  MaskCulling mask(scene.tin, batches, tree, options);
  for (int i = 0; i < 20; ++i) {
    Shot shot;
    shot.width_px = 160;
    shot.height_px = 90;
    shot.view.eye = {200, 20 + i * step_m, 60};
    shot.view.target = {205, 120 + i * step_m, 55};
    const CullingAnswer answer = mask.visible(camera_of(shot));
    visit(batches, shot, answer, mask);
  }
}

TEST(MaskCulling, LeavesEveryPixelAsItIsWhereTheMaskIsNew) {
  MaskOptions options;
  options.least_distance_m = 20;
  options.margin_px = 1;
  std::size_t left_out = 0, frames = 0;
  for (std::uint32_t seed = 1; seed <= 3; ++seed)
    walk(seed, 15, options,
         [&](const auto& batches, const Shot& shot, const auto& answer, const MaskCulling& mask) {
           std::vector<GroupIndex> all;
           for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
           ASSERT_EQ(test::picture_of(batches, answer.visible_groups, shot).object,
                     test::picture_of(batches, all, shot).object);
           const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
           for (const GroupIndex g : all) left_out += frustum.may_show(batches.box(g));
           left_out -= answer.visible_groups.size();
           ++frames;
           EXPECT_EQ(mask.critical_frames() % 20, frames % 20) << "every frame is critical";
         });
  EXPECT_GT(left_out, frames) << "it must also leave something out";
}

TEST(MaskCulling, KeepsItsMaskWhileTheMarginPaysForTheWay) {
  MaskOptions options;
  options.least_distance_m = 20;
  std::uint64_t critical = 0;
  walk(2, 0.02, options, [&](const auto&, const Shot&, const auto&, const MaskCulling& mask) {
    critical = mask.critical_frames();
  });
  EXPECT_GE(critical, 1U);
  EXPECT_LT(critical, 5U);
}

/// A camera on the hills of walk().
Shot shot_on_hills(double y_m) {
  Shot shot;
  shot.width_px = 160;
  shot.height_px = 90;
  shot.view.eye = {200, y_m, 60};
  shot.view.target = {205, y_m + 100, 55};
  return shot;
}

TEST(MaskCulling, TakingAnOccluderAwayForcesACriticalFrameAndNothingElseDoes) {
  const test::GroupedGround scene = test::grouped_hills(2);
  const GroupBatches batches(scene.tin, scene.groups);
  const BoxTree tree(batches);
  MaskOptions options;
  options.least_distance_m = 20;
  options.margin_px = 1;
  MaskCulling mask(scene.tin, batches, tree, options);
  std::vector<GroupIndex> all;
  for (GroupIndex g = 0; g < batches.groups(); ++g) all.push_back(g);
  const Shot shot = shot_on_hills(20);
  const CullingAnswer first = mask.visible(camera_of(shot));
  ASSERT_LT(first.visible_groups.size(), all.size());
  // Take each group away in turn, at the same camera: pictures stay right, whatever it hid.
  std::size_t forced = 0, shown_more = 0;
  for (const GroupIndex taken : all) {
    std::vector<std::uint8_t> present(all.size(), 1);
    present[taken] = 0;
    const std::uint64_t before = mask.critical_frames();
    ASSERT_TRUE(mask.set_present(present));
    const CullingAnswer answer = mask.visible(camera_of(shot));
    forced += mask.critical_frames() - before;
    shown_more += answer.visible_groups.size() > first.visible_groups.size();
    std::vector<GroupIndex> others = all;
    others.erase(others.begin() + taken);
    ASSERT_EQ(test::picture_of(batches, answer.visible_groups, shot).object,
              test::picture_of(batches, others, shot).object)
        << "without group " << taken;
    // Put back, it is drawn until the next mask, and so is what hides nothing new.
    ASSERT_TRUE(mask.set_present(std::vector<std::uint8_t>(all.size(), 1)));
    const CullingAnswer back = mask.visible(camera_of(shot));
    const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
    if (frustum.may_show(batches.box(taken))) {
      EXPECT_TRUE(
          std::binary_search(back.visible_groups.begin(), back.visible_groups.end(), taken));
    }
    ASSERT_EQ(test::picture_of(batches, back.visible_groups, shot).object,
              test::picture_of(batches, all, shot).object);
  }
  EXPECT_GT(forced, 0U);
  EXPECT_LT(forced, all.size()) << "groups beside the picture are no occluders";
  EXPECT_GT(shown_more, 0U) << "something stood behind a group that was taken away";
}

TEST(MaskCulling, ASecondThreadMakesMasksBeforeTheyAreNeeded) {
  const test::GroupedGround scene = test::grouped_hills(2);
  const GroupBatches batches(scene.tin, scene.groups);
  const BoxTree tree(batches);
  std::vector<std::vector<GroupIndex>> answers[2];
  for (const bool in_background : {false, true}) {
    MaskOptions options;
    options.least_distance_m = 20;
    options.margin_px = 1;
    options.in_background = in_background;
    std::atomic<int> begun = 0, done = 0;
    options.on_step = [&](MaskStep step) {
      begun += step == MaskStep::kChoose;
      done += step == MaskStep::kDone;
    };
    for (int repeat = 0; repeat < 2; ++repeat) {
      MaskCulling mask(scene.tin, batches, tree, options);
      std::vector<std::vector<GroupIndex>> groups;
      for (int i = 0; i < 12; ++i)
        groups.push_back(mask.visible(camera_of(shot_on_hills(20 + i * 0.04))).visible_groups);
      if (repeat == 0)
        answers[in_background] = groups;
      else
        EXPECT_EQ(groups, answers[in_background]) << "whatever the threads do";
    }
    EXPECT_EQ(begun, done);
    EXPECT_GT(done, 2);
  }
  // Both leave something out, at every frame.
  for (const auto& groups : answers)
    for (const auto& frame : groups) EXPECT_LT(frame.size(), batches.groups());
}

TEST(MaskCulling, DrawnByCentresItErodesOnePixelMoreAndHidesMore) {
  std::size_t plain = 0, conservative = 0;
  for (const MaskDrawing drawing : {MaskDrawing::kConservatively, MaskDrawing::kByCentres}) {
    MaskOptions options;
    options.least_distance_m = 20;
    options.margin_px = 2;
    options.drawing = drawing;
    std::size_t& drawn = drawing == MaskDrawing::kByCentres ? plain : conservative;
    walk(1, 15, options, [&](const auto&, const Shot&, const CullingAnswer& answer, const auto&) {
      drawn += answer.visible_groups.size();
    });
  }
  EXPECT_LT(plain, conservative);
}

TEST(BoxTree, HoldsEveryGroupOnceInBoxesThatHoldItsChildren) {
  const test::GroupedGround scene = test::grouped_hills(3);
  const GroupBatches batches(scene.tin, scene.groups);
  const BoxTree tree(batches);
  std::vector<int> found(batches.groups(), 0);
  const auto holds = [](const Bounds& outer, const Bounds& inner) {
    return outer.low.x_m <= inner.low.x_m && outer.high.x_m >= inner.high.x_m &&
           outer.low.y_m <= inner.low.y_m && outer.high.y_m >= inner.high.y_m &&
           outer.low.z_m <= inner.low.z_m && outer.high.z_m >= inner.high.z_m;
  };
  for (const BoxTree::Node& node : tree.nodes()) {
    for (const GroupIndex g : tree.groups_of(node)) EXPECT_TRUE(holds(node.box, batches.box(g)));
    if (node.left == kNone) {
      ASSERT_EQ(node.count, 1U);
      ++found[tree.groups_of(node)[0]];
    } else {
      EXPECT_EQ(tree.nodes()[node.left].count + tree.nodes()[node.right].count, node.count);
      EXPECT_EQ(tree.nodes()[node.left].triangles + tree.nodes()[node.right].triangles,
                node.triangles);
    }
  }
  for (const int count : found) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace scarp
