#include "core/culling/swept_culling.h"

#include <algorithm>
#include <cmath>

#include "core/culling/box_tree.h"

namespace scarp {
namespace {

/// Groups that are asked together whether they are in view, and under the horizon.
constexpr std::uint32_t kGroupsABlock = 16;

/// Blocks of which groups are looked up at once, so that look-ups overlap, which are mostly misses
/// of the cache.
constexpr std::size_t kBlocksAtOnce = 8;

/// Groups that look smaller raise no horizon: they hide little, and regions know what is far away.
constexpr double kLeastOccluderRad = 0.4;

}  // namespace

SweptCulling::SweptCulling(const CertifiedRegions& regions, const GroupBatches& batches)
    : certified_(regions), batches_(batches), triangles_(batches) {
  const BoxTree tree(batches);
  const auto nodes = tree.nodes();
  for (NodeIndex n = 0; n < nodes.size(); ++n) {
    if (nodes[n].count > kGroupsABlock) continue;
    const auto groups = tree.groups_of(nodes[n]);
    blocks_.push_back({nodes[n].box, static_cast<std::uint32_t>(groups_.size()), nodes[n].count});
    groups_.insert(groups_.end(), groups.begin(), groups.end());
    n = tree.last_below(n);
  }
}

/// The groups of blocks that are in view and not under the horizon, by nearest point, without those
/// that the regions hide.
void SweptCulling::look_up(const Camera& camera, std::span<const NearBlock> blocks) {
  asked_.clear();
  for (const auto& [nearest_m, b] : blocks) {
    if (horizon_.hides(blocks_[b].box)) continue;
    const auto first = groups_.begin() + blocks_[b].first;
    asked_.insert(asked_.end(), first, first + blocks_[b].count);
  }
  left_.resize(asked_.size());
  left_.resize(certified_.visible_among(camera, asked_, left_));
  order_.clear();
  for (const GroupIndex g : left_) {
    const Bounds& box = batches_.box(g);
    const double nearest_m = horizon_.nearest_m(box);
    const double width_m = std::hypot(box.high.x_m - box.low.x_m, box.high.y_m - box.low.y_m);
    order_.push_back({nearest_m, g, width_m >= kLeastOccluderRad * nearest_m});
  }
  std::sort(order_.begin(), order_.end());
}

std::size_t SweptCulling::visible_into(const Camera& camera, std::span<GroupIndex> visible) {
  is_swept_ = camera.view && horizon_.begin(camera.eye, *camera.view);
  if (!is_swept_) return certified_.visible_into(camera, visible);
  near_.clear();
  for (std::uint32_t b = 0; b < blocks_.size(); ++b)
    if (!horizon_.is_beside(blocks_[b].box))
      near_.emplace_back(horizon_.nearest_m(blocks_[b].box), b);
  std::sort(near_.begin(), near_.end());
  std::size_t shown = 0;
  for (std::size_t next = 0; next < near_.size(); next += kBlocksAtOnce) {
    look_up(camera, std::span(near_).subspan(next, std::min(kBlocksAtOnce, near_.size() - next)));
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (i + 1 < order_.size()) triangles_.prefetch(order_[i + 1].group, order_[i + 1].raises);
      const NearGroup& near = order_[i];
      visible[shown] = near.group;
      // What may be seen hides what is behind it.
      shown += !horizon_.hides(batches_.box(near.group)) &&
               horizon_.shows(triangles_.of(near.group), near.raises);
    }
  }
  std::sort(visible.begin(), visible.begin() + static_cast<std::ptrdiff_t>(shown));
  return shown;
}

CullingAnswer SweptCulling::visible(const Camera& camera) {
  // Few of so many are written.
  visible_.resize(batches_.groups());
  const auto count = static_cast<std::ptrdiff_t>(visible_into(camera, visible_));
  CullingAnswer answer;
  answer.visible_groups.assign(visible_.begin(), visible_.begin() + count);
  answer.nodes_tested = batches_.groups();
  return answer;
}

bool SweptCulling::may_show(const Bounds& box) {
  return !is_swept_ || !horizon_.hides(box);
}

}  // namespace scarp
