#pragma once

#include "core/occlusion/leaf_groups.h"

namespace scarp {

/// Triangles in the squares of a quadtree, for comparison with crystals: knows nothing of
/// horizons, has no orphans. The square with most triangles is divided (lowest index on ties)
/// until there are as many that hold any as groups of the mean size asked for make. A triangle
/// belongs to the square of its centroid; groups collide once for each edge that they share.
/// Requires tin.neighbours and group_triangles > 0. Cost: O(n log n).
LeafGroups group_by_squares(const Tin& tin, std::uint32_t group_triangles);

}  // namespace scarp
