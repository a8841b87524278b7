#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"
#include "core/terrain/occluder.h"
#include "core/terrain/tile_scheme.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"

namespace scarp {

/// The ground that one tile is seen against. Not a height field: pieces of different levels lie
/// over each other where they meet, and do not touch.
struct TileView {
  Tin tin;
  std::size_t own_triangles = 0;  ///< these come first, in the tile's own order
};

/// What a tile sees: itself and the tiles around it at full detail, welded, and occluders of ever
/// coarser levels for the rest of the scene, welded by level, without what finer tiles hold.
///
/// @param seen  scheme.seen_from(tile) in its order, the tile itself first: meshes of the finest
///              level, occluders of the others. Those that have no triangle may be left out, but
///              not the tile itself
/// All of it lies on or under the finest meshes, in its own tile on them.
/// Cost: O(n), and O(b log b) for b border vertices.
TileView view_of_tile(const TileScheme& scheme, std::span<const SeenTile> seen);

/// Regions of the groups of one tile against all of the scene: certify_groups with the tile's view.
///
/// @param group_of_triangle  [view.own_triangles], kNone for orphans
/// Side: what the regions hide is hidden by the finest meshes of the scene. Of two scenes that
/// differ in tile size neither need hide more. In a scene of one tile, what certify_groups gives,
/// bit for bit. Requires groups that have a triangle. The same bits for any number of threads.
/// Cost: per triangle of the tile as certify_groups of a whole scene, about a third more than of
/// the tile alone, because there is more to see; and for each fan about 10 ns a vertex of the view.
CertifiedRegions certify_tile(const TileView& view, std::span<const GroupIndex> group_of_triangle,
                              std::uint32_t groups, const HidingOptions& options = {},
                              const Progress& progress = {});

}  // namespace scarp
