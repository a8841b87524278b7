#pragma once

#include <memory>

#include "core/culling/node_hiding.h"

namespace scarp {

/// What either of two finds hidden; the second is asked for what the first leaves open.
class JointHiding : public NodeHiding {
 public:
  /// Both of one tree.
  JointHiding(std::unique_ptr<NodeHiding> first, std::unique_ptr<NodeHiding> second);

  std::vector<NodeIndex> find_hidden(const Bounds& eyes,
                                     std::span<const NodeIndex> known) const override;

 private:
  std::unique_ptr<NodeHiding> first_, second_;
};

}  // namespace scarp
