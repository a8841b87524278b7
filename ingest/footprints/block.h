#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "ingest/footprints/geos_session.h"

namespace scarp {

/// A footprint in the plane, valid and cut to the ground, with the level of its roof in metres
/// above the height datum of the data.
struct Standing {
  GeosSession::Geometry outline;
  PlaneBox box;
  double level_m = 0;
};

/// The corners of one block of buildings and the edges between them.
struct Block {
  std::vector<PlanePoint> points;  ///< all different
  std::vector<double> levels_m;    ///< [points] of the roof there, NaN on the ground
  std::vector<std::array<std::uint32_t, 2>> edges;  ///< meet only in their ends
  std::vector<PlanePolygon> covered;                ///< the buildings grown by a wall's run
  std::uint32_t buildings = 0;
  std::uint32_t slivers = 0;  ///< pieces and gaps given to what surrounds them
};

/// Finest lattice that the lines of a block are rounded to, as a part of a wall's run. Snapping to
/// it keeps corners about half a step away from edges that they are not part of.
inline constexpr double kBlockGridRuns = 1.0 / 16;

/// Corners of footprints are rounded to this part of a wall's run, so that outlines drawn twice
/// with small differences become one.
inline constexpr double kCornerGridRuns = 1.0 / 2;

/// Cuts overlapping footprints into pieces of one level each (the higher wins), unites touching
/// pieces of equal level, gives slivers to their neighbours, and lays the edge of each roof a run
/// inside its walls. A wall between two roofs has its foot on the lower one.
///
/// Throws GeosFailure. Cost: dominated by overlays, O(n log n) corners.
Block build_block(const GeosSession& geos, std::span<const Standing* const> standing, double run_m);

}  // namespace scarp
