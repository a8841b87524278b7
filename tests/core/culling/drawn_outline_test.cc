#include "core/culling/drawn_outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/raster/rasterise.h"
#include "core/sight/triangle_sight.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

using Point = UpperOutline::Point;

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  std::size_t below(std::size_t end) { return random_() % end; }

 private:
  std::mt19937 random_;
};

Shot random_shot(const Tin& tin, Random& random, double above_m) {
  Shot shot;
  shot.width_px = 320;
  shot.height_px = 180;
  shot.view.eye = tin.vertices[random.below(tin.vertices.size())];
  shot.view.eye.z_m = round_to_lattice(shot.view.eye.z_m + above_m);
  const double azimuth_rad = 6.3 * random.unit();
  shot.view.target = shot.view.eye;
  shot.view.target.x_m += 100 * std::cos(azimuth_rad);
  shot.view.target.y_m += 100 * std::sin(azimuth_rad);
  shot.view.target.z_m -= 60 * random.unit() - 10;
  return shot;
}

/// Segments that were raised, asked place by place.
struct Segments {
  std::vector<std::array<Point, 2>> all;

  double highest_at(double x) const {
    double highest = -HUGE_VAL;
    for (const auto& [a, b] : all)
      if (a.x <= x && x <= b.x)
        highest = std::max(highest, a.y + (b.y - a.y) * (x - a.x) / (b.x - a.x));
    return highest;
  }
};

TEST(UpperOutline, CoversWhatLiesUnderTheHighestOfAllSegments) {
  Random random(1);
  std::size_t covered = 0, open = 0;
  for (int round = 0; round < 40; ++round) {
    UpperOutline outline;
    Segments segments;
    for (int i = 0; i < 30; ++i) {
      const double from = random.unit(), to = from + 0.01 + 0.3 * random.unit();
      const std::array<Point, 2> segment{Point{from, random.unit()}, Point{to, random.unit()}};
      segments.all.push_back(segment);
      outline.raise(segment[i % 2], segment[1 - i % 2]);
      const double at = random.unit(), end = at + 0.2 * random.unit();
      const Point a{at, 1.2 * random.unit() - 0.4}, b{end, 1.2 * random.unit() - 0.4};
      double least_m = HUGE_VAL;
      for (int k = 0; k <= 400; ++k) {
        const double x = a.x + (b.x - a.x) * k / 400;
        least_m = std::min(least_m, segments.highest_at(x) - (a.y + (b.y - a.y) * k / 400));
      }
      const bool is_covered = outline.covers(a, b);
      ASSERT_EQ(is_covered, outline.covers(b, a));
      if (is_covered) {
        ASSERT_GT(least_m, 0);
      }
      // What dips between the places that were looked at is less than this.
      if (least_m > 0.1) {
        EXPECT_TRUE(is_covered);
      }
      (is_covered ? covered : open) += 1;
    }
    EXPECT_LT(outline.pieces(), 90U) << "pieces of one line are one";
  }
  EXPECT_GT(covered, 100U);
  EXPECT_GT(open, 100U);
}

TEST(UpperOutline, CoversNothingWhereItHasAGap) {
  UpperOutline outline;
  outline.raise({0, 1}, {1, 1});
  outline.raise({2, 1}, {1.25, 1});
  EXPECT_TRUE(outline.covers({0.1, 0}, {0.9, 0}));
  EXPECT_FALSE(outline.covers({0.9, 0}, {1.3, 0}));
  EXPECT_FALSE(outline.covers({-0.1, 0}, {0.1, 0}));
  outline.raise({1, 0.5}, {1.25, 0.5});
  EXPECT_TRUE(outline.covers({0.9, 0}, {1.3, 0}));
  EXPECT_FALSE(outline.covers({0.9, 0.7}, {1.3, 0}));
}

TEST(DrawnOutline, WhatItHidesTheJudgeHidesToo) {
  std::size_t hidden = 0, truly_hidden = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const Tin tin = test::triangulated(
        test::random_hills(30, 30, 10, seed, 120, seed % 2 == 0 ? 20 : 0.01, seed % 3 * 0.1), seed);
    const TinIndex index(tin);
    for (const double above_m : {2.0, 40.0, 0.0, -10.0}) {
      const Shot shot = random_shot(tin, random, above_m);
      const auto is_kept = over_outline(shot, tin.vertices, tin.triangles);
      const auto sight = judge_all(index, shot.view.eye);
      const Projection projection = look_at(shot.view, shot.width_px, shot.height_px);
      for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
        const bool is_hidden = sight[t] == TriangleSight::kHidden;
        if (!is_kept[t]) {
          ASSERT_TRUE(is_hidden) << "seed " << seed << ", triangle " << t;
        }
        bool is_before = true;
        for (const VertexIndex v : tin.triangles[t])
          is_before &= projection.project(tin.vertices[v]).w > 30;
        if (above_m <= 0 || !is_before) continue;
        hidden += !is_kept[t];
        truly_hidden += is_hidden;
      }
    }
  }
  EXPECT_GT(truly_hidden, 1000U);
  EXPECT_GT(hidden, truly_hidden * 8 / 10) << "and nearly all of that";
}

TEST(DrawnOutline, PicturesOfWhatIsLeftAreThoseOfAll) {
  std::size_t left = 0, shown = 0, in_all = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const Tin tin = test::triangulated(test::random_hills(40, 40, 10, seed, 120, 0.01), seed);
    for (int i = 0; i < 8; ++i) {
      const Shot shot = random_shot(tin, random, i % 2 == 0 ? 2 : 60);
      const auto is_kept = over_outline(shot, tin.vertices, tin.triangles);
      std::vector<std::array<VertexIndex, 3>> kept;
      std::vector<std::uint32_t> objects;
      for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
        if (!is_kept[t]) continue;
        kept.push_back(tin.triangles[t]);
        objects.push_back(t);
      }
      for (const int scale : {1, 3}) {
        Target all = empty_target(shot.width_px * scale, shot.height_px * scale), some = all;
        const auto places =
            project_all(look_at(shot.view, all.width_px, all.height_px), tin.vertices);
        rasterise(all, places, tin.triangles);
        rasterise(some, places, kept, objects);
        ASSERT_EQ(all.object, some.object);
        if (scale == 1) continue;
        std::vector<std::uint8_t> has_pixel(tin.triangles.size(), 0);
        for (const std::uint32_t object : all.object)
          if (object != kNone) has_pixel[object] = 1;
        for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
          bool is_before = true;
          for (const VertexIndex v : tin.triangles[t]) is_before &= places[v].w > 1;
          left += is_before && is_kept[t], in_all += is_before;
          shown += is_before && has_pixel[t];
        }
      }
    }
  }
  EXPECT_LT(left, in_all / 2) << "of all before the eye, beside the picture too";
  EXPECT_GT(left, shown);
}

}  // namespace
}  // namespace scarp
