#pragma once

#include "core/culling/node_hiding.h"
#include "core/occlusion/certified/certified_regions.h"

namespace scarp {

/// Hidden by certified regions: leaf by leaf, and a node where both its children are.
/// Keeps references. Cost: hides_group_from for each leaf that is not known.
class CertifiedHiding : public NodeHiding {
 public:
  CertifiedHiding(const BoxTree& tree, const CertifiedRegions& regions)
      : NodeHiding(tree), regions_(regions) {}

  std::vector<NodeIndex> find_hidden(const Bounds& eyes,
                                     std::span<const NodeIndex> known) const override;

 private:
  bool add(const Bounds& eyes, std::span<const NodeIndex> known, NodeIndex node,
           std::vector<NodeIndex>& hidden) const;

  const CertifiedRegions& regions_;
};

}  // namespace scarp
