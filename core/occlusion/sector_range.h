#pragma once

#include "core/horizon/sectors.h"

namespace scarp {

/// Azimuths in the plane from one to another, counter-clockwise from +x, both ends included.
/// Requires from_rad <= to_rad, both within +-8 pi; everything where they are 2 pi apart.
struct AzimuthArc {
  double from_rad;
  double to_rad;
};

/// What arcs are widened by before they are compared: more than the rounding of an arc tangent,
/// an arc sine and their sum (a few 2^-51), less than anything on the lattice can tell at 1000 km.
inline constexpr double kAzimuthRoundingRad = 0x1p-45;

/// Consecutive sectors, counter-clockwise, modulo layout.count.
struct SectorRange {
  std::int32_t first;
  std::int32_t count;

  bool holds(const SectorLayout& layout, std::int32_t sector) const {
    return (sector - first + layout.count) % layout.count < count;
  }
};

/// All sectors that an arc touches; a sector's ends belong to it, so that an azimuth on a border
/// has two. Side: never too few.
SectorRange sectors_touching(const SectorLayout& layout, const AzimuthArc& arc);

/// The one or two sectors that hold a direction. Requires a direction that is not zero.
SectorRange sectors_towards(const SectorLayout& layout, double x, double y);

/// Whether two arcs have an azimuth in common. Side: yes where it is too close to tell.
bool arcs_overlap(const AzimuthArc& a, const AzimuthArc& b);

}  // namespace scarp
