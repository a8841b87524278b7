#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/geodesy/position.h"
#include "core/occlusion/certified/polar_cells.h"

namespace scarp {

/// What a region says of one group: where it is, and how its slopes are coded.
struct CertifiedGroup {
  double centre_x_m = 0;
  double centre_y_m = 0;
  double height_m = 0;
  float radius_m = 0;  ///< of its circle, rounded up, times kFirstRing: ring 0 begins there
  float low_slope = 0;
  float slope_step = 0;
};

/// From which ring on which slope hides, for one sector of camera azimuths: by rising ring, the
/// last one not beyond the camera's ring counts. A step is ring << 10 | code. Code 0: nothing is
/// hidden; otherwise the group is hidden from a camera strictly under
/// height_m + (low_slope + (code - 1) * slope_step) * distance from the centre.
using SectorSteps = std::array<std::uint16_t, 4>;

/// Where cameras are hidden from groups for certain. Side: never larger than the truth; what it
/// hides is hidden, which follows from the surface alone (hiding_bounds.h) and not from horizons of
/// vertices. 8 bytes for each sector and 40 for each group.
struct CertifiedRegions {
  PolarLayout layout;
  std::vector<CertifiedGroup> groups;
  std::vector<SectorSteps> steps;  ///< [groups * layout.sectors]

  const SectorSteps& at(std::uint32_t group, std::int32_t sector) const {
    return steps[static_cast<std::size_t>(group) * static_cast<std::size_t>(layout.sectors) +
                 static_cast<std::size_t>(sector)];
  }
};

inline constexpr std::int32_t kSlopeBits = 10;
inline constexpr std::int32_t kSlopeCodes = 1 << kSlopeBits;

/// The slope of a code from 1 on.
inline float slope_of(const CertifiedGroup& group, std::int32_t code) {
  return group.low_slope + static_cast<float>(code - 1) * group.slope_step;
}

/// Relative allowance for the rounding of a float comparison of heights: a distance (four
/// roundings), its product with a slope, a difference, and the float of the camera's height.
inline constexpr float kHeightRounding = 0x1p-20F;

/// Whether a sector's steps hide the group from a camera in `ring`, at a distance from the centre
/// and a height above the group's. The test that everything at run time comes down to.
inline bool hides_at(const CertifiedGroup& group, const SectorSteps& steps, std::int32_t ring,
                     float distance_m, float rise_m) {
  const std::int32_t last_of_ring = ring << kSlopeBits | (kSlopeCodes - 1);
  std::int32_t code = 0;
  for (const std::uint16_t step : steps)
    if (step <= last_of_ring) code = step & (kSlopeCodes - 1);
  const float line_m = slope_of(group, code) * distance_m;
  const float margin_m = (std::abs(rise_m) + std::abs(line_m)) * kHeightRounding;
  return code > 0 && rise_m < line_m - margin_m;
}

/// Whether the whole group is hidden from a camera. The definition, for one group; the culling
/// method certified is the same for many. A camera within the group's circle is not.
bool hides_group(const CertifiedRegions& regions, std::uint32_t group, const Position& eye);

/// Sectors for which the regions of groups with `triangles` in all take at most `bytes` a triangle.
/// @return a multiple of 8, at least 8, at most 4096
std::int32_t sectors_within(double bytes, std::size_t triangles, std::uint32_t groups);

/// Names the first broken invariant, or nothing: sizes; a proper layout; finite numbers, radius
/// above zero; rings that rise within a sector, except that steps may repeat.
std::optional<std::string> check_certified(const CertifiedRegions& regions);

}  // namespace scarp
