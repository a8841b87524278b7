#include "core/culling/certified_hiding.h"

#include "core/occlusion/certified/box_hiding.h"

namespace scarp {

std::vector<NodeIndex> CertifiedHiding::find_hidden(const Bounds& eyes,
                                                    std::span<const NodeIndex> known) const {
  std::vector<NodeIndex> hidden;
  if (!tree().nodes().empty()) add(eyes, known, 0, hidden);
  return hidden;
}

bool CertifiedHiding::add(const Bounds& eyes, std::span<const NodeIndex> known, NodeIndex index,
                          std::vector<NodeIndex>& hidden) const {
  if (is_known(known, index)) return false;
  const BoxTree::Node& node = tree().nodes()[index];
  if (node.is_leaf()) {
    if (!hides_group_from(regions_, tree().groups_of(node).front(), eyes)) return false;
    hidden.push_back(index);
    return true;
  }
  const bool is_left_hidden = add(eyes, known, node.left, hidden);
  const bool is_right_hidden = add(eyes, known, node.right, hidden);
  if (!is_left_hidden || !is_right_hidden) return false;
  join_children(index, hidden);
  return true;
}

}  // namespace scarp
