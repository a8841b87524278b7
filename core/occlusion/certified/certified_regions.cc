#include "core/occlusion/certified/certified_regions.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {

bool hides_group(const CertifiedRegions& regions, std::uint32_t group, const Position& eye) {
  assert(group < regions.groups.size());
  const CertifiedGroup& g = regions.groups[group];
  const auto x_m = static_cast<float>(eye.x_m - g.centre_x_m);
  const auto y_m = static_cast<float>(eye.y_m - g.centre_y_m);
  const float square_m2 = x_m * x_m + y_m * y_m;
  const float ring_square = square_m2 / (g.radius_m * g.radius_m);
  if (!(ring_square >= 1)) return false;
  return hides_at(g, regions.at(group, sector_of(regions.layout, x_m, y_m)),
                  ring_of(regions.layout, ring_square), std::sqrt(square_m2),
                  static_cast<float>(eye.z_m - g.height_m));
}

double kept_group_bytes(std::int32_t sectors) {
  constexpr double kPlace = 36, kOfOne = 10.75, kInCommon = 0.69;  // for each doubling
  return kPlace + sectors * (kOfOne - kInCommon * std::log2(sectors));
}

std::int32_t sectors_within(double bytes, std::size_t triangles, std::uint32_t groups) {
  const double each = bytes * static_cast<double>(triangles) / std::max(1U, groups);
  std::int32_t sectors = 8;
  while (sectors < 4096 && kept_group_bytes(sectors + 8) <= each) sectors += 8;
  return sectors;
}

std::optional<std::string> check_certified(const CertifiedRegions& regions) {
  const PolarLayout& layout = regions.layout;
  if (layout.sectors < 8 || layout.sectors > 4096 || layout.sectors % 8 != 0)
    return "sectors are not a multiple of 8 from 8 to 4096";
  if (layout.ring_bits < 2 || layout.ring_bits > 3) return "ring bits are not 2 or 3";
  if (regions.steps.size() != regions.groups.size() * static_cast<std::size_t>(layout.sectors))
    return "there is not one row of steps for each group and sector";
  for (std::size_t g = 0; g < regions.groups.size(); ++g) {
    const CertifiedGroup& group = regions.groups[g];
    if (!std::isfinite(group.centre_x_m) || !std::isfinite(group.centre_y_m) ||
        !std::isfinite(group.height_m) || !std::isfinite(group.radius_m) || !(group.radius_m > 0) ||
        !std::isfinite(group.low_slope) || !std::isfinite(group.slope_step) ||
        !(group.slope_step >= 0))
      return "group " + std::to_string(g) + " has no proper circle, height or slopes";
    for (std::int32_t s = 0; s < layout.sectors; ++s) {
      const SectorSteps& steps = regions.at(static_cast<std::uint32_t>(g), s);
      for (std::size_t i = 1; i < steps.size(); ++i)
        if (steps[i] >> kSlopeBits < steps[i - 1] >> kSlopeBits)
          return "rings of group " + std::to_string(g) + ", sector " + std::to_string(s) + " fall";
    }
  }
  return {};
}

}  // namespace scarp
