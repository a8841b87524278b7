#pragma once

#include <cstdint>

#include "core/geodesy/position.h"

namespace scarp {

/// Areas and volumes over the lattice, exact: coordinates differ by at most 2^40 steps, so an area
/// is below 2^82 and a volume below 2^123. One 64-bit multiplication costs no more than its
/// floating-point twin with an error bound, so nothing here is filtered but compare().
using Int128 = __int128;

/// Difference of two lattice positions, in steps.
struct LatticeVector {
  std::int64_t x;
  std::int64_t y;
  std::int64_t z;

  friend LatticeVector operator-(const LatticeVector& a, const LatticeVector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
};

inline LatticeVector vector_from(const Position& from, const Position& to) {
  return {lattice_steps(to.x_m) - lattice_steps(from.x_m),
          lattice_steps(to.y_m) - lattice_steps(from.y_m),
          lattice_steps(to.z_m) - lattice_steps(from.z_m)};
}

/// Positive where b lies counter-clockwise of a, seen from above; square steps.
inline Int128 cross_in_plan(const LatticeVector& a, const LatticeVector& b) {
  return Int128{a.x} * b.y - Int128{a.y} * b.x;
}

/// Positive where w lies above the plane through the origin, a and b, for b counter-clockwise of
/// a; cubic steps.
inline Int128 volume(const LatticeVector& a, const LatticeVector& b, const LatticeVector& w) {
  return (Int128{a.y} * b.z - Int128{a.z} * b.y) * w.x +
         (Int128{a.z} * b.x - Int128{a.x} * b.z) * w.y + cross_in_plan(a, b) * w.z;
}

/// A place between two ends, as exact weights: it lies at before / (before + after) of the way.
/// Both weights are at least zero and one is positive.
struct Fraction {
  Int128 before;
  Int128 after;
};

inline constexpr Fraction kFirstEnd{0, 1};
inline constexpr Fraction kLastEnd{1, 0};

/// -1, 0 or +1: a lies before, at or behind b. Exact.
int compare(const Fraction& a, const Fraction& b);

/// Where along a -> b, which crosses the line through u and v in plan, it does so. Exact.
/// Requires that a and b lie on different sides of that line, or one of them on it.
Fraction crossing_in_plan(const Position& a, const Position& b, const Position& u,
                          const Position& v);

/// Where along a -> b a place p lies that is known to lie on it in plan. Exact.
Fraction place_in_plan(const Position& a, const Position& b, const Position& p);

/// The fraction in double; relative error below 2^-51.
double to_double(const Fraction& f);

}  // namespace scarp
