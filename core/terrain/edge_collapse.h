#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// A vertex that was drawn along an edge onto a neighbour: the triangles around it went, and a fan
/// around the neighbour took their place. Vertices do not move.
struct Collapse {
  VertexIndex removed;
  VertexIndex kept;
  TriangleIndex first_triangle;  ///< of those it made; the next collapse's is the first after them
  /// How far those may lie above and below the surface that all began with, vertical metres.
  /// Bounds, added up from collapse to collapse.
  double above_m;
  double below_m;
};

/// A simplification with all its steps. Each step makes a whole surface out of a whole surface, so
/// any set of collapses that holds all that its members rest on does too: the triangles that a
/// member removed were there from the start, or were made by a member.
struct CollapseHistory {
  /// The original's in their order, then those of each collapse.
  std::vector<std::array<VertexIndex, 3>> triangles;
  std::vector<std::uint32_t> removed_by;  ///< [triangles] a collapse, kNone where it is left
  std::vector<Collapse> collapses;
  TriangleIndex original_triangles = 0;

  TriangleIndex end_of(std::size_t collapse) const {
    return collapse + 1 < collapses.size() ? collapses[collapse + 1].first_triangle
                                           : static_cast<TriangleIndex>(triangles.size());
  }
};

/// What is collapsed first.
enum class CollapseCost {
  kError,   ///< what moves the surface least, up or down
  kVolume,  ///< what takes least from the solid under the surface
};

struct CollapseOptions {
  CollapseCost cost = CollapseCost::kError;
  double most_above_m = HUGE_VAL;  ///< no triangle's above_m gets greater
  double most_below_m = HUGE_VAL;
  /// Whether a corner of the border may be cut off. Ground is never added to void.
  bool may_shrink = false;
  std::size_t triangles_left = 0;  ///< ends where there are no more than this
};

/// Simplifies a height field by half-edge collapses, cheapest first.
///
/// Every surface on the way is one that check_tin accepts (exact orientation), but for vertices
/// without triangles. Border vertices go only where the border stays where it is, or may_shrink.
/// Accuracy: above_m and below_m are rounded up by kGapRoundingM a step.
/// Requires a valid TIN. One thread. Cost: about 15 us a vertex.
/// Source: edge collapses after Hoppe 1996 and Garland and Heckbert 1997, with measured vertical
///   gaps in place of quadrics.
CollapseHistory collapse_edges(const Tin& tin, const CollapseOptions& options);

/// The surface after all collapses; vertices that are left, in their order.
/// @param vertex_of  if not null: [vertices of the result] as numbered in tin
Tin simplified(const Tin& tin, const CollapseHistory& history,
               std::vector<std::int64_t>* vertex_of = nullptr);

}  // namespace scarp
