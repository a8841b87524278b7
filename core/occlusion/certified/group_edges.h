#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"

namespace scarp {

/// The edges of a surface that decide from where its groups are seen.
///
/// In the vertical plane of a sight line the ground of a group is a polyline. A camera beyond it
/// sees none of it exactly where the tangent from the camera to its upper hull is blocked, and the
/// polyline has no corner of that hull at an edge that does not rise above its neighbours.
struct GroupEdges {
  using Edge = std::array<VertexIndex, 2>;

  std::vector<std::size_t> first_border;  ///< [groups + 1], into borders
  std::vector<Edge> borders;              ///< directed, the group on the left
  std::vector<std::size_t> first_crest;   ///< [groups + 1], into crests
  std::vector<Edge> crests;               ///< borders, and edges within that bend downwards (exact)

  std::span<const Edge> borders_of(GroupIndex group) const {
    return {borders.data() + first_border[group], first_border[group + 1] - first_border[group]};
  }
  std::span<const Edge> crests_of(GroupIndex group) const {
    return {crests.data() + first_crest[group], first_crest[group + 1] - first_crest[group]};
  }
};

/// Requires tin.neighbours and a group or kNone for each triangle. Cost: O(triangles + groups).
GroupEdges edges_of_groups(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                           std::uint32_t groups);

}  // namespace scarp
