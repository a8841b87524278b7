#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace scarp {

/// CGAL geometry over the sample plane, whose coordinates are whole numbers below 2^25: the two
/// predicates that cost time, exact without CGAL's multiprecision. On a grid four points on one
/// circle are the rule, and there CGAL's own filters always fail.
/// Include in one .cc only: compiling CGAL takes ten seconds.
struct PlaneTraits : CGAL::Exact_predicates_inexact_constructions_kernel {
  struct Orientation_2 {
    using result_type = CGAL::Orientation;
    /// Differences are below 2^26, so both products and their difference are exact in double.
    result_type operator()(const Point_2& p, const Point_2& q, const Point_2& r) const {
      return sign((q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x()));
    }
  };

  struct Side_of_oriented_circle_2 {
    using result_type = CGAL::Oriented_side;
    result_type operator()(const Point_2& p, const Point_2& q, const Point_2& r,
                           const Point_2& t) const {
      const double ax = p.x() - t.x(), ay = p.y() - t.y();
      const double bx = q.x() - t.x(), by = q.y() - t.y();
      const double cx = r.x() - t.x(), cy = r.y() - t.y();
      const double a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
      const double a = a2 * (bx * cy - by * cx), b = b2 * (cx * ay - cy * ax),
                   c = c2 * (ax * by - ay * bx);
      const double det = a + b + c;
      // Squares and minors are below 2^53 and exact. Each product rounds once, the sums twice:
      // below 3 * 2^-53 (|a| + |b| + |c|). Where that sum is below 2^53 nothing was rounded at all.
      const double bound = std::abs(a) + std::abs(b) + std::abs(c);
      if (bound < 0x1p53 || std::abs(det) > 0x1p-51 * bound) return sign(det);
      return exact_sign(a2, bx * cy - by * cx, b2, cx * ay - cy * ax, c2, ax * by - ay * bx);
    }

   private:
    /// Each product is below 2^54 * 2^53.
    static CGAL::Sign exact_sign(double a2, double a, double b2, double b, double c2, double c) {
      const auto product = [](double s, double t) {
        return __int128{static_cast<std::int64_t>(s)} * static_cast<std::int64_t>(t);
      };
      const __int128 det = product(a2, a) + product(b2, b) + product(c2, c);
      return det > 0 ? CGAL::POSITIVE : det < 0 ? CGAL::NEGATIVE : CGAL::ZERO;
    }
  };

  Orientation_2 orientation_2_object() const { return {}; }
  Side_of_oriented_circle_2 side_of_oriented_circle_2_object() const { return {}; }

 private:
  static CGAL::Sign sign(double value) {
    return value > 0 ? CGAL::POSITIVE : value < 0 ? CGAL::NEGATIVE : CGAL::ZERO;
  }
};

}  // namespace scarp
