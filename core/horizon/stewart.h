#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/geodesy/position.h"
#include "core/horizon/sectors.h"
#include "core/threads/progress.h"

namespace scarp {

/// All-points horizon over vertices (method `stewart`): which vertex makes the horizon of each
/// vertex in each sector.
///
/// Definition, exact. Subsector k of count * subsectors spans the azimuths between its boundary
/// directions a and b, both included. Vertices are projected on the normals of a and b and on the
/// subsector's middle direction (u), each rounded to kProjectionStepM (subsector.h). Vertex q lies
/// in the subsector of p where it is on or left of a, on or right of b and u_q > u_p, by comparing
/// the rounded numbers. The horizon of p there is the q with the greatest (z_q - z_p)/(u_q - u_p);
/// of equal ones the nearest along u, then the lowest index. The sector keeps the subsector whose
/// horizon has the lowest slope, each measured along its own middle direction; of equal ones the
/// first. Where some subsector holds no vertex the sector has no horizon (kNone).
///
/// @param vertices  positions in the flattened frame, lattice metres, at any spacing and in any
///                  order; equal (x, y) are allowed and never hide each other
/// @param layout    see SectorLayout
/// @param progress  told after each subsector
///
/// Side: none. NOT conservative: edges between vertices are not looked at, one number stands for a
/// whole sector, and a subsector is wide where it is far. What it calls hidden may be visible.
/// Requires (asserted): layout.count >= 4, layout.subsectors >= 1.
/// Errors: none. The same bits for any thread count.
/// Cost: O(s n log^2 n) time for s subsectors in all; O(n log n) memory per running subsector at
/// worst. An insertion moves the points of a hull behind it, so hulls of h points add O(h)
/// moved bytes: nothing on terrain, where they have tens of points, noticeable on a smooth dome.
/// Source: Stewart 1998; Edmondson 2004, section 4.5.
HorizonTable stewart_horizons(std::span<const Position> vertices, const SectorLayout& layout,
                              const Progress& progress);

/// The same table by looking at every pair of vertices: the definition above, written out. Same
/// parameters and guarantees; O(s n^2) time, O(n) memory per running sector.
HorizonTable stewart_horizons_exhaustive(std::span<const Position> vertices,
                                         const SectorLayout& layout, const Progress& progress);

/// Names the first broken invariant of a table, or nothing where all hold: one entry for each
/// vertex and sector; every horizon a vertex of the span that lies in one of the sector's
/// subsectors. Whether it is the right one, and whether kNone is right, the exhaustive twin tells.
/// Cost: O(s n), n vertices, s subsectors in all.
std::optional<std::string> check_horizons(std::span<const Position> vertices,
                                          const HorizonTable& table);

}  // namespace scarp
