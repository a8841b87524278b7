#pragma once

#include <optional>

#include "core/geodesy/position.h"
#include "core/sight/ground_along.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// The judge of sight lines over the surface `tin`: slow beside what it judges, exact, no
/// tolerance.
///
/// a and b see each other when the open segment between them nowhere runs strictly under the
/// ground; touching is not blocking. Ground is the closed triangles of the TIN and all below
/// them. Either end may be on, above or under ground, over void or outside the data.
enum class Sight {
  kVisible,
  kHidden,   ///< known ground blocks the line, whatever the void may be
  kUnknown,  ///< not blocked by known ground, but void ground might: see line_of_sight
};

/// @return kUnknown for a line that nothing blocks when in plan some place of it over void lies
///         between two places of it over ground, or an end lies over void that ground encloses.
///         So a line that reaches the ground from outside the data is not unknown, nor is one that
///         ends outside; a bay of void that is open to the outside counts as outside.
///
/// Symmetric in a and b. Requires lattice positions.
/// Cost: the bins along the line whose ground reaches up to it; for a line over c bins O(c).
/// Source: own; compared with CGAL's AABB tree and exact arithmetic in tests/judge.
Sight line_of_sight(const TinIndex& index, const Position& a, const Position& b);

/// Whether known ground blocks the line: line_of_sight(...) == kHidden, without the question of
/// void.
bool is_blocked(const TinIndex& index, const Position& a, const Position& b);

/// The same of one edge: whether it, or an end of it, is strictly above the open segment a-b where
/// they cross in plan. Cost: six predicates at most.
bool is_blocked_by(const TinIndex& index, const MeshEdge& edge, const Position& a,
                   const Position& b);

/// line_of_sight of a line that is not blocked. Cost: the bins along the line that have border.
Sight unblocked_sight(const TinIndex& index, const Position& a, const Position& b);

/// What stands in the way: an edge of the mesh strictly above the line where they cross in plan.
struct Blocker {
  /// Place along the line, 0 at a, 1 at b. Relative error below 2^-51.
  double fraction = 0;
  /// The edge; its two vertices are equal where the line passes exactly over a vertex, and kNone
  /// where the line's own end is strictly under ground (fraction 0 or 1).
  VertexIndex from = kNone;
  VertexIndex to = kNone;
};

/// The blocker nearest to a, or nothing where the line is not blocked. Requires lattice positions.
/// Cost: as is_blocked, but always all of the line.
std::optional<Blocker> first_blocker(const TinIndex& index, const Position& a, const Position& b);

/// The ground at every edge and vertex of the mesh under the open segment a-b. A crossing blocks
/// where first_blocker would find it; ends that are themselves strictly under ground are not among
/// them. An edge that runs along the segment in plan counts by its vertices.
/// Void is what could hide ground: enclosed by ground, or between two places of it on the line.
/// Requires lattice positions at different places in plan.
/// Cost: all bins along the line, O(c log c) for c crossings.
GroundAlong ground_along(const TinIndex& index, const Position& a, const Position& b);

}  // namespace scarp
