#include "tests/judge/tiled_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/occlusion/certified/tile_view.h"
#include "core/occlusion/hidden_together.h"
#include "core/terrain/coarse_samples.h"
#include "core/terrain/weld.h"
#include "ingest/mesh/tile_mesh.h"
#include "tests/ingest/mesh/tiled.h"
#include "tests/support/boundary_search.h"

namespace scarp::test {
namespace {

SeenTile seen_mesh(const TileId& id, const Mesh& mesh) {
  return {id, &mesh.tin, mesh.sample_of_vertex};
}

/// How far a tile's mesh lies from the finest: from the next level, and what that has gathered.
SurfaceGap gap_from_finest(const TiledScene& scene, const TileId& id) {
  std::vector<SeenTile> finer;
  SurfaceGap below;
  for (const TileId& tile : scene.scheme.finer_around(id)) {
    const Mesh& mesh = scene.meshes.at(tile);
    if (!mesh.tin.triangles.empty()) finer.push_back(seen_mesh(tile, mesh));
    if (const auto at = scene.gaps.find(tile); at != scene.gaps.end()) {
      below.above_m = std::max(below.above_m, at->second.above_m);
      below.below_m = std::max(below.below_m, at->second.below_m);
    }
  }
  const SurfaceGap gap = gap_of(scene.scheme, seen_mesh(id, scene.meshes.at(id)), finer);
  return {gap.above_m + below.above_m, gap.below_m + below.below_m};
}

/// What a tile is lowered under: meshes of the finest level, occluders of others.
std::vector<SeenTile> surfaces(const TiledScene& scene, const std::vector<TileId>& tiles) {
  std::vector<SeenTile> found;
  for (const TileId& id : tiles) {
    if (id.level == scene.scheme.finest_level()) {
      const Mesh& mesh = scene.meshes.at(id);
      if (!mesh.tin.triangles.empty()) found.push_back(seen_mesh(id, mesh));
    } else if (const auto at = scene.occluders.find(id); at != scene.occluders.end()) {
      found.push_back({id, &at->second.tin, at->second.sample_of_vertex});
    }
  }
  return found;
}

}  // namespace

TiledScene tiled_ground(const SampleGrid& raster, const TiledOptions& options) {
  TiledScene scene{{raster.columns, raster.rows, options.tile_samples}, {}, {}, {}, {}, {}};
  const TileScheme& scheme = scene.scheme;
  for (std::int32_t level = scheme.finest_level(); level >= 0; --level) {
    const SampleGrid grid = coarsened(raster, scheme.stride(level));
    MeshOptions within;
    within.max_error_m = options.max_error_m * scheme.stride(level);
    for (const TileId& id : scheme.tiles(level)) {
      const SampleGrid window = part_of(grid, scheme.window_with_halo(id));
      scene.meshes[id] = mesh_tile(scheme, id, window, within, {});
    }
    if (level == scheme.finest_level()) continue;
    for (const TileId& id : scheme.tiles(level)) {
      const Mesh& mesh = scene.meshes.at(id);
      if (mesh.tin.triangles.empty()) continue;
      Occluder occluder =
          occluder_of(scheme, seen_mesh(id, mesh), surfaces(scene, scheme.finer_around(id)));
      scene.gaps[id] = gap_from_finest(scene, id);
      if (!occluder.tin.triangles.empty()) scene.occluders.emplace(id, std::move(occluder));
    }
  }
  std::vector<const Tin*> parts;
  for (const TileId& id : scheme.tiles(scheme.finest_level()))
    parts.push_back(&scene.meshes.at(id).tin);
  scene.whole = weld(parts).tin;
  return scene;
}

TiledScene tiled_scene(const SampleGrid& raster, const TiledOptions& options) {
  TiledScene scene = tiled_ground(raster, options);
  TriangleIndex first = 0;  // of the tile, in the whole surface
  for (const TileId& id : scene.scheme.tiles(scene.scheme.finest_level())) {
    const Tin& tin = scene.meshes.at(id).tin;
    if (tin.triangles.empty()) continue;
    HiddenTogetherOptions together;
    together.group_triangles = options.group_triangles;
    const LeafGroups groups = grow_hidden_together(tin, together);
    std::vector<TileId> seen = scene.scheme.seen_from(id);
    if (options.all_detail) {
      seen = scene.scheme.tiles(id.level);
      std::stable_partition(seen.begin(), seen.end(), [&](const TileId& t) { return t == id; });
    }
    const TileView view = view_of_tile(scene.scheme, surfaces(scene, seen));
    TileOfScene tile{id, groups.count, {}, {}, view.tin.triangles.size()};
    tile.regions = certify_tile(view, groups.group_of_triangle, groups.count, options.hiding);
    tile.members = triangles_of_groups(groups.group_of_triangle, groups.count);
    for (auto& members : tile.members)
      for (TriangleIndex& t : members) t += first;
    first += static_cast<TriangleIndex>(tin.triangles.size());
    scene.tiles.push_back(std::move(tile));
  }
  return scene;
}

}  // namespace scarp::test
