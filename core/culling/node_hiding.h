#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "core/culling/box_tree.h"

namespace scarp {

/// Leaves only those nodes of an ascending list that are not below another of it.
inline void keep_highest(const BoxTree& tree, std::vector<NodeIndex>& nodes) {
  std::size_t kept = 0;
  for (const NodeIndex node : nodes)
    if (kept == 0 || node > tree.last_below(nodes[kept - 1])) nodes[kept++] = node;
  nodes.resize(kept);
}

/// What tells which nodes of a tree are hidden from all of a box of eyes.
class NodeHiding {
 public:
  explicit NodeHiding(const BoxTree& tree) : tree_(tree) {}
  virtual ~NodeHiding() = default;

  /// The highest nodes of the tree that are found hidden from every eye in the box, ascending, none
  /// below another.
  /// @param known  ascending: hidden anyway, neither they nor what is below them is looked at
  /// Side: never one of which an eye in the box sees anything. Thread-safe.
  virtual std::vector<NodeIndex> find_hidden(const Bounds& eyes,
                                             std::span<const NodeIndex> known) const = 0;

  const BoxTree& tree() const { return tree_; }

 protected:
  static bool is_known(std::span<const NodeIndex> known, NodeIndex node) {
    return std::binary_search(known.begin(), known.end(), node);
  }

  /// Two children that were just found become their parent.
  void join_children(NodeIndex node, std::vector<NodeIndex>& hidden) const {
    hidden.resize(hidden.size() - 2);
    hidden.push_back(node);
  }

 private:
  const BoxTree& tree_;
};

}  // namespace scarp
