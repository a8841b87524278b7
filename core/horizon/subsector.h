#pragma once

#include <cstdint>

#include "core/geodesy/position.h"
#include "core/horizon/sectors.h"

namespace scarp {

/// Step that projections on a direction are rounded to. Finer than kLatticeStepM, so that rounding
/// merges only what is closer than positions can be told apart; coarse enough that points of a
/// regular grid on one line along a boundary project to the same number although its direction
/// is rounded, and that a slope comparison fits 128 bits.
inline constexpr double kProjectionStepM = 0x1p-16;

/// A vertex as one subsector sees it, in steps of kProjectionStepM; |value| < 2^44.
struct Projection {
  std::int64_t left_of_a;  ///< distance to the left of the line along boundary a, from the origin
  std::int64_t left_of_b;  ///< the same for boundary b
  std::int64_t u;          ///< distance along the middle direction
};

/// One of the count * subsectors equal parts of the circle: part k of sector k / subsectors.
class Subsector {
 public:
  Subsector(const SectorLayout& layout, std::int32_t part);

  Projection project(const Position& p) const;

  /// The u of `project` alone.
  std::int64_t project_u(const Position& p) const;

 private:
  SectorAxis a_, b_, middle_;
};

/// Whether q lies in the subsector of p. Not p itself: u must grow. Without branches, since each
/// comparison alone is as good as random.
inline bool in_subsector(const Projection& p, const Projection& q) {
  return (q.left_of_a >= p.left_of_a) & (q.left_of_b <= p.left_of_b) & (q.u > p.u);
}

/// Slope from one vertex to another in a subsector's plane, as the two differences it is made of.
struct Slope {
  std::int64_t rise;  ///< lattice steps, |rise| <= 2^40
  std::int64_t run;   ///< projection steps, 0 < run < 2^45
};

/// Sign of slope x minus slope y. Exact: the products have fewer than 86 bits.
inline int compare_slopes(const Slope& x, const Slope& y) {
  const __int128 left = static_cast<__int128>(x.rise) * y.run;
  const __int128 right = static_cast<__int128>(y.rise) * x.run;
  return (left > right) - (left < right);
}

}  // namespace scarp
