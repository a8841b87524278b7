#include "core/culling/certified_culling.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/threads/for_each_target.h"

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
  std::array<float, kBlock> x_m{}, y_m{}, radius_m{}, rise_m, distance_m;
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

/// Rings and sectors of a camera by where it is from the groups of a block.
SCARP_FOR_EACH_TARGET
void find_cells(const PolarLayout layout, const float* x_m, const float* y_m, const float* radius_m,
                std::int32_t* ring, std::int32_t* sector) {
  for (std::size_t i = 0; i < kBlock; ++i) {
    const float square_m2 = x_m[i] * x_m[i] + y_m[i] * y_m[i];
    const float ring_square = square_m2 / (radius_m[i] * radius_m[i]);
    // Within the circle there is no ring, and perhaps no direction.
    const bool is_near = !(ring_square >= 1);
    const std::int32_t of_ring = ring_of(layout, is_near ? 1.0F : ring_square);
    ring[i] = is_near ? -1 : of_ring;
    sector[i] = sector_of(layout, is_near ? 1.0F : x_m[i], is_near ? 1.0F : y_m[i]);
  }
}

void place_camera(const CertifiedRegions& regions, const Position& eye, Block& block) {
  for (std::size_t i = 0; i < block.count; ++i) {
    const CertifiedGroup& g = regions.groups[block.group[i]];
    block.x_m[i] = static_cast<float>(eye.x_m - g.centre_x_m);
    block.y_m[i] = static_cast<float>(eye.y_m - g.centre_y_m);
    block.rise_m[i] = static_cast<float>(eye.z_m - g.height_m);
    block.radius_m[i] = g.radius_m;
    block.distance_m[i] = std::sqrt(block.x_m[i] * block.x_m[i] + block.y_m[i] * block.y_m[i]);
  }
  find_cells(regions.layout, block.x_m.data(), block.y_m.data(), block.radius_m.data(),
             block.ring.data(), block.sector.data());
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
  std::array<Block, 2> blocks;
  std::size_t found = 0, next = 0;
  const auto take = [&](Block& block) {
    // The view first: it costs a few multiplications, a look-up mostly a miss of the cache.
    next = fill(regions_, wedge.shows_all() ? nullptr : &wedge, among, next, count, block);
    place_camera(regions_, camera.eye, block);
  };
  const auto steps_for = [&](const Block& block, std::size_t i) {
    return &regions_.at(block.group[i], block.sector[i]);
  };
  Block *now = &blocks[0], *then = &blocks[1];
  take(*now);
  for (std::size_t i = 0; i < now->count; ++i) __builtin_prefetch(steps_for(*now, i));
  for (; now->count > 0; std::swap(now, then)) {
    take(*then);
    // What the next block needs is fetched between the tests of this one.
    for (std::size_t i = 0; i < std::max(now->count, then->count); ++i) {
      if (i < then->count) __builtin_prefetch(steps_for(*then, i));
      if (i >= now->count) continue;
      const GroupIndex group = now->group[i];
      const bool is_hidden =
          now->ring[i] >= 0 && hides_at(regions_.groups[group], *steps_for(*now, i), now->ring[i],
                                        now->distance_m[i], now->rise_m[i]);
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
