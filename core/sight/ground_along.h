#pragma once

#include <vector>

#include "core/geodesy/position.h"
#include "core/sight/lattice_algebra.h"

namespace scarp {

/// A place where a line meets the ground's net in plan: on `grid` a segment between neighbouring
/// samples or a sample, on `tin` an edge or a vertex.
struct GroundCrossing {
  Fraction at;            ///< along the line, exact, strictly between its ends
  double ground_z_m = 0;  ///< flattened height of the ground there; rounding only
  bool blocks = false;    ///< ground strictly above the line; exact
  /// Void that may hide ground lies between the crossing before (the line's begin) and this one.
  bool void_before = false;
};

/// The ground under a line, from its begin to its end.
struct GroundAlong {
  std::vector<GroundCrossing> crossings;  ///< over known ground, by rising place
  bool void_at_end = false;               ///< void between the last crossing and the line's end
};

/// A place between a and b; unrounded.
inline Position place_between(const Position& a, const Position& b, double fraction) {
  return {a.x_m + fraction * (b.x_m - a.x_m), a.y_m + fraction * (b.y_m - a.y_m),
          a.z_m + fraction * (b.z_m - a.z_m)};
}

/// The crossing's place on the ground; unrounded.
inline Position on_ground(const Position& a, const Position& b, const GroundCrossing& crossing) {
  Position p = place_between(a, b, to_double(crossing.at));
  p.z_m = crossing.ground_z_m;
  return p;
}

}  // namespace scarp
