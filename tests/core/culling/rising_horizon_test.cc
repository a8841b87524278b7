#include "core/culling/rising_horizon.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/grouped_ground.h"

namespace scarp {
namespace {

using Triangle = std::array<Position, 3>;

constexpr ViewRange kEast{-0.6, 0.6};

/// Counter-clockwise from above.
Triangle turned(Triangle t) {
  const double area =
      (t[1].x_m - t[0].x_m) * (t[2].y_m - t[0].y_m) - (t[1].y_m - t[0].y_m) * (t[2].x_m - t[0].x_m);
  if (area < 0) std::swap(t[1], t[2]);
  return t;
}

std::array<AheadPoint, 3> placed(const RisingHorizon& horizon, const Triangle& t) {
  return {horizon.place(t[0]), horizon.place(t[1]), horizon.place(t[2])};
}

/// A roof across the view: its ridge stands at x_m and is top_m high.
Triangle roof(double x_m, double top_m) {
  return turned({{{x_m - 10, 0, -300}, {x_m, -3 * x_m, top_m}, {x_m, 3 * x_m, top_m}}});
}

Triangle target(double x_m, double y_m, double top_m) {
  return turned({{{x_m, y_m, top_m - 3}, {x_m + 4, y_m - 2, top_m}, {x_m + 4, y_m + 2, top_m}}});
}

TEST(RisingHorizon, HidesWhatIsLowerAndFartherAndNothingElse) {
  RisingHorizon horizon;
  ASSERT_TRUE(horizon.begin({0, 0, 0}, kEast));
  const auto hides = [&](const Triangle& t) { return horizon.hides(placed(horizon, t)); };
  EXPECT_FALSE(hides(target(200, 10, 15)));
  horizon.add(placed(horizon, roof(100, 10)));  // hides up to 20 at 200
  EXPECT_TRUE(hides(target(200, 10, 15)));
  EXPECT_TRUE(horizon.hides(Bounds{{200, -30, 0}, {230, 30, 15}}));
  EXPECT_FALSE(hides(target(200, 10, 25))) << "higher";
  EXPECT_FALSE(horizon.hides(Bounds{{200, -30, 0}, {230, 30, 25}}));
  EXPECT_FALSE(hides(target(50, 10, 2))) << "nearer";
  EXPECT_FALSE(horizon.hides(Bounds{{50, -3, 0}, {53, 3, 2}}));
  EXPECT_FALSE(horizon.hides(Bounds{{-50, -3, 0}, {300, 3, 2}})) << "around the eye";
}

TEST(RisingHorizon, WhatLiesBesideTheViewOrFacesAwayIsNotSeen) {
  RisingHorizon horizon;
  ASSERT_TRUE(horizon.begin({0, 0, 0}, kEast));
  const auto hides = [&](const Triangle& t) { return horizon.hides(placed(horizon, t)); };
  EXPECT_TRUE(hides(target(-50, 0, 2))) << "behind the eye";
  EXPECT_TRUE(hides(target(50, 100, 2)));
  EXPECT_TRUE(hides(target(50, -100, 2)));
  EXPECT_FALSE(hides(turned({{{20, -200, 1}, {24, -200, 3}, {22, 200, 3}}}))) << "right across it";
  // Its upper side falls away steeper than the eye looks down.
  EXPECT_TRUE(hides(turned({{{100, -10, 9}, {100, 10, 9}, {120, 0, 1}}})));
  EXPECT_FALSE(hides(turned({{{100, -10, 1}, {100, 10, 1}, {120, 0, 9}}})));
}

TEST(RisingHorizon, RefusesViewsThatAreTooWide) {
  RisingHorizon horizon;
  EXPECT_FALSE(horizon.begin({0, 0, 0}, {0, 3}));
  EXPECT_FALSE(horizon.begin({0, 0, 0}, {3, 2}));
  EXPECT_TRUE(horizon.begin({0, 0, 0}, {3, 3}));
  EXPECT_TRUE(horizon.begin({0, 0, 0}, {6.2, 0.2}));  // across the end of the circle
  EXPECT_FALSE(horizon.hides(
      horizon.place({100, 0, 0}).ahead_m > 0 ? Bounds{{100, -1, -1}, {101, 1, 1}} : Bounds{}));
}

/// Whether a triangle lies above a sight line before its end: by clipping the line's plan.
bool blocks(const Triangle& t, const Position& eye, const Position& end) {
  long double low = 0, high = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const Position &a = t[i], &b = t[(i + 1) % 3];
    const auto side = [&](const Position& p) -> long double {
      return (static_cast<long double>(b.x_m) - a.x_m) * (p.y_m - a.y_m) -
             (static_cast<long double>(b.y_m) - a.y_m) * (p.x_m - a.x_m);
    };
    const long double from = side(eye), to = side(end);
    if (from < 0 && to < 0) return false;
    if (from == to) continue;
    const long double at = from / (from - to);
    (from < to ? low : high) = from < to ? std::max(low, at) : std::min(high, at);
  }
  if (low > high) return false;
  // Heights over the plane are linear along the line: one of the ends is highest.
  for (const long double share : {low, high}) {
    const long double x = eye.x_m + share * (end.x_m - eye.x_m);
    const long double y = eye.y_m + share * (end.y_m - eye.y_m);
    const long double z = eye.z_m + share * (end.z_m - eye.z_m);
    const long double ux = t[1].x_m - t[0].x_m, uy = t[1].y_m - t[0].y_m;
    const long double vx = t[2].x_m - t[0].x_m, vy = t[2].y_m - t[0].y_m;
    const long double area = ux * vy - uy * vx;
    const long double p = ((x - t[0].x_m) * vy - (y - t[0].y_m) * vx) / area;
    const long double q = (ux * (y - t[0].y_m) - uy * (x - t[0].x_m)) / area;
    const long double ground = t[0].z_m + p * (t[1].z_m - t[0].z_m) + q * (t[2].z_m - t[0].z_m);
    if (ground > z) return true;
  }
  return false;
}

TEST(RisingHorizon, EveryPointOfWhatItHidesIsBehindOneOfTheTrianglesAdded) {
  std::mt19937_64 random(7);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto triangle_at = [&](double x_m, double y_m, double size_m, double z_m) {
    Triangle t;
    for (Position& p : t)
      p = round_to_lattice({x_m + between(-size_m, size_m), y_m + between(-size_m, size_m),
                            z_m + between(-size_m, size_m)});
    return turned(t);
  };
  std::size_t hidden = 0, asked = 0, boxes = 0;
  for (int scene = 0; scene < 60; ++scene) {
    const Position eye = round_to_lattice({between(-9, 9), between(-9, 9), between(-9, 9)});
    const double turn_rad = between(-4, 4), width_rad = between(0.01, 2.5);
    RisingHorizon horizon;
    ASSERT_TRUE(horizon.begin(eye, {turn_rad, turn_rad + width_rad}));
    const auto somewhere = [&](double reach_m) {
      const double away_m = between(0, reach_m);
      const double at_rad = turn_rad + between(-0.2, width_rad + 0.2);
      return std::array{eye.x_m + away_m * std::cos(at_rad), eye.y_m + away_m * std::sin(at_rad)};
    };
    std::vector<Triangle> added;
    for (int i = 0; i < 40; ++i) {
      const auto [x_m, y_m] = somewhere(300);
      added.push_back(triangle_at(x_m, y_m, 60, between(-20, 30)));
      horizon.add(placed(horizon, added.back()));
    }
    const auto expect_hidden = [&](const Position& p) {
      const double at_rad = std::atan2(p.y_m - eye.y_m, p.x_m - eye.x_m);
      const double off_rad = std::remainder(at_rad - turn_rad - width_rad / 2, 2 * M_PI);
      if (std::abs(off_rad) > width_rad / 2) return;
      ++asked;
      EXPECT_TRUE(std::any_of(added.begin(), added.end(),
                              [&](const Triangle& t) { return blocks(t, eye, p); }))
          << "scene " << scene;
    };
    for (int i = 0; i < 200; ++i) {
      const auto [x_m, y_m] = somewhere(600);
      const Triangle t = triangle_at(x_m, y_m, i % 2 == 0 ? 5 : 40, between(-60, 10));
      const auto at = placed(horizon, t);
      // Of what faces away only the upper side is hidden.
      const double nx = (t[1].y_m - t[0].y_m) * (t[2].z_m - t[0].z_m) -
                        (t[1].z_m - t[0].z_m) * (t[2].y_m - t[0].y_m);
      const double ny = (t[1].z_m - t[0].z_m) * (t[2].x_m - t[0].x_m) -
                        (t[1].x_m - t[0].x_m) * (t[2].z_m - t[0].z_m);
      const double nz = (t[1].x_m - t[0].x_m) * (t[2].y_m - t[0].y_m) -
                        (t[1].y_m - t[0].y_m) * (t[2].x_m - t[0].x_m);
      const bool faces =
          nx * (eye.x_m - t[0].x_m) + ny * (eye.y_m - t[0].y_m) + nz * (eye.z_m - t[0].z_m) > 0;
      if (faces && horizon.hides(at)) {
        ++hidden;
        for (int k = 0; k < 30; ++k) {
          double a = between(0, 1), b = between(0, 1);
          if (a + b > 1) a = 1 - a, b = 1 - b;
          if (k < 3) a = k == 1, b = k == 2;
          Position p;
          for (double Position::*c : {&Position::x_m, &Position::y_m, &Position::z_m})
            p.*c = t[0].*c + a * (t[1].*c - t[0].*c) + b * (t[2].*c - t[0].*c);
          expect_hidden(p);
        }
      }
      const Bounds box{{x_m, y_m, -40}, {x_m + 9, y_m + 9, between(-40, 10)}};
      if (!horizon.hides(box)) continue;
      ++boxes;
      for (int k = 0; k < 8; ++k)
        expect_hidden({(k & 1) != 0 ? box.low.x_m : box.high.x_m,
                       (k & 2) != 0 ? box.low.y_m : box.high.y_m, box.high.z_m});
    }
  }
  EXPECT_GT(hidden, 500U);
  EXPECT_GT(boxes, 100U);
  EXPECT_GT(asked, 10'000U);
}

/// A group's triangles one after the other.
bool shows_plainly(RisingHorizon& horizon, const GroupBatches& batches, GroupIndex group,
                   bool adds) {
  std::vector<std::array<AheadPoint, 3>> triangles;
  const auto vertices = batches.vertices(group);
  for (const auto& t : batches.corners(group))
    triangles.push_back({horizon.place(vertices[t[0]]), horizon.place(vertices[t[1]]),
                         horizon.place(vertices[t[2]])});
  const bool shown = !std::all_of(triangles.begin(), triangles.end(),
                                  [&](const auto& t) { return horizon.hides(t); });
  if (shown && adds)
    for (const auto& t : triangles) horizon.add(t);
  return shown;
}

TEST(RisingHorizon, ShowsTheSameWithEveryInstructionSetAsOneTriangleAfterTheOther) {
  std::size_t shown = 0, hidden = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    std::mt19937_64 random(11);
    const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const auto ground = test::grouped_hills(seed);
      const GroupBatches batches(ground.tin, ground.groups);
      const HorizonTriangles triangles(batches);
      const Bounds all = bounds_of(ground.tin.vertices);
      for (int i = 0; i < 6; ++i) {
        // Under ground too: nothing is promised there, but the same.
        const Position eye{all.low.x_m + unit() * (all.high.x_m - all.low.x_m),
                           all.low.y_m + unit() * (all.high.y_m - all.low.y_m),
                           all.low.z_m + (0.2 + unit()) * (all.high.z_m - all.low.z_m)};
        const double turn_rad = 6 * unit();
        const ViewRange view{turn_rad, turn_rad + 0.1 + 2.4 * unit()};
        RisingHorizon fast, plain;
        ASSERT_TRUE(fast.begin(eye, view) && plain.begin(eye, view));
        std::vector<std::pair<double, GroupIndex>> order;
        for (GroupIndex g = 0; g < batches.groups(); ++g)
          order.emplace_back(plain.nearest_m(batches.box(g)), g);
        std::sort(order.begin(), order.end());
        for (const auto& [nearest_m, g] : order) {
          const bool adds = g % 5 != 0;
          const bool is_shown = fast.shows(triangles.of(g), adds);
          ASSERT_EQ(is_shown, shows_plainly(plain, batches, g, adds))
              << hwy::TargetName(target) << ", seed " << seed << ", group " << g;
          (is_shown ? shown : hidden) += 1;
          for (std::size_t b = 0; b < HorizonBins::kBins; ++b) {
            ASSERT_EQ(fast.bins().up[b], plain.bins().up[b]) << hwy::TargetName(target);
            ASSERT_EQ(fast.bins().farthest_m[b], plain.bins().farthest_m[b]);
          }
        }
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  EXPECT_GT(shown, 300U);
  EXPECT_GT(hidden, 300U);
}

TEST(RisingHorizon, ShowsWhatIsTooWideToBeLaidOut) {
  Tin tin;
  tin.vertices = {{0, -4e5, 0}, {4e5, -4e5, 0}, {0, 4e5, 0}};
  tin.triangles = {{0, 1, 2}};
  Groups groups;
  groups.leaf_count = 1;
  groups.group_of_triangle = {0};
  const GroupBatches batches(tin, groups);
  const HorizonTriangles triangles(batches);
  RisingHorizon horizon;
  ASSERT_TRUE(horizon.begin({5e5, 0, 0}, kEast));
  EXPECT_TRUE(horizon.shows(triangles.of(0), true)) << "behind the eye, but nobody knows";
}

}  // namespace
}  // namespace scarp
