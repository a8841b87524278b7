#include "core/occlusion/certified/box_hiding.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// More than what float makes of a camera's place in hides_group: relative, of squares of
/// distances and of heights, and radians.
constexpr double kCameraRounding = 0x1p-18;

struct Range {
  double low, high;
};

/// Distances from the origin of the places of a rectangle that does not hold it.
Range distances_m(double low_x_m, double low_y_m, double high_x_m, double high_y_m) {
  const double near_x = std::max({low_x_m, 0.0, -high_x_m});
  const double near_y = std::max({low_y_m, 0.0, -high_y_m});
  const double far_x = std::max(std::abs(low_x_m), std::abs(high_x_m));
  const double far_y = std::max(std::abs(low_y_m), std::abs(high_y_m));
  return {std::hypot(near_x, near_y), std::hypot(far_x, far_y)};
}

/// Azimuths of the places of such a rectangle: it is convex, so less than half a turn.
Range azimuths_rad(double low_x_m, double low_y_m, double high_x_m, double high_y_m) {
  const double middle_rad = std::atan2((low_y_m + high_y_m) / 2, (low_x_m + high_x_m) / 2);
  Range range{middle_rad, middle_rad};
  for (const double x_m : {low_x_m, high_x_m})
    for (const double y_m : {low_y_m, high_y_m}) {
      const double turn_rad =
          std::remainder(std::atan2(y_m, x_m) - middle_rad, 2 * std::numbers::pi);
      range.low = std::min(range.low, middle_rad + turn_rad);
      range.high = std::max(range.high, middle_rad + turn_rad);
    }
  return range;
}

/// Whether the steps of a sector hide the group from all cameras in a ring, between two distances,
/// no higher than rise_m above the group.
bool hides_ring(const CertifiedGroup& group, const SectorSteps& steps, std::int32_t ring,
                const Range& distance_m, double rise_m) {
  // The least line over the distances is at one of their ends.
  for (const double at_m : {distance_m.low, distance_m.high})
    if (!hides_at(group, steps, ring, static_cast<float>(at_m), static_cast<float>(rise_m)))
      return false;
  return true;
}

}  // namespace

bool hides_group_from(const CertifiedRegions& regions, std::uint32_t group, const Bounds& box) {
  assert(group < regions.groups.size());
  const CertifiedGroup& g = regions.groups[group];
  const PolarLayout& layout = regions.layout;
  const double low_x_m = box.low.x_m - g.centre_x_m, high_x_m = box.high.x_m - g.centre_x_m;
  const double low_y_m = box.low.y_m - g.centre_y_m, high_y_m = box.high.y_m - g.centre_y_m;
  const double radius_m = static_cast<double>(g.radius_m);
  Range distance_m = distances_m(low_x_m, low_y_m, high_x_m, high_y_m);
  distance_m.low *= 1 - kCameraRounding;
  distance_m.high *= 1 + kCameraRounding;
  if (!(distance_m.low > radius_m)) return false;

  const auto ring_at = [&](double at_m) {
    const double square = at_m * at_m / (radius_m * radius_m);
    return ring_of(layout, static_cast<float>(square));
  };
  // Most boxes that are not hidden show it at a corner.
  for (const double x_m : {box.low.x_m, box.high.x_m})
    for (const double y_m : {box.low.y_m, box.high.y_m})
      if (!hides_group(regions, group, {x_m, y_m, box.high.z_m})) return false;

  const std::int32_t first_ring = ring_at(distance_m.low), last_ring = ring_at(distance_m.high);
  const Range azimuth_rad = azimuths_rad(low_x_m, low_y_m, high_x_m, high_y_m);
  const auto sector_at = [&](double at_rad) {
    return sector_of(layout, std::cos(at_rad), std::sin(at_rad));
  };
  const std::int32_t first_sector = sector_at(azimuth_rad.low - kCameraRounding);
  const std::int32_t last_sector = sector_at(azimuth_rad.high + kCameraRounding);
  const double rise_m = box.high.z_m - g.height_m;
  const double risen_m = rise_m + std::abs(rise_m) * kCameraRounding;
  for (std::int32_t sector = first_sector;; sector = (sector + 1) % layout.sectors) {
    const SectorSteps& steps = regions.at(group, sector);
    for (std::int32_t ring = first_ring; ring <= last_ring; ++ring) {
      const double ring_near_m = radius_m * ring_start(layout, ring) * (1 - kCameraRounding);
      const double ring_far_m =
          ring + 1 < kRings ? radius_m * ring_start(layout, ring + 1) * (1 + kCameraRounding)
                            : distance_m.high;
      const Range within_m{std::max(distance_m.low, ring_near_m),
                           std::min(distance_m.high, ring_far_m)};
      if (!hides_ring(g, steps, ring, within_m, risen_m)) return false;
    }
    if (sector == last_sector) return true;
  }
}

}  // namespace scarp
