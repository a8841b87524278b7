#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
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
  std::int32_t fans = 192;     ///< of directions; a multiple of 8
  std::int32_t sectors = 248;  ///< of camera azimuths around a group
  double piece = 1;  ///< greatest length of what is looked at by itself of a group's border, in
                     ///< mean distances between the group's vertices
  double width =
      0.25;  ///< of strips in which ridges are looked for, in the mean unit of all groups
};

/// For each group, sector of azimuths and ring of distances that a camera can have from the
/// group's centre: a slope such that no place of the group can be seen from a camera strictly
/// under height_m + slope * distance. -infinity where nothing is known to be hidden.
struct HidingBounds {
  PolarLayout layout;
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

/// Bounds all groups. For each fan of directions and each piece of a group's border over which rays
/// of the fan leave the group, planes are found that have all ground of the group behind the piece
/// under them: through the border itself, and through chains of ridges further out that every such
/// ray has to cross. What is strictly under the plane of its ray beyond the edge sees nothing of
/// that ground (EdgePlane, raise_wall). In the vertical plane of a ray this is all there is: a
/// camera sees something of a group exactly where nothing beyond rises above its tangent to the
/// hull of the group's slice.
///
/// Work goes only where a camera over the ground, or near the data, can use a bound (ReachedCells).
///
/// Side: never more than is hidden. The same bits for any number of threads.
/// Requires tin.neighbours, a group or kNone for each triangle, groups that have one.
/// Cost: about fans * 0.7 us a triangle on 16,000 triangles and twice that on 300,000, where rays
/// meet more ridges; 384 bytes for each group and sector.
/// Source: own; supporting planes as in Law and Tan 1999, for one ridge and all of a group's
/// ground.
/// @param own_triangles  of a tile in a scene: these come first, and only they have groups. The
///                       others may be pieces that overlap or do not touch, as long as they lie
///                       nowhere above true ground: an edge is only ever asked to hide what its own
///                       plane hides. Without it all triangles are the tile's own.
HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress = {},
                          std::optional<std::size_t> own_triangles = {});

}  // namespace scarp
