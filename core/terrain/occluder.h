#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/terrain/tile_scheme.h"
#include "core/terrain/tin.h"

namespace scarp {

/// How far a coarse surface lies from a finer one where it has ground over it, vertical distances
/// in flattened space, metres, rounded up. 0 where there is none.
struct SurfaceGap {
  double above_m = 0;  ///< greatest height of the coarse surface above the finer one
  double below_m = 0;  ///< the reverse
};

/// Compares two surfaces everywhere: their difference is linear over each piece of the overlay of
/// their triangles, so it is greatest at corners of that.
/// Requires neighbours of both. Accuracy: never less than the truth; more by at most kGapRoundingM.
/// Cost: O(triangles of both), about 1 us each where the coarse one has the larger triangles.
SurfaceGap measure_gap(const Tin& coarse, const Tin& finer);

/// What is added to a gap for the rounding of heights in double. Far more than it: a height errs by
/// about 2^-52 of a coordinate times the slope.
inline constexpr double kGapRoundingM = 0x1p-10;

/// A surface of a coarser level that stands for true ground as far as it hides: nowhere above it,
/// and with no ground where that has none.
struct Occluder {
  Tin tin;
  /// [vertices] as Mesh::sample_of_vertex, rising.
  std::vector<std::int64_t> sample_of_vertex;
  SurfaceGap gap = {};  ///< of lower_under: how far the surface lay from the finer one before
};

/// Lowers the vertices of a coarse surface, each as far as the triangles around it demand, until it
/// lies nowhere above a finer one, and leaves out triangles that are not wholly over ground of the
/// finer one (such are the shreds along borders of bent grids).
///
/// So, from the finest level on: the meshes of a tile's children, or the occluders that were made
/// of those, welded, are the finer surface; the result is under the finest meshes again.
///
/// @param sample_of_vertex  of the coarse surface, kept for the vertices that are left
/// Side: never above the finer surface. Heights stay on the lattice.
/// Requires neighbours of both; a finer surface that covers what the tile covers, but for void.
/// Cost: as measure_gap.
Occluder lower_under(const Tin& coarse, std::span<const std::int64_t> sample_of_vertex,
                     const Tin& finer);

/// Names a place where a surface lies above another, or has ground where that has none; nothing
/// where it is nowhere above it. Decided exactly, at every corner of the overlay of the triangles.
/// Requires neighbours of both. Cost: as measure_gap.
std::optional<std::string> check_under(const Tin& lower, const Tin& upper);

/// A tile's surface: its mesh at the finest level, its mesh or its occluder at coarser ones.
struct SeenTile {
  TileId id;
  const Tin* tin = nullptr;
  std::span<const std::int64_t> sample_of_vertex = {};
};

/// The occluder of a tile.
/// @param coarse  the tile's mesh
/// @param finer   scheme.finer_around(coarse.id) in its order, meshes of the finest level or
///                occluders; those that have no triangle may be left out. The ones beside the tile
///                matter where grid lines bend or samples are rounded: its edges run over them.
///                Of those, what reaches into the tile's window with its halo is enough
/// Side, cost: as lower_under.
Occluder occluder_of(const TileScheme& scheme, const SeenTile& coarse,
                     std::span<const SeenTile> finer);

/// How far a tile's mesh lies from those of the next finer level, given in the same way but always
/// meshes. From the finest it lies no farther than this and the greatest of its children together.
SurfaceGap gap_of(const TileScheme& scheme, const SeenTile& coarse,
                  std::span<const SeenTile> finer);

/// The part of a surface whose triangles reach into a rectangle of the raster, by their boxes.
/// @param columns  of the raster
Occluder reaching_into(const SeenTile& tile, std::int32_t columns, const TileWindow& window);

/// The part of a surface that is not wholly within a rectangle of the raster: what finer tiles hold
/// need not be seen twice.
/// @param columns  of the raster
Occluder outside(const SeenTile& tile, std::int32_t columns, const TileWindow& covered);

}  // namespace scarp
