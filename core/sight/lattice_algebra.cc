#include "core/sight/lattice_algebra.h"

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>

namespace scarp {

int compare(const Fraction& a, const Fraction& b) {
  const double left = static_cast<double>(a.before) * static_cast<double>(b.after);
  const double right = static_cast<double>(b.before) * static_cast<double>(a.after);
  // Each conversion and the product round once: the error is below (3u + ...) of each product,
  // u = 2^-53; 8u on both leaves room for the bound itself. Products stay below 2^248.
  if (std::abs(left - right) > 0x1p-50 * (left + right)) return left < right ? -1 : 1;
  using Exact = boost::multiprecision::int256_t;
  const Exact difference = Exact(a.before) * Exact(b.after) - Exact(b.before) * Exact(a.after);
  return difference.sign();
}

Fraction crossing_in_plan(const Position& a, const Position& b, const Position& u,
                          const Position& v) {
  const LatticeVector along = vector_from(u, v);
  const Int128 before = cross_in_plan(along, vector_from(u, a));
  const Int128 after = cross_in_plan(along, vector_from(u, b));
  return {before < 0 ? -before : before, after < 0 ? -after : after};
}

Fraction place_in_plan(const Position& a, const Position& b, const Position& p) {
  const bool along_x = a.x_m != b.x_m;
  const LatticeVector from_a = vector_from(a, p), to_b = vector_from(p, b);
  const Int128 before = along_x ? from_a.x : from_a.y, after = along_x ? to_b.x : to_b.y;
  return {before < 0 ? -before : before, after < 0 ? -after : after};
}

double to_double(const Fraction& f) {
  return static_cast<double>(f.before) /
         (static_cast<double>(f.before) + static_cast<double>(f.after));
}

}  // namespace scarp
