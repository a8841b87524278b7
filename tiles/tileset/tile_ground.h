#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"
#include "tiles/gltf/terrain_glb.h"
#include "tiles/tileset/tileset_frame.h"

namespace scarp {

/// What a tileset says of a tile, besides its mesh.
struct TileFacts {
  TileBox box;  ///< holds its ground, and that of all tiles below it
  /// Heights above the ellipsoid, metres, of whole triangles.
  double least_height_m = 0;
  double greatest_height_m = 0;
};

/// Directions in which the ground around vertices on tiles' borders points, each triangle counting
/// by its area, summed over the tiles of a level: neighbours then have the same normals where they
/// meet, and no seam shows. By the vertices' positions in the scene's frame.
using BorderNormals = std::map<std::array<double, 3>, TilePoint>;

/// What one tile adds. Summed in the order of tiles, sums are the same bits however they are made.
/// Memory: some 100 bytes a vertex on the border.
BorderNormals border_normals(const Tin& tin, std::span<const EcefPoint> ecef,
                             const TilesetFrame& frame, double step_m);

/// A tile's ground in the axes of the tileset, for terrain_glb: vertices are of whole steps;
/// triangles lie group by group, those of no group last, within a group in an order that vertex
/// caches like; vertices of two groups are there twice, because each tells its group.
///
/// @param ecef         [vertices of the tin] EPSG:4978
/// @param groups       of the tile, or null where it has none
/// @param first_group  number in the scene of the tile's group 0
/// @param step_m       of the level (step_for)
/// @param around       of all tiles of the level, or empty: borders then have the tile's own
/// normals Requires a triangle, and that the tile reaches no farther than kFloatSteps steps
/// (asserted). Accuracy: step_m / 2 in each coordinate. Cost: O(n). Errors: none.
TerrainMesh tile_ground(const Tin& tin, std::span<const EcefPoint> ecef, const TilesetFrame& frame,
                        const Groups* groups, GroupIndex first_group, double step_m,
                        const BorderNormals& around = {});

/// Box and heights of a tile's ground. Side: heights bracket those of every point of its triangles.
TileFacts tile_facts(const Tin& tin, std::span<const EcefPoint> ecef, const TilesetFrame& frame,
                     double step_m);

/// Facts that hold for several tiles: one and those below it. Requires a tile.
TileFacts facts_of_all(const TilesetFrame& frame, std::span<const TileFacts> tiles);

}  // namespace scarp
