#include "core/culling/swept_culling.h"

#include <algorithm>

namespace scarp {

SweptCulling::SweptCulling(const CertifiedRegions& regions, const GroupBatches& batches)
    : certified_(regions), batches_(batches) {}

/// Whether any of a group may be seen; what may be then hides what is behind it.
bool SweptCulling::shows(GroupIndex group) {
  if (horizon_.hides(batches_.box(group))) return false;
  places_.clear();
  for (const Position& p : batches_.vertices(group)) places_.push_back(horizon_.place(p));
  const auto corners_of = [&](const std::array<VertexIndex, 3>& t) {
    return std::array<AheadPoint, 3>{places_[t[0]], places_[t[1]], places_[t[2]]};
  };
  const auto triangles = batches_.corners(group);
  if (std::all_of(triangles.begin(), triangles.end(),
                  [&](const auto& t) { return horizon_.hides(corners_of(t)); }))
    return false;
  for (const auto& t : triangles) horizon_.add(corners_of(t));
  return true;
}

std::size_t SweptCulling::visible_into(const Camera& camera, std::span<GroupIndex> visible) {
  const std::size_t left = certified_.visible_into(camera, visible);
  is_swept_ = camera.view && horizon_.begin(camera.eye, *camera.view);
  if (!is_swept_) return left;
  order_.clear();
  for (std::uint32_t i = 0; i < left; ++i)
    order_.emplace_back(horizon_.nearest_m(batches_.box(visible[i])), i);
  std::sort(order_.begin(), order_.end());
  is_shown_.assign(left, 0);
  for (const auto& [nearest_m, i] : order_) is_shown_[i] = shows(visible[i]);
  std::size_t shown = 0;
  for (std::size_t i = 0; i < left; ++i) {
    visible[shown] = visible[i];
    shown += is_shown_[i];
  }
  return shown;
}

CullingAnswer SweptCulling::visible(const Camera& camera) {
  CullingAnswer answer;
  answer.visible_groups.resize(batches_.groups());
  answer.visible_groups.resize(visible_into(camera, answer.visible_groups));
  answer.nodes_tested = batches_.groups();
  return answer;
}

bool SweptCulling::may_show(const Bounds& box) {
  return !is_swept_ || !horizon_.hides(box);
}

}  // namespace scarp
