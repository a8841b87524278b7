#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/culling/group_batches.h"

namespace scarp {

/// Number of a node of a BoxTree.
using NodeIndex = std::uint32_t;

/// A kd-tree over the boxes of a scene's groups, split in plan: each inner node has two children,
/// each leaf one group. Nodes are numbered in pre-order: what is below a node are the numbers after
/// it, up to last_below.
class BoxTree {
 public:
  struct Node {
    Bounds box;
    std::uint32_t first, count;  // of groups()
    std::uint32_t triangles;     // of all of them
    NodeIndex left, right;       // children, kNone in a leaf

    bool is_leaf() const { return left == kNone; }
  };

  /// Cost: O(n log n).
  explicit BoxTree(const GroupBatches& batches);

  /// Node 0 is the root; none where there are no groups.
  std::span<const Node> nodes() const { return nodes_; }
  /// The greatest number of a node and those below it.
  NodeIndex last_below(NodeIndex node) const { return node + 2 * nodes_[node].count - 2; }
  /// The groups of a node.
  std::span<const GroupIndex> groups_of(const Node& node) const {
    return std::span(groups_).subspan(node.first, node.count);
  }

 private:
  std::uint32_t split(const GroupBatches& batches, std::uint32_t first, std::uint32_t count);

  std::vector<Node> nodes_;
  std::vector<GroupIndex> groups_;
};

/// Square of the distance from a place to a box, 0 within it.
double square_distance_m2(const Position& eye, const Bounds& box);

}  // namespace scarp
