#include "core/occlusion/circle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

std::vector<Position> random_positions(std::mt19937_64& random, double far_m, double size_m,
                                       std::size_t count) {
  std::uniform_real_distribution<double> place(-size_m, size_m);
  std::vector<Position> positions;
  for (std::size_t i = 0; i < count; ++i)
    positions.push_back(round_to_lattice({far_m + place(random), place(random) - far_m, 0}));
  return positions;
}

TEST(ConvexHull, HoldsAllAndTurnsLeft) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 300; ++round) {
    const auto all = random_positions(random, 1e6, round % 2 == 0 ? 0.002 : 50, 1 + random() % 40);
    const auto hull = convex_hull(all);
    ASSERT_FALSE(hull.empty());
    for (std::size_t i = 0; hull.size() > 2 && i < hull.size(); ++i) {
      const Position &a = hull[i], &b = hull[(i + 1) % hull.size()];
      ASSERT_GT(orient2d(a, b, hull[(i + 2) % hull.size()]), 0);
      for (const Position& p : all) ASSERT_GE(orient2d(a, b, p), 0);
    }
  }
}

TEST(ConvexHull, OfALineIsItsEnds) {
  EXPECT_EQ(convex_hull({{1, 1, 0}, {3, 3, 0}, {2, 2, 0}, {0, 0, 0}}).size(), 2U);
  EXPECT_EQ(convex_hull({{1, 1, 0}, {1, 1, 5}}).size(), 1U);
}

/// Smallest by trying all pairs and triples.
double smallest_radius_m(const std::vector<Position>& all) {
  double best_m = HUGE_VAL;
  const auto offer = [&](double x_m, double y_m) {
    double radius_m = 0;
    for (const Position& p : all)
      radius_m = std::max(radius_m, std::hypot(p.x_m - x_m, p.y_m - y_m));
    best_m = std::min(best_m, radius_m);
  };
  for (const Position& a : all)
    for (const Position& b : all) {
      offer((a.x_m + b.x_m) / 2, (a.y_m + b.y_m) / 2);
      for (const Position& c : all) {
        if (orient2d(a, b, c) <= 0) continue;
        const double bx = b.x_m - a.x_m, by = b.y_m - a.y_m, cx = c.x_m - a.x_m, cy = c.y_m - a.y_m;
        const double d = 2 * (bx * cy - by * cx);
        offer(a.x_m + (cy * (bx * bx + by * by) - by * (cx * cx + cy * cy)) / d,
              a.y_m + (bx * (cx * cx + cy * cy) - cx * (bx * bx + by * by)) / d);
      }
    }
  return best_m;
}

TEST(EnclosingCircle, HoldsAllAndIsTheSmallest) {
  std::mt19937_64 random(6);
  for (int round = 0; round < 150; ++round) {
    const auto all = random_positions(random, round % 2 == 0 ? 0 : 1e7, 100, 1 + random() % 12);
    const Circle circle = enclosing_circle(all);
    for (const Position& p : all)
      ASSERT_LE(std::hypotl(static_cast<long double>(p.x_m) - circle.x_m,
                            static_cast<long double>(p.y_m) - circle.y_m),
                circle.radius_m);
    ASSERT_NEAR(circle.radius_m, smallest_radius_m(all), 1e-6);
  }
}

TEST(EnclosingCircle, OfOnePlaceAndOfALine) {
  EXPECT_EQ(enclosing_circle(std::vector<Position>{{3, 4, 5}}).radius_m, 0);
  const Circle line = enclosing_circle(std::vector<Position>{{0, 0, 0}, {6, 8, 0}, {3, 4, 0}});
  EXPECT_NEAR(line.radius_m, 5, 1e-9);
  EXPECT_GE(line.radius_m, 5);
}

}  // namespace
}  // namespace scarp
