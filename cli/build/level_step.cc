#include <algorithm>

#include "cli/build/finest_tiles.h"
#include "cli/build/step_run.h"
#include "cli/loaded_scene.h"
#include "core/terrain/occluder.h"
#include "core/terrain/range_pyramid.h"
#include "ingest/mesh/tile_mesh.h"
#include "tiles/store/range_file.h"
#include "tiles/store/samples_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

/// The samples of a coarse tile with its halo, put together from those that finer tiles left.
SampleGrid window_from_finer(StepRun& run) {
  const TileScheme& scheme = run.plan().scheme;
  const TileWindow window = scheme.window_with_halo(run.tile());
  SampleGrid grid;
  grid.columns = window.columns;
  grid.rows = window.rows;
  const std::size_t count =
      static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows);
  grid.positions.resize(count);
  grid.known.assign(count, 0);
  grid.void_cells.assign(count, 1);
  for (const TileId& finer : scheme.finer_around(run.tile())) {
    const SampleGrid part = read_samples(*run.open(samples_file_name(finer)));
    const TileWindow from = scheme.window(finer);
    grid.cell_x_m = part.cell_x_m;
    grid.cell_y_m = part.cell_y_m;
    grid.bend_cells = part.bend_cells;
    for (std::int32_t r = 0; r < part.rows; ++r) {
      for (std::int32_t c = 0; c < part.columns; ++c) {
        const std::int32_t column =
            (from.first_column + c * window.stride - window.first_column) / window.stride;
        const std::int32_t row =
            (from.first_row + r * window.stride - window.first_row) / window.stride;
        if (from.first_column + c * window.stride < window.first_column ||
            from.first_row + r * window.stride < window.first_row || column >= window.columns ||
            row >= window.rows)
          continue;
        const std::size_t to = grid.index(column, row), at = part.index(c, r);
        grid.positions[to] = part.positions[at];
        grid.known[to] = part.known[at];
        // A cell is its own tile's: another one sees its upper left sample only.
        if (c + 1 < part.columns && r + 1 < part.rows) grid.void_cells[to] = part.void_cells[at];
      }
    }
  }
  return grid;
}

/// Surfaces of the tiles under a coarse one and beside those: their meshes, or what hides of them.
/// Of the twelve beside, only what the coarse tile's edges run over stays in memory.
class FinerGround {
 public:
  FinerGround(StepRun& run, bool occluders) {
    const TileScheme& scheme = run.plan().scheme;
    const TileWindow window = scheme.window_with_halo(run.tile());
    for (const TileId& id : scheme.finer_around(run.tile())) {
      const auto file =
          run.open(occluders ? occluder_file_name(id) : tile_file_name(name_of(id), "tin"));
      if (!file) continue;
      ids_.push_back(id);
      meshes_.push_back(read_sampled_tin(*file));
      SampledTin& mesh = meshes_.back();
      if (scheme.parent(id) == run.tile()) continue;
      Occluder near =
          reaching_into({id, &mesh.tin, mesh.sample_of_vertex}, scheme.columns(), window);
      mesh = {std::move(near.tin), std::move(near.sample_of_vertex)};
    }
  }

  std::vector<SeenTile> tiles() const {
    std::vector<SeenTile> tiles;
    for (std::size_t i = 0; i < ids_.size(); ++i)
      tiles.push_back({ids_[i], &meshes_[i].tin, meshes_[i].sample_of_vertex});
    return tiles;
  }

 private:
  std::vector<TileId> ids_;
  std::vector<SampledTin> meshes_;
};

/// How far the levels under a tile have gathered to lie from the finest.
SurfaceGap gap_of_children(const StepRun& run) {
  SurfaceGap gathered;
  for (const TileId& child : run.plan().scheme.children(run.tile())) {
    const nlohmann::json facts = run.facts_of(StepKind::kLevel, child);
    if (!facts.contains("above_m")) continue;
    gathered.above_m = std::max(gathered.above_m, facts["above_m"].get<double>());
    gathered.below_m = std::max(gathered.below_m, facts["below_m"].get<double>());
  }
  return gathered;
}

/// The occluder of a tile, with how far its mesh lies from the finest level: under the finest
/// meshes both are found at once, higher up meshes are compared with meshes and lowered under
/// occluders.
Occluder occluder_and_gap(StepRun& run, const SeenTile& coarse) {
  const TileScheme& scheme = run.plan().scheme;
  if (coarse.id.level + 1 == scheme.finest_level())
    return occluder_of(scheme, coarse, FinerGround(run, false).tiles());
  const SurfaceGap gap = gap_of(scheme, coarse, FinerGround(run, false).tiles());
  const SurfaceGap gathered = gap_of_children(run);
  Occluder occluder = occluder_of(scheme, coarse, FinerGround(run, true).tiles());
  occluder.gap = {gap.above_m + gathered.above_m, gap.below_m + gathered.below_m};
  return occluder;
}

}  // namespace

void level_of_tile(StepRun& run) {
  const BuildPlan& plan = run.plan();
  const TileId tile = run.tile();
  run.part("levels", [&](const Progress& progress) {
    SampleGrid grid = window_from_finer(run);
    const Mesh mesh = mesh_tile(plan.scheme, tile, grid,
                                {.max_error_m = plan.max_error_m_of(tile.level)}, progress);
    if (tile.level > 0) hand_on_samples(run, grid);
    if (mesh.tin.triangles.empty()) return;
    run.facts = facts_of_mesh(mesh);
    run.make(tile_file_name(name_of(tile), "tin"), "tin", [&](const std::string& path) {
      write_compact_tin(path, mesh.tin, mesh.sample_of_vertex, plan.scheme.columns(),
                        vertex_heights_m(mesh.tin, *run.open_source().dem().frame),
                        Existing::kReplace);
    });
    grid = {};
    const Occluder occluder = occluder_and_gap(run, {tile, &mesh.tin, mesh.sample_of_vertex});
    run.facts["above_m"] = occluder.gap.above_m;
    run.facts["below_m"] = occluder.gap.below_m;
    if (occluder.tin.triangles.empty()) return;
    run.make(occluder_file_name(tile), "occluder", [&](const std::string& path) {
      write_tin(path, occluder.tin, occluder.sample_of_vertex, Existing::kReplace);
    });
  });
}

void ranges_of_scene(StepRun& run) {
  const TileScheme& scheme = run.plan().scheme;
  run.part("ranges", [&](const Progress&) {
    std::vector<TileRanges> finer;
    for (const TileId& tile : scheme.tiles(scheme.finest_level())) {
      finer.push_back(read_ranges(*run.open(tile_file_name(name_of(tile), "range"))));
    }
    for (std::int32_t level = scheme.finest_level() - 1; level >= 0; --level) {
      std::vector<TileRanges> coarser;
      for (const TileId& tile : scheme.tiles(level)) {
        std::vector<QuarterRanges> quarters;
        for (const TileId& child : scheme.children(tile))
          quarters.push_back({child, &finer[scheme.number_of(child)]});
        coarser.push_back(joined(scheme, tile, quarters));
        run.make(tile_file_name(name_of(tile), "range"), "range", [&](const std::string& path) {
          write_ranges(path, coarser.back(), Existing::kReplace);
        });
      }
      finer = std::move(coarser);
    }
    if (run.plan().options.observer) {  // there may be no such place: before the long work
      FinestTiles tiles(run);
      const MapPoint at = place_observer(tiles, run.plan().options, *run.open_source().dem().frame);
      run.facts["observer"] = {at.x, at.y, at.height_m};
    }
  });
}

}  // namespace scarp
