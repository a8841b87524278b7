#pragma once

#include "core/geodesy/position.h"

namespace scarp {

/// Exact signs over lattice positions. Each is decided in double where the rounding error is
/// provably smaller than the result, and otherwise in 128-bit integers; both ways give the sign
/// of the real number. Requires lattice positions within kLatticeReachM.
/// Source: static filters after Shewchuk 1997, bounds derived in predicates.cc.

/// Side of c against the directed line a -> b in the plane (z is ignored).
/// @return +1 left, 0 on the line, -1 right
int orient2d(const Position& a, const Position& b, const Position& c);

/// Side of d against the plane through a, b, c.
/// @return +1 where d lies above the plane of a triangle a, b, c that is counter-clockwise seen
///         from above (and the reverse for a clockwise one), 0 on the plane
int orient3d(const Position& a, const Position& b, const Position& c, const Position& d);

/// Height of p against the line a -> b, for p whose (x, y) lies on the line through a and b.
/// @return +1 p above the line, 0 on it, -1 below. Requires orient2d(a, b, p) == 0, a.xy != b.xy
int above_line(const Position& a, const Position& b, const Position& p);

/// How many decisions since the program began needed the exact path; tests assert that it ran.
unsigned long exact_predicate_count();

}  // namespace scarp
