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

double to_double(const Fraction& f) {
  return static_cast<double>(f.before) /
         (static_cast<double>(f.before) + static_cast<double>(f.after));
}

}  // namespace scarp
