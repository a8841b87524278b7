#pragma once

#include "core/culling/culling_method.h"

namespace scarp {

/// Top-down through the group tree: a node that is hidden, or wholly outside the view, ends the
/// descent. Hidden means: in every sector in which any place of the node's circle has the camera,
/// the camera lies in the node's region. Of these, sectors that are not opposite to the view do
/// not matter. Inside the circle that is every sector.
///
/// Side: arcs of azimuths are rounded outwards, regions inwards (region.h), so that nothing is
/// called hidden that the horizons do not hide; they speak of vertices only (group_tree.h).
/// Thread-safe. Cost: O(nodes tested * sectors * log points). Source: Edmondson 2004, 5.1, 5.3.
CullingAnswer visible_groups(const Groups& groups, const Camera& camera);

/// [triangles] 1 where the answer leaves the triangle out: grouped, and its group not listed.
std::vector<std::uint8_t> culled_triangles(const Groups& groups, const CullingAnswer& answer);

/// visible_groups as a method. The groups must outlive it.
class ThesisCulling : public CullingMethod {
 public:
  explicit ThesisCulling(const Groups& groups) : groups_(groups) {}

  std::string_view name() const override { return "thesis"; }
  CullingAnswer visible(const Camera& camera) override { return visible_groups(groups_, camera); }

 private:
  const Groups& groups_;
};

}  // namespace scarp
