#include "core/occlusion/upright_occluder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace scarp {
namespace {

UprightOccluder along_x(const std::vector<std::pair<double, double>>& profile) {
  std::vector<Position> top;
  for (const auto& [x_m, z_m] : profile) top.push_back({x_m, 0, z_m});
  return UprightOccluder(std::move(top));
}

/// The definition, for a polyline along the x axis: where the line crosses the plane it is no
/// higher than the polyline. The margin is that of the double arithmetic.
bool passes_below(const UprightOccluder& occluder, const Position& eye, const Position& target,
                  double margin_m) {
  if (!(eye.y_m * target.y_m < 0)) return false;
  const double share = eye.y_m / (eye.y_m - target.y_m);
  const double x_m = eye.x_m + share * (target.x_m - eye.x_m);
  const double z_m = eye.z_m + share * (target.z_m - eye.z_m);
  const auto& top = occluder.top();
  for (std::size_t i = 0; i + 1 < top.size(); ++i) {
    if (x_m < top[i].x_m - margin_m || x_m > top[i + 1].x_m + margin_m) continue;
    const double along = (x_m - top[i].x_m) / (top[i + 1].x_m - top[i].x_m);
    if (z_m <= top[i].z_m + along * (top[i + 1].z_m - top[i].z_m) + margin_m) return true;
  }
  return false;
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double in(double low, double high) {
    return round_to_lattice(std::uniform_real_distribution<double>(low, high)(random_));
  }
  Position in(const Bounds& box) {
    return {in(box.low.x_m, box.high.x_m), in(box.low.y_m, box.high.y_m),
            in(box.low.z_m, box.high.z_m)};
  }
  Bounds box(double low_y_m, double high_y_m, double size_m) {
    const Position low{in(-20, 120), in(low_y_m, high_y_m), in(-10, 30)};
    return {low, {low.x_m + in(0, size_m), low.y_m + in(0, size_m), low.z_m + in(0, size_m / 2)}};
  }
  UprightOccluder occluder() {
    std::vector<std::pair<double, double>> profile;
    double x_m = in(0, 20);
    for (int i = 0; i < 2 + static_cast<int>(in(0, 8)); ++i, x_m += in(2, 15))
      profile.emplace_back(x_m, in(0, 40));
    return along_x(profile);
  }

 private:
  std::mt19937 random_;
};

TEST(UprightOccluder, ExpressionAlternatesFromHullToPocketToBulge) {
  EXPECT_EQ(along_x({{0, 0}, {10, 5}, {20, 0}}).expression(), "F0 & F1");
  EXPECT_EQ(along_x({{0, 5}, {10, 0}, {20, 5}}).expression(), "F0 | F1");
  // A hull edge, and over a pocket two edges with a bulge between them.
  EXPECT_EQ(along_x({{0, 0}, {5, 10}, {10, 2}, {15, 6}, {20, 2}, {25, 10}}).expression(),
            "F0 & (F1 | (F2 & F3) | F4)");
  EXPECT_EQ(along_x({{0, 5}, {10, 5}, {20, 5}}).expression(), "F0 & F1") << "on one line";
}

TEST(UprightOccluder, ForAnEyeAndAPlaceItIsTheDefinition) {
  Draw draw(1);
  int hidden = 0, not_hidden = 0;
  for (int i = 0; i < 4000; ++i) {
    const UprightOccluder occluder = draw.occluder();
    Position eye = draw.in({{-20, -60, -10}, {120, -1, 40}});
    Position target = draw.in({{-20, 1, -10}, {120, 60, 40}});
    if (i % 2 == 0) std::swap(eye, target);
    const bool is_hidden = occluder.judge({eye, eye}, {target, target}) == FullOcclusion::kHidden;
    ASSERT_EQ(occluder.hides({eye, eye}, std::array{target}), is_hidden) << i;
    if (is_hidden) {
      ASSERT_TRUE(passes_below(occluder, eye, target, 1e-6)) << i;
    } else {
      ASSERT_FALSE(passes_below(occluder, eye, target, -1e-6)) << i;
    }
    ++(is_hidden ? hidden : not_hidden);
  }
  EXPECT_GT(hidden, 500);
  EXPECT_GT(not_hidden, 500);
}

TEST(UprightOccluder, WhatIsHiddenFromABoxIsHiddenFromEveryEyeInIt) {
  Draw draw(2);
  int hidden = 0, never = 0;
  for (int i = 0; i < 20000; ++i) {
    const UprightOccluder occluder = draw.occluder();
    const Bounds eyes = i % 2 == 0 ? draw.box(-60, 0, 15) : draw.box(0, 60, 15);
    const Bounds targets = draw.box(-60, 60, 15);
    const FullOcclusion answer = occluder.judge(eyes, targets);
    hidden += answer == FullOcclusion::kHidden;
    never += answer == FullOcclusion::kNever;
    for (int k = 0; k < 6; ++k) {
      const Position eye = draw.in(eyes), target = draw.in(targets);
      if (answer == FullOcclusion::kHidden) {
        ASSERT_TRUE(passes_below(occluder, eye, target, 1e-6)) << i;
      }
      if (answer == FullOcclusion::kNever) {
        ASSERT_NE(occluder.judge(eyes, {target, target}), FullOcclusion::kHidden) << i;
      }
    }
  }
  EXPECT_GT(hidden, 300);
  EXPECT_GT(never, 300);
}

}  // namespace
}  // namespace scarp
