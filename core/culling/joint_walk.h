#pragma once

#include <span>
#include <vector>

#include "core/culling/box_tree.h"

namespace scarp {

/// The part of a tree that a frame works on: every leaf once, alone or under a hidden node.
struct ActiveNode {
  NodeIndex node;
  bool is_hidden;

  friend bool operator==(const ActiveNode&, const ActiveNode&) = default;
};

/// Walks the active list of the frame before and the hidden nodes of this one together, both by
/// rising number: what is hidden now closes over what was open below it, what is hidden no longer
/// is opened, and nothing below a hidden node is looked at.
///
/// @param active  of any frame, or the root alone; becomes the one of this frame
/// @param hidden  none below another
/// @return how many nodes were looked at
/// Cost: O(active + hidden + nodes opened). Source: Law and Tan 1999, 6.
std::uint64_t walk_jointly(const BoxTree& tree, std::span<const NodeIndex> hidden,
                           std::vector<ActiveNode>& active);

}  // namespace scarp
