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
/// last one not beyond the camera's ring counts; where fewer are needed, the last repeats. A step
/// is ring << 10 | code. Code 0: nothing is hidden; otherwise the group is hidden from a camera
/// strictly under height_m + (low_slope + (code - 1) * slope_step) * distance from the centre.
using SectorSteps = std::array<std::uint16_t, 8>;

/// So many different steps the sectors of a group have at most in the mean. They are shared out to
/// where they hide most: eight in every sector would take more than twice the bytes, and hide next
/// to nothing more.
inline constexpr double kMeanSteps = 3.75;

/// What the regions of a group take where they are kept, packed (tiles/store/groups_file.h): bytes,
/// an eighth more than was measured on real ground. Wider sectors have less in common.
double kept_group_bytes(std::int32_t sectors);

/// Where cameras are hidden from groups for certain. Side: never larger than the truth; what it
/// hides is hidden, which follows from the surface alone (hiding_bounds.h) and not from horizons of
/// vertices. In memory 16 bytes for each sector and 40 for each group.
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

/// The code that a sector's steps have in a ring. Counted without branches, which would be guessed
/// wrong half of the time; rings do not fall from step to step.
inline std::int32_t code_in(const SectorSteps& steps, std::int32_t ring) {
  const auto last_of_ring = static_cast<std::uint16_t>(ring << kSlopeBits | (kSlopeCodes - 1));
  std::uint16_t count = 0;
  for (const std::uint16_t step : steps)
    count = static_cast<std::uint16_t>(count + (step <= last_of_ring));
  return count > 0 ? steps[count - 1U] & (kSlopeCodes - 1) : 0;
}

/// Whether a sector's steps hide the group from a camera in `ring`, at a distance from the centre
/// and a height above the group's. The test that everything at run time comes down to.
inline bool hides_at(const CertifiedGroup& group, const SectorSteps& steps, std::int32_t ring,
                     float distance_m, float rise_m) {
  const std::int32_t code = code_in(steps, ring);
  const float line_m = slope_of(group, code) * distance_m;
  const float margin_m = (std::abs(rise_m) + std::abs(line_m)) * kHeightRounding;
  return code > 0 && rise_m < line_m - margin_m;
}

/// Whether the whole group is hidden from a camera. The definition, for one group; the culling
/// method certified is the same for many. A camera within the group's circle is not.
bool hides_group(const CertifiedRegions& regions, std::uint32_t group, const Position& eye);

/// Sectors for which the regions of groups with `triangles` in all take about `bytes` a triangle
/// where they are kept, packed; less on nearly all ground.
/// @return a multiple of 8, at least 8, at most 4096
std::int32_t sectors_within(double bytes, std::size_t triangles, std::uint32_t groups);

/// Names the first broken invariant, or nothing: sizes; a proper layout; finite numbers, radius
/// above zero; rings that rise within a sector, except that steps may repeat.
std::optional<std::string> check_certified(const CertifiedRegions& regions);

}  // namespace scarp
