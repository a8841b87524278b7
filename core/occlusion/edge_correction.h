#pragma once

#include <array>
#include <vector>

#include "core/occlusion/upright_occluder.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// A triangle of a simplified surface as an occluder whose edges were shifted one by one. They need
/// not meet any more, nor lie in one plane.
struct CorrectedTriangle {
  std::array<Position, 3> corners;               ///< before correction
  std::array<std::array<Position, 2>, 3> edges;  ///< from corner to next corner; not on the lattice
};

/// Edge error correction: each edge of a simplified surface is shifted against its normal, the mean
/// of those of the triangles beside it, by as much as it stands out of the surface in the upright
/// or leaning plane through itself and its normal.
///
/// Side: none. The correction keeps silhouettes within those of the surface. A triangle whose edges
/// are right may still lie over a hollow of the surface, and hide what is in it from those who look
/// into it (edge_correction_test.cc); simplified_under is what to use. Kept to be measured.
/// Requires a simplified surface whose vertices are vertices of the surface, with its neighbours.
/// Accuracy: double. Cost: O(edges of the surface beside each edge).
/// Source: Law and Tan 1999, 4.3.
///
/// @param reach_m  no edge is off by more than this
std::vector<CorrectedTriangle> correct_edges(const Tin& simplified, const TinIndex& surface,
                                             double reach_m);

/// Whether supporting planes of the shifted edges say that a triangle hides all targets from an eye
/// above it. Targets have to lie behind the triangle's plane.
bool claims_to_hide(const CorrectedTriangle& occluder, const Position& eye, const Bounds& targets);

}  // namespace scarp
