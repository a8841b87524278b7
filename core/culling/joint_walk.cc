#include "core/culling/joint_walk.h"

#include <cassert>

namespace scarp {
namespace {

class Walk {
 public:
  Walk(const BoxTree& tree, std::span<const NodeIndex> hidden) : tree_(tree), hidden_(hidden) {}

  void go(std::span<const ActiveNode> before) {
    for (std::size_t i = 0; i < before.size();) {
      const NodeIndex node = before[i].node;
      ++visited_;
      pass_until(node);
      if (at_ < hidden_.size() && hidden_[at_] <= node) {
        const NodeIndex last = tree_.last_below(hidden_[at_]);
        active_.push_back({hidden_[at_], true});
        while (i < before.size() && before[i].node <= last) ++i;
      } else {
        open(node);
        ++i;
      }
    }
  }

  std::vector<ActiveNode> active_;
  std::uint64_t visited_ = 0;

 private:
  /// Moves on to the hidden node that holds a node or comes after it.
  void pass_until(NodeIndex node) {
    while (at_ < hidden_.size() && tree_.last_below(hidden_[at_]) < node) ++at_;
  }

  void open(NodeIndex root) {
    const NodeIndex last = tree_.last_below(root);
    for (NodeIndex node = root; node <= last; ++node) {
      if (node != root) ++visited_;
      pass_until(node);
      if (at_ < hidden_.size() && hidden_[at_] == node) {
        active_.push_back({node, true});
        node = tree_.last_below(node);
      } else if (tree_.nodes()[node].is_leaf()) {
        active_.push_back({node, false});
      }
    }
  }

  const BoxTree& tree_;
  std::span<const NodeIndex> hidden_;
  std::size_t at_ = 0;
};

}  // namespace

std::uint64_t walk_jointly(const BoxTree& tree, std::span<const NodeIndex> hidden,
                           std::vector<ActiveNode>& active) {
  Walk walk(tree, hidden);
  walk.go(active);
  active = std::move(walk.active_);
  return walk.visited_;
}

}  // namespace scarp
