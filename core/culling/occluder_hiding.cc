#include "core/culling/occluder_hiding.h"

#include <numeric>

namespace scarp {

std::vector<NodeIndex> OccluderHiding::find_hidden(const Bounds& eyes,
                                                   std::span<const NodeIndex> known) const {
  std::vector<NodeIndex> hidden;
  std::vector<std::uint32_t> all(occluders_.size());
  std::iota(all.begin(), all.end(), 0U);
  if (!tree().nodes().empty()) add(eyes, known, 0, all, hidden);
  return hidden;
}

bool OccluderHiding::add(const Bounds& eyes, std::span<const NodeIndex> known, NodeIndex index,
                         std::span<const std::uint32_t> candidates,
                         std::vector<NodeIndex>& hidden) const {
  if (is_known(known, index)) return false;
  const BoxTree::Node& node = tree().nodes()[index];
  std::vector<std::uint32_t> open;
  for (const std::uint32_t o : candidates) {
    const FullOcclusion answer = occluders_[o].judge(eyes, node.box);
    if (answer == FullOcclusion::kHidden) {
      hidden.push_back(index);
      return true;
    }
    if (answer == FullOcclusion::kOpen) open.push_back(o);
  }
  if (node.is_leaf() || open.empty()) return false;
  const bool is_left_hidden = add(eyes, known, node.left, open, hidden);
  const bool is_right_hidden = add(eyes, known, node.right, open, hidden);
  if (!is_left_hidden || !is_right_hidden) return false;
  join_children(index, hidden);
  return true;
}

}  // namespace scarp
