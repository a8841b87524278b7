#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "core/threads/parallel_for.h"
#include "core/viewshed/viewshed.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

constexpr double kCellM = 100;

/// Rows of heights in metres, "?" for void, on a flat earth with square cells.
GroundGrid scene(const std::vector<std::string>& rows) {
  std::vector<std::vector<std::string>> words;
  for (const std::string& row : rows) {
    std::istringstream stream(row);
    words.emplace_back();
    for (std::string word; stream >> word;) words.back().push_back(word);
  }
  SeparablePlacement placement;
  for (std::size_t c = 0; c < words[0].size(); ++c)
    placement.x_of_column_m.push_back(kCellM * static_cast<double>(c));
  for (std::size_t r = 0; r < words.size(); ++r)
    placement.y_of_row_m.push_back(-kCellM * static_cast<double>(r));
  GroundGrid grid(static_cast<std::int32_t>(words[0].size()),
                  static_cast<std::int32_t>(words.size()), placement);
  for (std::int32_t r = 0; r < grid.rows(); ++r)
    for (std::int32_t c = 0; c < grid.columns(); ++c)
      if (const std::string& word = words[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
          word != "?")
        grid.set_z(c, r, std::stod(word));
  return grid;
}

/// The answer as it is drawn: v visible, h hidden, ? unknown.
std::vector<std::string> drawn(const GroundGrid& grid, const Position& eye,
                               const ViewshedEye& like = {}) {
  std::vector<Seen> seen(static_cast<std::size_t>(grid.columns() * grid.rows()), Seen::kHidden);
  ViewshedEye asked = like;
  asked.position = eye;
  view_from(grid, {}, asked, seen);
  std::vector<std::string> rows;
  for (std::int32_t r = 0; r < grid.rows(); ++r) {
    rows.emplace_back();
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      const Seen s = seen[static_cast<std::size_t>(r * grid.columns() + c)];
      rows.back() += s == Seen::kVisible ? 'v' : s == Seen::kHidden ? 'h' : '?';
    }
  }
  return rows;
}

Position over(const GroundGrid& grid, std::int32_t column, std::int32_t row, double height_m) {
  Position p = grid.at(column, row);
  p.z_m += height_m;
  return p;
}

using Rows = std::vector<std::string>;

TEST(ViewshedScenes, FarRidgeBehindANearHill) {
  const GroundGrid grid = scene({"0 0 40 0 0 300", "0 0 40 0 0 300", "0 0 40 0 0 300"});
  EXPECT_EQ(drawn(grid, over(grid, 0, 1, 2)), (Rows{"vvvhhv", "vvvhhv", "vvvhhv"}));
}

TEST(ViewshedScenes, OneSampleSpikeSeesAllOfAPlain) {
  Rows plain(9, "0 0 0 0 0 0 0 0 0");
  plain[4] = "0 0 0 0 255 0 0 0 0";
  const GroundGrid grid = scene(plain);
  EXPECT_EQ(drawn(grid, over(grid, 4, 4, 2)), Rows(9, "vvvvvvvvv"));
}

TEST(ViewshedScenes, CliffHidesItsFootFromAbove) {
  const GroundGrid grid = scene({"100 100 100 0 0 0 0 0", "100 100 100 0 0 0 0 0"});
  // From 10 m over the second sample before the edge the line leaves over the edge by 5 %: a
  // hundred metres down after 1000 m and more. From 200 m over it the foot is a cell wide.
  EXPECT_EQ(drawn(grid, over(grid, 0, 0, 10))[0], "vvvhhhhh");
  EXPECT_EQ(drawn(grid, over(grid, 0, 0, 200))[0], "vvvvvvvv");
  EXPECT_EQ(drawn(grid, over(grid, 0, 0, 199.5))[0], "vvvhvvvv");
}

TEST(ViewshedScenes, TouchingIsNotBlocking) {
  const GroundGrid level = scene({"5 5 5 5 5", "5 5 5 5 5"});
  EXPECT_EQ(drawn(level, over(level, 0, 0, 0)), Rows(2, "vvvvv"));
  const GroundGrid slope = scene({"0 10 20 30 40", "0 10 20 30 40"});
  EXPECT_EQ(drawn(slope, over(slope, 0, 1, 0)), Rows(2, "vvvvv"));
}

TEST(ViewshedScenes, WallOfOneSampleOnADiagonal) {
  const GroundGrid grid = scene({"0 0 0 9 0", "0 0 9 0 0", "0 9 0 0 0", "9 0 0 0 0", "0 0 0 0 0"});
  const Rows seen = drawn(grid, over(grid, 0, 0, 1));
  // Along the other diagonal the line passes over samples only, between those of the wall.
  EXPECT_EQ(seen, (Rows{"vvvvh", "vvvhh", "vvvhh", "vhhvh", "hhhhv"}));
}

TEST(ViewshedScenes, VoidIsUnknownUnlessKnownGroundBlocks) {
  const GroundGrid grid = scene({"0 0 ? 0 50 0", "0 0 ? 0 50 0"});
  EXPECT_EQ(drawn(grid, over(grid, 0, 0, 2)), (Rows{"vv???h", "vv???h"}));
}

TEST(ViewshedScenes, EyeUnderGroundSeesNothingButWhatTouchesIt) {
  const GroundGrid grid = scene({"5 5 5 5", "5 5 5 5", "5 5 5 5"});
  EXPECT_EQ(drawn(grid, over(grid, 1, 1, -1)), (Rows{"vvvh", "vhvh", "vvvh"}));
}

TEST(ViewshedScenes, LimitsOfDistanceAzimuthAndPitch) {
  const GroundGrid grid = scene({"0 0 0 0 0", "0 0 0 0 0", "0 0 0 0 0", "0 0 0 0 0", "0 0 0 0 0"});
  const Position eye = over(grid, 2, 2, 10);
  ViewshedEye like;
  like.limits.max_distance_m = 150;
  EXPECT_EQ(drawn(grid, eye, like), (Rows{"hhhhh", "hvvvh", "hvvvh", "hvvvh", "hhhhh"}));
  like.limits.min_distance_m = 120;
  EXPECT_EQ(drawn(grid, eye, like), (Rows{"hhhhh", "hvhvh", "hhhhh", "hvhvh", "hhhhh"}));
  like.limits = {};
  like.limits.azimuth_begin_rad = 300 * M_PI / 180;
  like.limits.azimuth_end_rad = 50 * M_PI / 180;
  EXPECT_EQ(drawn(grid, eye, like), (Rows{"vvvvv", "hvvvh", "hhvhh", "hhhhh", "hhhhh"}));
  like.limits = {};
  like.limits.min_pitch_rad = std::atan2(-10, 150);
  EXPECT_EQ(drawn(grid, eye, like)[2], "vhhhv");
}

TEST(Viewshed, EyeThatReachesNoSampleChangesNothing) {
  const GroundGrid grid = scene({"0 0 0 0", "0 0 0 0"});
  Position aside = grid.at(0, 0);
  aside.x_m -= 5000;
  ViewshedEye eye{aside, 0, {}};
  eye.limits.max_distance_m = 100;
  std::vector<Seen> seen(8, Seen::kHidden);
  AnyEye any(grid);
  EyeCount count(grid);
  LeastHeight least(grid);
  std::vector<float> least_m(8);
  any.add(view_from(grid, {}, eye, seen), seen);
  count.add(view_from(grid, {}, eye, seen), seen);
  least.add(heights_from(grid, {}, eye, least_m), least_m);
  least.lower(grid, {}, eye);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(any.seen()[i], Seen::kHidden);
    EXPECT_EQ(count.counts()[i], 0U);
    EXPECT_TRUE(std::isnan(least.heights_m()[i]));
  }
}

TEST(Viewshed, SameForAnyNumberOfThreads) {
  const GroundGrid grid = test::random_ground({test::Relief::kSmooth, 150, 140, 1.0, 0.02, 5});
  const Position eye = over(grid, 70, 60, 2);
  std::vector<Seen> one(static_cast<std::size_t>(grid.columns() * grid.rows())), three = one;
  set_thread_count(1);
  sweep_viewshed(grid, eye, 0, whole_window(grid), one);
  set_thread_count(3);
  sweep_viewshed(grid, eye, 0, whole_window(grid), three);
  set_thread_count(0);
  EXPECT_EQ(one, three);
}

TEST(Viewshed, CountAndAnyPutEyesTogether) {
  const GroundGrid grid = scene({"0 0 40 0 0", "0 0 40 0 ?"});
  AnyEye any(grid);
  EyeCount count(grid);
  std::vector<Seen> seen(10);
  for (const std::int32_t column : {0, 4}) {
    const SampleWindow window = view_from(grid, {}, {over(grid, column, 0, 2), 0, {}}, seen);
    any.add(window, seen);
    count.add(window, seen);
  }
  EXPECT_EQ(any.seen()[0], Seen::kVisible);
  EXPECT_EQ(any.seen()[3], Seen::kVisible);
  EXPECT_EQ(count.counts()[2], 2U);
  EXPECT_EQ(count.counts()[0], 1U);
  EXPECT_EQ(count.counts()[9], EyeCount::kVoid);
}

}  // namespace
}  // namespace scarp
