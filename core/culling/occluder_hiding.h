#pragma once

#include "core/culling/node_hiding.h"
#include "core/occlusion/upright_occluder.h"

namespace scarp {

/// Hidden by virtual occluders: a node's box by one of them, or its children's, each by one, down
/// to the triangles of a group.
///
/// On the way down the tree an occluder is left out from where it can hide nothing more, so that
/// each node is asked for few. Keeps references.
/// Cost: about 0.3 us for each occluder and node that it is asked for.
/// Source: Law and Tan 1999, 5.2; occluders thin out from the root there too, by what faces away.
class OccluderHiding : public NodeHiding {
 public:
  /// @param occluders  each strictly under ground
  OccluderHiding(const BoxTree& tree, const GroupBatches& batches, const Tin& tin,
                 std::vector<UprightOccluder> occluders);

  std::vector<NodeIndex> find_hidden(const Bounds& eyes,
                                     std::span<const NodeIndex> known) const override;

  std::size_t occluders() const { return occluders_.size(); }

 private:
  bool add(const Bounds& eyes, std::span<const NodeIndex> known, NodeIndex node,
           std::span<const std::uint32_t> candidates, std::vector<NodeIndex>& hidden) const;

  bool hides_each_triangle(const Bounds& eyes, GroupIndex group,
                           std::span<const std::uint32_t> candidates) const;

  const Tin& tin_;
  std::vector<UprightOccluder> occluders_;
  std::vector<std::vector<TriangleIndex>> triangles_;  // [groups], the highest first
};

}  // namespace scarp
