#include "core/culling/certified_culling.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Groups in view whose cells are found before the first of them is looked up, so that the look-ups
/// overlap.
constexpr std::size_t kBlock = 64;

/// Relative allowance for the rounding of a circle's distance from the border of the view.
constexpr double kViewRounding = 0x1p-30;

/// What a view shows, as the two half-planes left of its right border and right of its left one,
/// and where it is convex the half-plane ahead: for a circle the two of a narrow view leave much of
/// what is behind the eye.
class ViewWedge {
 public:
  ViewWedge(const Position& eye, const ViewRange& view) : eye_(eye) {
    constexpr double kTurn = 2 * std::numbers::pi;
    double width_rad = view.to_rad - view.from_rad;
    shows_all_ = width_rad >= kTurn;
    if (width_rad < 0) width_rad += kTurn * std::ceil(-width_rad / kTurn);
    is_convex_ = width_rad <= std::numbers::pi;
    from_x_ = std::cos(view.from_rad), from_y_ = std::sin(view.from_rad);
    to_x_ = std::cos(view.from_rad + width_rad), to_y_ = std::sin(view.from_rad + width_rad);
    const double middle_rad = view.from_rad + width_rad / 2;
    ahead_x_ = std::cos(middle_rad), ahead_y_ = std::sin(middle_rad);
  }

  /// Without branches: which groups are in view cannot be foretold.
  bool may_show(const CertifiedGroup& group) const {
    const double x_m = group.centre_x_m - eye_.x_m, y_m = group.centre_y_m - eye_.y_m;
    const double reach_m =
        static_cast<double>(group.radius_m) + (std::abs(x_m) + std::abs(y_m)) * kViewRounding;
    const bool left_of_from = from_x_ * y_m - from_y_ * x_m >= -reach_m;
    const bool right_of_to = to_y_ * x_m - to_x_ * y_m >= -reach_m;
    const bool is_ahead = ahead_x_ * x_m + ahead_y_ * y_m >= -reach_m;
    return is_convex_ ? left_of_from & right_of_to & is_ahead : left_of_from | right_of_to;
  }

  bool shows_all() const { return shows_all_; }

 private:
  Position eye_;
  bool shows_all_, is_convex_;
  double from_x_, from_y_, to_x_, to_y_, ahead_x_, ahead_y_;
};

/// A camera as some groups see it: arrays, so that the arithmetic runs side by side.
struct Block {
  std::size_t count = 0;
  std::array<GroupIndex, kBlock> group;
  std::array<float, kBlock> x_m, y_m, rise_m, distance_m;
  std::array<std::int32_t, kBlock> ring, sector;
};

/// Fills a block with the next groups in view.
/// @param among  numbers of groups, or null: all of them
/// @return the first of `count` that was not looked at
std::size_t fill(const CertifiedRegions& regions, const ViewWedge* wedge, const GroupIndex* among,
                 std::size_t next, std::size_t count, Block& block) {
  block.count = 0;
  for (; next < count && block.count < kBlock; ++next) {
    const GroupIndex group = among == nullptr ? static_cast<GroupIndex>(next) : among[next];
    block.group[block.count] = group;
    block.count += wedge == nullptr || wedge->may_show(regions.groups[group]);
  }
  return next;
}

void place_camera(const CertifiedRegions& regions, const Position& eye, Block& block) {
  std::array<float, kBlock> ring_square;
  for (std::size_t i = 0; i < block.count; ++i) {
    const CertifiedGroup& g = regions.groups[block.group[i]];
    block.x_m[i] = static_cast<float>(eye.x_m - g.centre_x_m);
    block.y_m[i] = static_cast<float>(eye.y_m - g.centre_y_m);
    block.rise_m[i] = static_cast<float>(eye.z_m - g.height_m);
    const float square_m2 = block.x_m[i] * block.x_m[i] + block.y_m[i] * block.y_m[i];
    ring_square[i] = square_m2 / (g.radius_m * g.radius_m);
    block.distance_m[i] = std::sqrt(square_m2);
  }
  for (std::size_t i = 0; i < block.count; ++i) {
    // Within the circle there is no ring, and perhaps no direction.
    const bool is_near = !(ring_square[i] >= 1);
    block.ring[i] = is_near ? -1 : ring_of(regions.layout, ring_square[i]);
    block.sector[i] = is_near ? 0 : sector_of(regions.layout, block.x_m[i], block.y_m[i]);
  }
}

}  // namespace

CertifiedCulling::CertifiedCulling(const CertifiedRegions& regions) : regions_(regions) {}

std::size_t CertifiedCulling::visible_into(const Camera& camera,
                                           std::span<GroupIndex> visible) const {
  return find_visible(camera, nullptr, regions_.groups.size(), visible);
}

std::size_t CertifiedCulling::visible_among(const Camera& camera,
                                            std::span<const GroupIndex> groups,
                                            std::span<GroupIndex> visible) const {
  return find_visible(camera, groups.data(), groups.size(), visible);
}

std::size_t CertifiedCulling::find_visible(const Camera& camera, const GroupIndex* among,
                                           std::size_t count, std::span<GroupIndex> visible) const {
  assert(visible.size() >= count);
  const ViewWedge wedge(camera.eye, camera.view.value_or(ViewRange{0, 100}));
  Block block;
  std::size_t found = 0;
  for (std::size_t next = 0; next < count;) {
    // The view first: it costs a few multiplications, a look-up mostly a miss of the cache.
    next = fill(regions_, wedge.shows_all() ? nullptr : &wedge, among, next, count, block);
    place_camera(regions_, camera.eye, block);
    for (std::size_t i = 0; i < block.count; ++i)
      __builtin_prefetch(&regions_.at(block.group[i], block.sector[i]));
    for (std::size_t i = 0; i < block.count; ++i) {
      const GroupIndex group = block.group[i];
      const bool is_hidden = block.ring[i] >= 0 &&
                             hides_at(regions_.groups[group], regions_.at(group, block.sector[i]),
                                      block.ring[i], block.distance_m[i], block.rise_m[i]);
      visible[found] = group;
      found += !is_hidden;
    }
  }
  return found;
}

CullingAnswer CertifiedCulling::visible(const Camera& camera) {
  CullingAnswer answer;
  answer.visible_groups.resize(regions_.groups.size());
  answer.visible_groups.resize(visible_into(camera, answer.visible_groups));
  answer.nodes_tested = regions_.groups.size();
  return answer;
}

}  // namespace scarp
