#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <vector>

#include "core/terrain/coarse_samples.h"
#include "core/terrain/tile_scheme.h"
#include "core/terrain/weld.h"
#include "ingest/mesh/tile_mesh.h"

namespace scarp::test {

/// A part of a grid that is every stride-th sample of a raster already.
inline SampleGrid part_of(const SampleGrid& grid, const TileWindow& window) {
  SampleGrid part;
  part.columns = window.columns;
  part.rows = window.rows;
  part.cell_x_m = grid.cell_x_m;
  part.cell_y_m = grid.cell_y_m;
  part.bend_cells = grid.bend_cells;
  for (std::int32_t r = 0; r < window.rows; ++r)
    for (std::int32_t c = 0; c < window.columns; ++c) {
      const std::size_t i =
          grid.index(window.first_column / window.stride + c, window.first_row / window.stride + r);
      part.positions.push_back(grid.positions[i]);
      part.known.push_back(grid.known[i]);
      if (!grid.void_cells.empty()) part.void_cells.push_back(grid.void_cells[i]);
    }
  return part;
}

/// The meshes of one level of a scene, and all of them as one.
struct TiledLevel {
  SampleGrid grid;  ///< of the level
  std::map<TileId, Mesh> tiles;
  Mesh whole;  ///< sample_of_vertex in samples of `grid`, rising
};

/// Vertices in the order of their samples.
inline void sort_vertices(Mesh& mesh) {
  std::vector<VertexIndex> order(mesh.tin.vertices.size()), place(order.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](VertexIndex a, VertexIndex b) {
    return mesh.sample_of_vertex[a] < mesh.sample_of_vertex[b];
  });
  Mesh sorted = mesh;
  for (VertexIndex v = 0; v < order.size(); ++v) {
    place[order[v]] = v;
    sorted.tin.vertices[v] = mesh.tin.vertices[order[v]];
    sorted.sample_of_vertex[v] = mesh.sample_of_vertex[order[v]];
  }
  for (auto& corners : sorted.tin.triangles)
    for (VertexIndex& v : corners) v = place[v];
  mesh = std::move(sorted);
}

inline TiledLevel mesh_level(const SampleGrid& raster, const TileScheme& scheme, std::int32_t level,
                             const MeshOptions& options) {
  TiledLevel made;
  const std::int32_t stride = scheme.stride(level);
  made.grid = coarsened(raster, stride);
  std::vector<const Tin*> parts;
  std::vector<std::int64_t> samples;
  for (const TileId& tile : scheme.tiles(level)) {
    const SampleGrid window = part_of(made.grid, scheme.window_with_halo(tile));
    const Mesh& mesh =
        made.tiles.emplace(tile, mesh_tile(scheme, tile, window, options, {})).first->second;
    parts.push_back(&mesh.tin);
    samples.insert(samples.end(), mesh.sample_of_vertex.begin(), mesh.sample_of_vertex.end());
    made.whole.lost_samples += mesh.lost_samples;
    made.whole.error_over_surface_m =
        std::max(made.whole.error_over_surface_m, mesh.error_over_surface_m);
    made.whole.cell_ambiguity_m = std::max(made.whole.cell_ambiguity_m, mesh.cell_ambiguity_m);
  }
  Welded welded = weld(parts);
  made.whole.tin = std::move(welded.tin);
  made.whole.sample_of_vertex.resize(made.whole.tin.vertices.size());
  for (std::size_t v = 0; v < samples.size(); ++v) {
    const std::int64_t column = samples[v] % raster.columns / stride;
    const std::int64_t row = samples[v] / raster.columns / stride;
    made.whole.sample_of_vertex[welded.vertex_of[v]] = row * made.grid.columns + column;
  }
  sort_vertices(made.whole);
  return made;
}

}  // namespace scarp::test
