#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/certified/polar_cells.h"
#include "core/occlusion/circle.h"
#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"

namespace scarp {

/// How finely hiding is bounded. Every setting is safe; finer ones find more.
struct HidingOptions {
  std::int32_t fans = 512;     ///< of directions; a multiple of 8
  std::int32_t sectors = 248;  ///< of camera azimuths around a group
  double spacing = 0.5;        ///< of curtains, in mean distances between vertices
  double width = 0.5;          ///< of strips, in the same unit
  double piece = 1.0;          ///< greatest length of a target, in the same unit
};

/// For each group, sector of azimuths and ring of distances that a camera can have from the
/// group's centre: a slope such that no place of the group can be seen from a camera strictly
/// under height_m + slope * distance. -infinity where nothing is known to be hidden.
struct HidingBounds {
  PolarLayout layout;
  double lowest_m = 0;           ///< of the ground
  double highest_m = 0;          ///< of the ground
  std::vector<Circle> circle;    ///< [groups]
  std::vector<double> height_m;  ///< [groups]
  std::vector<float> slope;      ///< [groups * sectors * kRings]

  std::span<const float> at(GroupIndex group, std::int32_t sector) const {
    const std::size_t row =
        static_cast<std::size_t>(group) * static_cast<std::size_t>(layout.sectors) +
        static_cast<std::size_t>(sector);
    return {slope.data() + row * kRings, kRings};
  }
};

HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress = {});

}  // namespace scarp
