#include "core/culling/joint_hiding.h"

#include <algorithm>
#include <cassert>
#include <iterator>

namespace scarp {

JointHiding::JointHiding(std::unique_ptr<NodeHiding> first, std::unique_ptr<NodeHiding> second)
    : NodeHiding(first->tree()), first_(std::move(first)), second_(std::move(second)) {
  assert(&first_->tree() == &second_->tree());
}

std::vector<NodeIndex> JointHiding::find_hidden(const Bounds& eyes,
                                                std::span<const NodeIndex> known) const {
  const std::vector<NodeIndex> by_first = first_->find_hidden(eyes, known);
  std::vector<NodeIndex> known_now, hidden;
  std::merge(known.begin(), known.end(), by_first.begin(), by_first.end(),
             std::back_inserter(known_now));
  const std::vector<NodeIndex> by_second = second_->find_hidden(eyes, known_now);
  std::merge(by_first.begin(), by_first.end(), by_second.begin(), by_second.end(),
             std::back_inserter(hidden));
  keep_highest(tree(), hidden);
  return hidden;
}

}  // namespace scarp
