#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// How the directions around a point are divided in the flattened plane. Sector i holds the
/// azimuths [i, i + 1] * 2 pi / count, counter-clockwise from +x, both ends included. Each is
/// looked at in `subsectors` equal parts, of which the lowest horizon is kept.
/// Requires count >= 4 and subsectors >= 1, so that no part reaches pi / 2.
struct SectorLayout {
  std::int32_t count = 16;
  std::int32_t subsectors = 4;

  friend bool operator==(const SectorLayout&, const SectorLayout&) = default;
};

/// Middle direction of a sector: a unit vector in the plane. Distances in the sector's plane are
/// measured along it ("u"), so that points anywhere in the sector count as if on its middle line.
struct SectorAxis {
  double x;
  double y;
};
SectorAxis sector_axis(const SectorLayout& layout, std::int32_t sector);

/// Horizon of every vertex in every sector, as the vertex that makes it.
struct HorizonTable {
  SectorLayout layout;
  /// [vertices * layout.count], kNone where some subsector holds no vertex: nothing is hidden
  /// there as far as the vertices tell.
  std::vector<VertexIndex> horizon_vertex;

  VertexIndex at(VertexIndex vertex, std::int32_t sector) const {
    return horizon_vertex[static_cast<std::size_t>(vertex) *
                              static_cast<std::size_t>(layout.count) +
                          static_cast<std::size_t>(sector)];
  }
};

/// A table in which no vertex has a horizon in any of four sectors: nothing is hidden as far as it
/// tells. For groups whose regions are not made from horizons of vertices.
HorizonTable no_horizons(std::size_t vertices);

}  // namespace scarp
