#pragma once

#include <span>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Corners of a closed ring in order, the first not repeated. The ring does not touch itself.
using VertexRing = std::vector<VertexIndex>;

/// The outer ring, counter-clockwise, then the holes, clockwise. Rings of one polygon touch each
/// other in single points at most: valid as a polygon of OGC simple features.
using VertexPolygon = std::vector<VertexRing>;

/// Where the triangles of a group lie: one polygon for each part whose triangles hang together by
/// edges. Parts touch each other in points at most.
struct GroupOutline {
  GroupIndex group = kNone;
  std::vector<VertexPolygon> polygons;
};

/// Traces the border of every group's triangles.
///
/// @param tin                check_tin finds nothing
/// @param group_of_triangle  [triangles], kNone for triangles of no group
/// @return groups that have a triangle, by rising index; polygons by their first triangle
///
/// Every border edge of a group is in exactly one ring, as it is, so that neighbours share their
/// edges corner by corner. Decisions are exact. Errors: none.
/// Cost: O(n log n), n triangles.
std::vector<GroupOutline> trace_groups(const Tin& tin,
                                       std::span<const GroupIndex> group_of_triangle);

/// Twice the signed area of a ring, in squares of kLatticeStepM; exact, positive where
/// counter-clockwise.
///
/// Requires fewer than 2^47 corners: the sum then stays within 128 bits.
__extension__ using WideArea = __int128;
WideArea doubled_area(const Tin& tin, const VertexRing& ring);

}  // namespace scarp
