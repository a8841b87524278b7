#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/occlusion/groups.h"

namespace scarp {

/// How often each two groups met: collisions[a][b] == collisions[b][a], absent where never.
using Collisions = std::vector<std::map<GroupIndex, std::uint64_t>>;

void count_collision(Collisions& collisions, GroupIndex a, GroupIndex b);

/// Makes one group of two, under the index `into`, which may be a, b or one that met nobody yet.
/// What the two had with each other is forgotten, what they had with others is added up.
void fuse_collisions(Collisions& collisions, GroupIndex a, GroupIndex b, GroupIndex into);

/// Forgets a group.
void drop_collisions(Collisions& collisions, GroupIndex group);

/// Triangles in groups, before there is a tree above them.
struct LeafGroups {
  std::vector<GroupIndex> group_of_triangle;  ///< [triangles], kNone for an orphan
  std::uint32_t count = 0;                    ///< groups, each with at least one triangle
  Collisions collisions;                      ///< [count]
  std::uint32_t passes = 0;                   ///< of seeding that were used
};

}  // namespace scarp
