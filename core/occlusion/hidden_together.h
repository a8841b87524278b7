#pragma once

#include <cstdint>

#include "core/occlusion/leaf_groups.h"
#include "core/threads/progress.h"

namespace scarp {

/// How groups that are hidden together are grown.
struct HiddenTogetherOptions {
  std::uint64_t seed = 1;                  ///< of the random numbers that scatter the eyes
  std::uint32_t group_triangles = 128;     ///< mean size that is asked for
  std::uint32_t min_group_triangles = 30;  ///< what is worth drawing at once
  std::uint32_t eyes = 512;                ///< sampled; a multiple of 64
  /// Price of reaching far. In a disc of the plan area that is usual for a group there, distance
  /// costs a triangle as much as being seen from compactness / (2 pi) of the eyes. Least is lost to
  /// eyes at 0.1 and less, but regions of far-reaching groups are coarse, of either method: at 0.3
  /// hardly more is culled than at 1, of more groups that are hidden.
  double compactness = 1;
};

/// Triangles in groups that are likely to be hidden together, all of them.
///
/// A group is culled where none of its triangles is seen. So what a partition loses is, over all
/// eyes and all groups with a seen triangle, the group's triangles; here over a sample of eyes
/// (seen_sample.h), plus a price for groups that reach far, because what is stored of a group's
/// horizon gets coarser with its circle. Every triangle is a crystal at first. The two neighbours
/// whose union loses least coalesce, until there are as many crystals as the mean size asks for;
/// those under the minimum size join the neighbour that loses least by it. Then crystals exchange
/// border triangles where that loses less: at first with a softened loss, in which a crystal with
/// few seen triangles is partly hidden, so that bumps that only pay together can leave one by one.
///
/// @return groups by rising first triangle, without orphans, at most one for each group_triangles
///   triangles begun, none under the minimum where the surface has more; each connected by edges,
///   but that parts of the surface under group_triangles join groups across the void nearest to
///   them (void_bridges.h). Groups collide once for each edge or bridge that they share.
/// Side: none: which triangles make a group decides what can be culled, never whether it is right.
/// Requires tin.neighbours, group_triangles > 0, eyes a multiple of 64 and not 0.
/// The same bits for any thread count and on every machine.
/// Cost: O(eyes n + n log n), about 15 us and 300 bytes a triangle at 512 eyes.
/// Source: own; coalescing is region merging as in image segmentation, exchanging at the borders
/// after Kernighan and Lin 1970.
LeafGroups grow_hidden_together(const Tin& tin, const HiddenTogetherOptions& options,
                                const Progress& progress = {});

}  // namespace scarp
