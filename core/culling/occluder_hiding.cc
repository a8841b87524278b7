#include "core/culling/occluder_hiding.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace scarp {

OccluderHiding::OccluderHiding(const BoxTree& tree, const GroupBatches& batches, const Tin& tin,
                               std::vector<UprightOccluder> occluders)
    : NodeHiding(tree), tin_(tin), occluders_(std::move(occluders)) {
  const auto highest_m = [&](TriangleIndex t) {
    const auto& [a, b, c] = tin.triangles[t];
    return std::max({tin.vertices[a].z_m, tin.vertices[b].z_m, tin.vertices[c].z_m});
  };
  for (GroupIndex g = 0; g < batches.groups(); ++g) {
    const auto of_group = batches.triangles(g);
    auto& sorted = triangles_.emplace_back(of_group.begin(), of_group.end());
    // What stands out is seen first, and ends the question.
    std::stable_sort(sorted.begin(), sorted.end(),
                     [&](TriangleIndex a, TriangleIndex b) { return highest_m(a) > highest_m(b); });
  }
}

bool OccluderHiding::hides_each_triangle(const Bounds& eyes, GroupIndex group,
                                         std::span<const std::uint32_t> candidates) const {
  // Neighbours are mostly hidden by one occluder.
  std::uint32_t last = candidates.front();
  for (const TriangleIndex t : triangles_[group]) {
    const auto& [a, b, c] = tin_.triangles[t];
    const std::array<Position, 3> corners = {tin_.vertices[a], tin_.vertices[b], tin_.vertices[c]};
    const auto hides = [&](std::uint32_t o) { return occluders_[o].hides(eyes, corners); };
    if (hides(last)) continue;
    const auto found = std::find_if(candidates.begin(), candidates.end(), hides);
    if (found == candidates.end()) return false;
    last = *found;
  }
  return true;
}

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
  if (open.empty()) return false;
  if (node.is_leaf()) {
    if (!hides_each_triangle(eyes, tree().groups_of(node).front(), open)) return false;
    hidden.push_back(index);
    return true;
  }
  const bool is_left_hidden = add(eyes, known, node.left, open, hidden);
  const bool is_right_hidden = add(eyes, known, node.right, open, hidden);
  if (!is_left_hidden || !is_right_hidden) return false;
  join_children(index, hidden);
  return true;
}

}  // namespace scarp
