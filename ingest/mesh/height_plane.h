#pragma once

#include <cmath>

#include "core/geodesy/position.h"

namespace scarp {

/// A plane over the flattened x, y through three positions.
struct HeightPlane {
  double x_m, y_m, z_m, slope_x, slope_y;

  HeightPlane(const Position& a, const Position& b, const Position& c)
      : x_m(a.x_m), y_m(a.y_m), z_m(a.z_m) {
    const double bx = b.x_m - a.x_m, by = b.y_m - a.y_m, bz = b.z_m - a.z_m;
    const double cx = c.x_m - a.x_m, cy = c.y_m - a.y_m, cz = c.z_m - a.z_m;
    const double inverse = 1 / (bx * cy - by * cx);
    slope_x = (bz * cy - by * cz) * inverse;
    slope_y = (bx * cz - bz * cx) * inverse;
  }
  double error_m(const Position& p) const {
    return std::abs((p.z_m - z_m) - slope_x * (p.x_m - x_m) - slope_y * (p.y_m - y_m));
  }
};

/// Vertical distance of the segments a - b and p - q where they cross in the plane.
inline double crossing_error_m(const Position& a, const Position& b, const Position& p,
                               const Position& q) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  const double side_p = dx * (p.y_m - a.y_m) - dy * (p.x_m - a.x_m);
  const double side_q = dx * (q.y_m - a.y_m) - dy * (q.x_m - a.x_m);
  const double along_pq = side_p / (side_p - side_q);
  const bool by_x = std::abs(dx) >= std::abs(dy);
  const double reached = by_x ? p.x_m + along_pq * (q.x_m - p.x_m) - a.x_m
                              : p.y_m + along_pq * (q.y_m - p.y_m) - a.y_m;
  const double along_ab = reached / (by_x ? dx : dy);
  return std::abs((p.z_m - a.z_m) + along_pq * (q.z_m - p.z_m) - along_ab * (b.z_m - a.z_m));
}

}  // namespace scarp
