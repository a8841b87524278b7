#include "core/culling/visible_groups.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/occlusion/region.h"
#include "core/occlusion/sector_range.h"

namespace scarp {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr AzimuthArc kAllAround{0, 2 * kPi};

/// Relative allowance for the rounding of a distance and of its ratio to a radius.
constexpr double kRatioRounding = 0x1p-49;

AzimuthArc arc_of(const ViewRange& view) {
  double width_rad = view.to_rad - view.from_rad;
  if (width_rad >= 2 * kPi) return kAllAround;
  if (width_rad < 0) width_rad += 2 * kPi * std::ceil(-width_rad / (2 * kPi));
  return {view.from_rad, view.from_rad + width_rad};
}

AzimuthArc turned(const AzimuthArc& arc, double by_rad) {
  return {arc.from_rad + by_rad, arc.to_rad + by_rad};
}

/// Azimuths in which places of a node's circle have the eye.
AzimuthArc towards_eye(const GroupNode& node, const Position& eye) {
  const double dx_m = eye.x_m - node.centre_x_m, dy_m = eye.y_m - node.centre_y_m;
  const double distance_m = std::sqrt(dx_m * dx_m + dy_m * dy_m);
  const double sine = node.radius_m / distance_m * (1 + kRatioRounding);
  if (!(sine < 1)) return kAllAround;  // inside the circle, or 0 / 0
  const double middle_rad = std::atan2(dy_m, dx_m), half_rad = std::asin(sine);
  return {middle_rad - half_rad, middle_rad + half_rad};
}

/// A camera, prepared for questions about nodes.
class Test {
 public:
  Test(const Groups& groups, const Camera& camera) : groups_(groups), camera_(camera) {
    const SectorLayout& layout = groups.regions.layout;
    if (camera.view) view_ = arc_of(*camera.view);
    opposite_ = sectors_touching(layout, turned(view_, kPi));
    for (std::int32_t sector = 0; sector < layout.count; ++sector)
      eye_u_m_.push_back(distance_along(sector_axis(layout, sector), camera.eye));
  }

  bool may_be_seen(GroupIndex node) const {
    const AzimuthArc arc = towards_eye(groups_.nodes[node], camera_.eye);
    if (camera_.view && !arcs_overlap(turned(arc, kPi), view_)) return false;
    const SectorLayout& layout = groups_.regions.layout;
    const SectorRange sectors = sectors_touching(layout, arc);
    for (std::int32_t i = 0; i < sectors.count; ++i) {
      const std::int32_t sector = (sectors.first + i) % layout.count;
      if (opposite_.holds(layout, sector) &&
          !hides(groups_.regions.at(node, sector), eye_u_m_[static_cast<std::size_t>(sector)],
                 camera_.eye.z_m))
        return true;
    }
    return false;
  }

 private:
  const Groups& groups_;
  const Camera& camera_;
  AzimuthArc view_ = kAllAround;
  SectorRange opposite_{};
  std::vector<double> eye_u_m_;  // [sectors]
};

}  // namespace

CullingAnswer visible_groups(const Groups& groups, const Camera& camera) {
  CullingAnswer answer;
  const Test test(groups, camera);
  std::vector<GroupIndex> open;
  for (GroupIndex node = 0; node < groups.nodes.size(); ++node)
    if (groups.nodes[node].parent == kNone) open.push_back(node);
  while (!open.empty()) {
    const GroupIndex node = open.back();
    open.pop_back();
    ++answer.nodes_tested;
    if (!test.may_be_seen(node)) continue;
    if (node < groups.leaf_count)
      answer.visible_groups.push_back(node);
    else
      open.insert(open.end(), groups.nodes[node].children.begin(),
                  groups.nodes[node].children.end());
  }
  std::sort(answer.visible_groups.begin(), answer.visible_groups.end());
  return answer;
}

std::vector<std::uint8_t> culled_triangles(const Groups& groups, const CullingAnswer& answer) {
  std::vector<std::uint8_t> culled_group(groups.leaf_count, 1);
  for (const GroupIndex group : answer.visible_groups) {
    assert(group < groups.leaf_count);
    culled_group[group] = 0;
  }
  std::vector<std::uint8_t> culled(groups.group_of_triangle.size(), 0);
  for (std::size_t t = 0; t < culled.size(); ++t) {
    const GroupIndex group = groups.group_of_triangle[t];
    if (group != kNone) culled[t] = culled_group[group];
  }
  return culled;
}

}  // namespace scarp
