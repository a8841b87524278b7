#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"
#include "core/occlusion/groups.h"
#include "core/terrain/occluder.h"
#include "core/terrain/sample_grid.h"
#include "core/terrain/tile_scheme.h"
#include "ingest/mesh/mesh.h"

namespace scarp::test {

/// How a raster becomes a scene of tiles in memory.
struct TiledOptions {
  std::int32_t tile_samples = 32;
  double max_error_m = 1;
  std::uint32_t group_triangles = 16;
  HidingOptions hiding = {};
  bool all_detail = false;  ///< tiles see all of the finest level instead of what tiles see
};

/// One tile of the finest level with its groups.
struct TileOfScene {
  TileId id;
  std::uint32_t groups = 0;
  CertifiedRegions regions;
  /// [groups] triangles of the whole surface.
  std::vector<std::vector<TriangleIndex>> members;
  std::size_t seen_triangles = 0;  ///< of its view
};

/// A scene of tiles, and its finest surface as one.
struct TiledScene {
  TileScheme scheme;
  Tin whole;
  std::vector<TileOfScene> tiles;  ///< of the finest level, those with ground
  std::map<TileId, Mesh> meshes;   ///< of all levels
  std::map<TileId, Occluder> occluders;
  std::map<TileId, SurfaceGap> gaps;  ///< of coarser levels, from the finest
};

TiledScene tiled_scene(const SampleGrid& raster, const TiledOptions& options);

/// The scene before groups are certified: meshes, occluders and the whole.
TiledScene tiled_ground(const SampleGrid& raster, const TiledOptions& options);

}  // namespace scarp::test
