#pragma once

#include <span>

#include "core/occlusion/groups.h"

namespace scarp {

/// Groups of several tiles as those of one surface, whose triangles are the tiles' one after the
/// other: leaves first, tile after tile, then the inner nodes in the same way. Each tile keeps its
/// own tree, so that there are as many roots as in all of them.
///
/// @param tiles  with the same layouts of regions and of certified regions; those without a group
///               may have any. Certified regions are joined where all tiles with groups have them.
/// Cost: O(size of all).
Groups join_groups(std::span<const Groups> tiles);

}  // namespace scarp
