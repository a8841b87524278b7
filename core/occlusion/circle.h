#pragma once

#include <span>
#include <vector>

#include "core/geodesy/position.h"

namespace scarp {

/// A circle in the plane, metres.
struct Circle {
  double x_m = 0;
  double y_m = 0;
  double radius_m = 0;
};

/// Corners of the convex hull in the plane, counter-clockwise from the leftmost (lowest of those);
/// none on a straight side. Exact. Cost: O(n log n).
std::vector<Position> convex_hull(std::vector<Position> positions);

/// The smallest circle that holds all positions, but for rounding, which goes outwards: every
/// distance from its centre, as sqrt(dx^2 + dy^2) in double, is at most the radius, and so is the
/// exact one. Requires at least one position, no more than a hull's corners for the cost to hold.
/// Cost: O(n) expected, in an order that is always the same. Source: Welzl 1991.
Circle enclosing_circle(std::span<const Position> positions);

}  // namespace scarp
