#include "core/occlusion/circle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/geodesy/predicates.h"
#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// Relative allowance for the rounding of a distance: a difference, two squares, a sum, a root.
constexpr double kDistanceRounding = 0x1p-50;

double distance_m(const Circle& circle, const Position& p) {
  const double dx_m = p.x_m - circle.x_m, dy_m = p.y_m - circle.y_m;
  return std::sqrt(dx_m * dx_m + dy_m * dy_m);
}

bool holds(const Circle& circle, const Position& p) {
  return distance_m(circle, p) <= circle.radius_m * (1 + kDistanceRounding);
}

Circle through(const Position& a, const Position& b) {
  Circle circle{a.x_m + (b.x_m - a.x_m) / 2, a.y_m + (b.y_m - a.y_m) / 2, 0};
  circle.radius_m = std::max(distance_m(circle, a), distance_m(circle, b));
  return circle;
}

/// Circle through three positions; that of the two farthest where they lie on a line.
Circle through(const Position& a, const Position& b, const Position& c) {
  const double bx = b.x_m - a.x_m, by = b.y_m - a.y_m;
  const double cx = c.x_m - a.x_m, cy = c.y_m - a.y_m;
  const double twice_area = 2 * (bx * cy - by * cx);
  if (orient2d(a, b, c) == 0 || twice_area == 0) {
    const Circle pairs[] = {through(a, b), through(b, c), through(a, c)};
    return *std::max_element(
        pairs, pairs + 3, [](const Circle& p, const Circle& q) { return p.radius_m < q.radius_m; });
  }
  const double bb = bx * bx + by * by, cc = cx * cx + cy * cy;
  Circle circle{a.x_m + (cy * bb - by * cc) / twice_area, a.y_m + (bx * cc - cx * bb) / twice_area,
                0};
  circle.radius_m = std::max({distance_m(circle, a), distance_m(circle, b), distance_m(circle, c)});
  return circle;
}

/// Smallest circle of the positions that passes through q and p.
Circle with_two(std::span<const Position> positions, const Position& q, const Position& p) {
  Circle circle = through(q, p);
  for (const Position& r : positions)
    if (!holds(circle, r)) circle = through(r, q, p);
  return circle;
}

/// Smallest circle of the positions that passes through p.
Circle with_one(std::span<const Position> positions, const Position& p) {
  Circle circle{p.x_m, p.y_m, 0};
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!holds(circle, positions[i])) circle = with_two(positions.first(i), positions[i], p);
  return circle;
}

}  // namespace

std::vector<Position> convex_hull(std::vector<Position> positions) {
  std::sort(positions.begin(), positions.end(), [](const Position& a, const Position& b) {
    return std::pair(a.x_m, a.y_m) < std::pair(b.x_m, b.y_m);
  });
  positions.erase(std::unique(positions.begin(), positions.end(),
                              [](const Position& a, const Position& b) {
                                return a.x_m == b.x_m && a.y_m == b.y_m;
                              }),
                  positions.end());
  if (positions.size() < 3) return positions;
  std::vector<Position> hull;
  const auto add = [&](const Position& p, std::size_t fixed) {
    while (hull.size() > fixed && orient2d(hull[hull.size() - 2], hull.back(), p) <= 0)
      hull.pop_back();
    hull.push_back(p);
  };
  for (const Position& p : positions) add(p, 1);
  const std::size_t lower = hull.size();
  for (auto p = positions.rbegin() + 1; p != positions.rend(); ++p) add(*p, lower);
  hull.pop_back();
  return hull;
}

Circle enclosing_circle(std::span<const Position> positions) {
  assert(!positions.empty());
  std::vector<Position> order(positions.begin(), positions.end());
  SplitMix64 random(order.size());
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  Circle circle{order[0].x_m, order[0].y_m, 0};
  for (std::size_t i = 1; i < order.size(); ++i)
    if (!holds(circle, order[i])) circle = with_one(std::span(order).first(i), order[i]);
  // Whatever rounding did to the centre, this radius holds them all.
  circle.radius_m = 0;
  for (const Position& p : order)
    circle.radius_m = std::max(circle.radius_m, distance_m(circle, p));
  circle.radius_m *= 1 + kDistanceRounding;
  return circle;
}

}  // namespace scarp
