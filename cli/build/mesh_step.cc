#include <algorithm>

#include "cli/build/step_run.h"
#include "cli/loaded_scene.h"
#include "core/terrain/coarse_samples.h"
#include "core/terrain/range_pyramid.h"
#include "ingest/footprints/footprints.h"
#include "ingest/mesh/mesh_walls.h"
#include "ingest/mesh/tile_mesh.h"
#include "tiles/store/range_file.h"
#include "tiles/store/samples_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

using nlohmann::json;

SampleRect rect_of(const TileWindow& window) {
  return {window.first_column, window.first_row, window.columns, window.rows};
}

/// The raster in one piece: buildings and budgets of vertices are for that only.
Mesh mesh_of_raster(StepRun& run, const DemWindows& source, HeightWindow heights,
                    const SampleGrid& grid, const Progress& progress) {
  const BuildOptions& options = run.plan().options;
  MeshOptions mesh_options;
  if (options.vertices)
    mesh_options.vertex_budget = options.vertices;
  else
    mesh_options.max_error_m = run.plan().max_error_m;
  WallsAndRoofs walls;
  if (!options.footprints_file.empty()) {
    Dem dem = source.dem();
    dem.heights_m = std::move(heights.heights_m);
    dem.known = std::move(heights.known);
    std::vector<std::string> warnings;
    walls = add_footprints(dem, grid, options.footprints_file, options.footprints_height_field,
                           run.plan().max_error_m, warnings);
    run.facts["warnings"] = warnings;
  }
  return mesh_with_walls(grid, mesh_options, walls, progress);
}

/// The part of a window that a tile holds itself, and its last row and column only where no tile
/// follows: what is counted once in the scene.
struct OwnSamples {
  std::int32_t first_column, first_row, end_column, end_row;  // in the window
};
OwnSamples own_samples(const TileScheme& scheme, const TileId& tile) {
  const TileWindow own = scheme.window(tile), halo = scheme.window_with_halo(tile);
  const std::int32_t left = own.first_column - halo.first_column;
  const std::int32_t above = own.first_row - halo.first_row;
  return {left, above, left + own.columns - (own.last_column() + 1 < scheme.columns() ? 1 : 0),
          above + own.rows - (own.last_row() + 1 < scheme.rows() ? 1 : 0)};
}

json counts_of_samples(const TileScheme& scheme, const TileId& tile, const SampleGrid& grid) {
  const OwnSamples own = own_samples(scheme, tile);
  std::uint64_t known = 0, ground = 0;
  for (std::int32_t row = own.first_row; row < own.end_row; ++row) {
    for (std::int32_t column = own.first_column; column < own.end_column; ++column) {
      known += grid.is_known(column, row) ? 1 : 0;
      ground += grid.is_ground_cell(column, row) ? 1 : 0;
    }
  }
  return {{"known_samples", known}, {"ground_cells", ground}};
}

/// A sample of the window with the tile's own edges, for the tiles above.
SampleGrid without_halo(const TileScheme& scheme, const TileId& tile, const SampleGrid& grid) {
  const TileWindow own = scheme.window(tile), halo = scheme.window_with_halo(tile);
  const std::int32_t left = (own.first_column - halo.first_column) / own.stride;
  const std::int32_t above = (own.first_row - halo.first_row) / own.stride;
  SampleGrid part;
  part.columns = own.columns;
  part.rows = own.rows;
  part.cell_x_m = grid.cell_x_m;
  part.cell_y_m = grid.cell_y_m;
  part.bend_cells = grid.bend_cells;
  for (std::int32_t row = 0; row < own.rows; ++row) {
    for (std::int32_t column = 0; column < own.columns; ++column) {
      const std::size_t from = grid.index(left + column, above + row);
      part.positions.push_back(grid.positions[from]);
      part.known.push_back(grid.known[from]);
      if (!grid.void_cells.empty()) part.void_cells.push_back(grid.void_cells[from]);
    }
  }
  return part;
}

/// Where the scene's own viewshed may be looked from: the highest vertex.
json highest_vertex(const Tin& tin, const GeoFrame& frame) {
  const std::vector<double> heights_m = vertex_heights_m(tin, frame);
  const auto highest = static_cast<std::size_t>(
      std::max_element(heights_m.begin(), heights_m.end()) - heights_m.begin());
  const MapPoint at = GeoFrame::Placer(frame).unplace(tin.vertices[highest]);
  return {at.x, at.y, at.height_m};
}

}  // namespace

json facts_of_mesh(const Mesh& mesh) {
  const Bounds bounds = bounds_of(mesh.tin.vertices);
  return {{"vertices", mesh.tin.vertices.size()},
          {"triangles", mesh.tin.triangles.size()},
          {"low", {bounds.low.x_m, bounds.low.y_m, bounds.low.z_m}},
          {"high", {bounds.high.x_m, bounds.high.y_m, bounds.high.z_m}},
          {"error_at_samples_m", mesh.error_at_samples_m},
          {"error_over_surface_m", mesh.error_over_surface_m},
          {"cell_ambiguity_m", mesh.cell_ambiguity_m}};
}

void hand_on_samples(StepRun& run, const SampleGrid& window) {
  const SampleGrid coarse = coarsened(without_halo(run.plan().scheme, run.tile(), window), 2);
  run.make(samples_file_name(run.tile()), "samples",
           [&](const std::string& path) { write_samples(path, coarse, Existing::kReplace); });
}

void mesh_of_tile(StepRun& run) {
  const BuildPlan& plan = run.plan();
  const TileId tile = run.tile();
  Mesh mesh;
  run.part("mesh", [&](const Progress& progress) {
    const DemWindows source = run.open_source();
    HeightWindow heights = source.read(rect_of(plan.scheme.window_with_halo(tile)));
    const SampleGrid grid = place_window(source.dem(), heights);
    if (plan.has_one_tile()) {
      mesh = mesh_of_raster(run, source, std::move(heights), grid, progress);
    } else {
      mesh = mesh_tile(plan.scheme, tile, grid, {.max_error_m = plan.max_error_m}, progress);
    }
    run.facts.update(counts_of_samples(plan.scheme, tile, grid));
    run.facts["lost_samples"] = mesh.lost_samples;
    const std::string name = name_of(tile);
    if (!plan.has_one_tile()) {
      run.make(tile_file_name(name, "range"), "range", [&](const std::string& path) {
        write_ranges(path, ranges_of(plan.scheme, tile, grid), Existing::kReplace);
      });
      hand_on_samples(run, grid);
    }
    if (mesh.tin.triangles.empty()) return;
    run.facts.update(facts_of_mesh(mesh));
    run.facts["highest"] = highest_vertex(mesh.tin, *source.dem().frame);
    if (plan.options.observer &&
        plan.has_one_tile())  // there may be no such place: before the long work
      resolve(*plan.options.observer, plan.options.crs, *source.dem().frame, TinIndex(mesh.tin));
    run.make(tile_file_name(name, "tin"), "tin", [&](const std::string& path) {
      if (plan.has_one_tile())
        write_tin(path, mesh.tin, mesh.sample_of_vertex, Existing::kReplace);
      else
        write_compact_tin(path, mesh.tin, mesh.sample_of_vertex, plan.scheme.columns(),
                          vertex_heights_m(mesh.tin, *source.dem().frame), Existing::kReplace);
    });
  });
  run.check_sources();
}

}  // namespace scarp
