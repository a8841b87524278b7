#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/circle.h"
#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"

namespace scarp {

/// How finely hiding is bounded. Every setting is safe; finer ones find more.
struct HidingOptions {
  std::int32_t fans = 512;      ///< of directions; a multiple of 8
  std::int32_t sectors = 256;   ///< of camera azimuths around a group
  double spacing = 0.5;         ///< of curtains, in mean distances between vertices
  double width = 0.5;           ///< of strips, in the same unit
  double piece = 1.0;           ///< greatest length of a target, in the same unit
};

/// Rings of camera distances around a group: ring k holds [ratio[k], ratio[k + 1]] times the
/// group's radius, the last one all beyond.
inline constexpr std::int32_t kRings = 64;

/// For each group, sector of azimuths and ring of distances that a camera can have from the
/// group's centre: a slope such that no place of the group can be seen from a camera strictly
/// under height_m + slope * distance. -infinity where nothing is known to be hidden.
struct HidingBounds {
  std::int32_t sectors = 0;
  std::vector<double> ratio;      ///< [kRings] of distances to the radius, rising from above 1
  std::vector<Circle> circle;     ///< [groups]
  std::vector<double> height_m;   ///< [groups]
  std::vector<float> slope;       ///< [groups * sectors * kRings]

  std::span<const float> at(GroupIndex group, std::int32_t sector) const {
    const std::size_t row = static_cast<std::size_t>(group) * static_cast<std::size_t>(sectors) +
                            static_cast<std::size_t>(sector);
    return {slope.data() + row * kRings, kRings};
  }
};

/// Sectors and rings overlap by these: what finds the sector and ring of a camera may err by less.
inline constexpr double kAzimuthOverlapRad = 0x1p-16;
inline constexpr double kDistanceOverlap = 0x1p-16;  ///< relative

HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress = {});

}  // namespace scarp
