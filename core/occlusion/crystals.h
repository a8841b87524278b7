#pragma once

#include <cstdint>

#include "core/occlusion/leaf_groups.h"
#include "core/threads/progress.h"

namespace scarp {

/// How crystals are grown. Table 3 of the thesis: seeds 100 (10,000 vertices) or 500 (100,000),
/// max_groups 200 or 1,000, merge_small false, the rest as here.
struct CrystalOptions {
  std::uint64_t seed = 1;               ///< of the random numbers that scatter the seeds
  std::uint32_t group_triangles = 128;  ///< mean size that is asked for
  std::uint32_t seeds = 0;              ///< in the first pass; 0: triangles / group_triangles
  std::uint32_t max_passes = 10;
  std::uint32_t max_groups = kNone;        ///< of min_group_triangles and more
  std::uint32_t min_group_triangles = 30;  ///< what is worth drawing at once
  bool merge_small = true;                 ///< false: groups under the minimum are all set free
};

/// Triangles in groups that are likely to be hidden together.
///
/// Seeds are scattered over the triangles and grow by one triangle a round, in breadth-first
/// order. A triangle is not taken while one of its corners lies beyond and under the horizon of
/// the group's lowest vertex; it may be tried again from another side. An attempt to take the
/// triangle of another group counts as a collision of the two. Further passes scatter seeds in
/// proportion over the orphans, until there are none, a pass yields no group of the minimum size,
/// or a limit is reached. At last each group under the minimum is merged with the group under the
/// minimum that it met most often (lowest index on ties), and set free where it met none.
///
/// @return groups in the order of their seeds, at most max_groups, each connected by edges
/// Requires tin.neighbours, and a horizon of all its vertices; group_triangles, max_passes > 0.
/// The same bits on every machine: growth is sequential.
/// Cost: O(triangles), under 1 us each. Source: Edmondson 2004, 5.2.3 and 6.3.1.
LeafGroups grow_crystals(const Tin& tin, const HorizonTable& horizon, const CrystalOptions& options,
                         const Progress& progress = {});

}  // namespace scarp
