#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/culling_source.h"
#include "cli/export.h"
#include "cli/outputs.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "core/culling/view_cells.h"
#include "core/error/error.h"
#include "core/sight/line_of_sight.h"
#include "core/threads/parallel_for.h"
#include "tiles/cells/sets_file.h"
#include "tiles/cells/vdb_file.h"

namespace scarp {
namespace {

/// Eight, so that blocks of the tree are whole.
const std::vector<double> kAltitudesM = {10, 25, 50, 100, 200, 400, 700, 1000};
constexpr double kCellsAcross = 64, kObserverCellsAcross = 128;
constexpr double kMostCellsAcross = 4096;
constexpr std::int32_t kObserverLayers = 64;
constexpr float kNoHeight = -1e9F;

/// What every file tells.
std::map<std::string, std::string> metadata_of(const LoadedScene& scene) {
  std::map<std::string, std::string> metadata;
  write_note(note_of("tin", scene.frame.description()), metadata);
  metadata["CRS"] = scene.scene.description().crs_wkt;
  metadata["MADE_BY"] = scene.scene.description().made_by;
  return metadata;
}

double checked_cell_m(const ExportOptions& options, double widest_m, double across) {
  const double cell_m = options.cell_m.value_or(widest_m / across);
  if (!(widest_m / cell_m <= kMostCellsAcross))
    throw Error(ErrorCode::kInput,
                fmt::format("--cell {:g}: makes {:.0f} cells across; at most {:.0f} were expected; "
                            "give a larger one",
                            cell_m, widest_m / cell_m, kMostCellsAcross));
  return cell_m;
}

/// Highest ground of each column, about; NaN where there is none.
std::vector<double> ground_of_columns(const LoadedScene& scene, const ViewCells& cells) {
  const auto count = static_cast<std::size_t>(cells.columns) * static_cast<std::size_t>(cells.rows);
  std::vector<double> ground_m(count, std::nan(""));
  const auto raise = [&](std::int32_t column, std::int32_t row, double height_m) {
    if (column < 0 || row < 0 || column >= cells.columns || row >= cells.rows) return;
    double& here_m =
        ground_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells.columns) +
                 static_cast<std::size_t>(column)];
    if (!(height_m <= here_m)) here_m = height_m;
  };
  for (const Position& p : scene.tin.vertices)
    raise(static_cast<std::int32_t>((p.x_m - cells.low_x_m) / cells.cell_m),
          static_cast<std::int32_t>((p.y_m - cells.low_y_m) / cells.cell_m), p.z_m);
  // Corners belong to four columns each, middles to one.
  for (std::int32_t row = 0; row <= 2 * cells.rows; ++row)
    for (std::int32_t column = row % 2; column <= 2 * cells.columns; column += 2) {
      const double x_m = round_to_lattice(cells.low_x_m + column * cells.cell_m / 2);
      const double y_m = round_to_lattice(cells.low_y_m + row * cells.cell_m / 2);
      const auto height_m = scene.index.ground_height_m(x_m, y_m);
      if (!height_m) continue;
      raise(column / 2, row / 2, *height_m);
      if (row % 2 == 1) continue;
      raise(column / 2 - 1, row / 2, *height_m);
      raise(column / 2, row / 2 - 1, *height_m);
      raise(column / 2 - 1, row / 2 - 1, *height_m);
    }
  return ground_m;
}

ViewCells columns_of(const LoadedScene& scene, const ExportOptions& options,
                     const std::vector<double>& altitudes_m) {
  const Bounds bounds = bounds_of(scene.tin.vertices);
  const double wide_m = bounds.high.x_m - bounds.low.x_m, deep_m = bounds.high.y_m - bounds.low.y_m;
  ViewCells cells;
  cells.cell_m = checked_cell_m(options, std::max(wide_m, deep_m), kCellsAcross);
  cells.low_x_m = bounds.low.x_m, cells.low_y_m = bounds.low.y_m;
  cells.columns = static_cast<std::int32_t>(wide_m / cells.cell_m) + 1;
  cells.rows = static_cast<std::int32_t>(deep_m / cells.cell_m) + 1;
  cells.bands = static_cast<std::int32_t>(altitudes_m.size());
  for (const double ground_m : ground_of_columns(scene, cells))
    for (const double altitude_m : altitudes_m)
      cells.top_m.push_back(static_cast<float>(ground_m + altitude_m));
  return cells;
}

/// The cells as grids: a layer a band, so that the third index is no height.
VdbFile file_of(const ViewCells& cells, std::map<std::string, std::string> metadata) {
  VdbShape shape{cells.columns,
                 cells.rows,
                 cells.bands,
                 {cells.low_x_m, cells.low_y_m, 0},
                 {cells.cell_m, cells.cell_m, 1}};
  VdbGrid<std::int32_t> sets{"hidden_set", shape, -1, {}, {}};
  VdbGrid<float> tops{"band_top_m", shape, kNoHeight, {}, {}};
  for (std::int32_t band = 0; band < cells.bands; ++band)
    for (std::int32_t row = 0; row < cells.rows; ++row)
      for (std::int32_t column = 0; column < cells.columns; ++column) {
        const std::size_t cell = cells.at(column, row, band);
        const bool is_known = !std::isnan(cells.top_m[cell]);
        sets.values.push_back(is_known ? static_cast<std::int32_t>(cells.set[cell]) : -1);
        tops.values.push_back(is_known ? cells.top_m[cell] : kNoHeight);
        sets.is_active.push_back(is_known ? 1 : 0);
        tops.is_active.push_back(is_known ? 1 : 0);
      }
  VdbFile file;
  file.integers.push_back(std::move(sets));
  file.floats.push_back(std::move(tops));
  file.metadata = std::move(metadata);
  return file;
}

void export_view_cells(const ExportOptions& options, const LoadedScene& scene,
                       const PartFolder& folder, Stages& stages, nlohmann::json& result) {
  const std::vector<double>& altitudes_m =
      options.altitudes_m.empty() ? kAltitudesM : options.altitudes_m;
  if (!std::is_sorted(altitudes_m.begin(), altitudes_m.end()))
    throw Error(ErrorCode::kUsage, "--altitudes: fall; rising ones were expected");
  const CullingSource source = culling_source(scene);  // refuses a scene without regions
  ViewCells cells = columns_of(scene, options, altitudes_m);
  stages.run("sets", [&](const Progress& progress) {
    find_hidden_sets(source.groups->certified, options.keep, cells, progress);
  });
  auto metadata = metadata_of(scene);
  metadata["ALTITUDES_M"] = fmt::format("{}", fmt::join(altitudes_m, ","));
  metadata["HEIGHTS_OF"] = "the scene's flattened frame; see groups.scarp";
  VdbSummary summary;
  stages.run("cells.vdb", [&](const Progress&) {
    summary = write_vdb(folder.path_for("cells.vdb"), file_of(cells, metadata), Existing::kRefuse);
    write_sets(folder.path_for("hidden_sets.bin"), cells.sets);
  });
  std::uint64_t members = 0, occupied = 0;
  for (std::size_t cell = 0; cell < cells.set.size(); ++cell) {
    if (std::isnan(cells.top_m[cell])) continue;
    ++occupied;
    for (std::uint32_t set = cells.set[cell]; set != 0; set = cells.sets.parent[set])
      members += cells.sets.first[set + 1] - cells.sets.first[set];
  }
  result["cells"] = occupied;
  result["sets"] = cells.sets.size();
  result["kept_members"] = cells.sets.added.size();
  result["hidden_share"] =
      static_cast<double>(members) /
      static_cast<double>(std::max<std::uint64_t>(1, occupied * scene.groups.leaf_count));
  result["leaves"] = summary.leaves;
  result["tree_tiles"] = summary.tiles;
}

/// Height from which on a place over `ground` is seen: exact for the height that it returns, which
/// is on the lattice and above the true one by less than two steps.
double lowest_seen_m(const TinIndex& index, const Position& eye, const Position& ground) {
  if (eye.x_m == ground.x_m && eye.y_m == ground.y_m) return ground.z_m;
  Position seen = ground;
  for (const GroundCrossing& crossing : ground_along(index, eye, ground).crossings) {
    const double at = to_double(crossing.at);
    seen.z_m = std::max(seen.z_m, eye.z_m + (crossing.ground_z_m - eye.z_m) / at);
  }
  if (!(std::abs(seen.z_m) < kLatticeReachM / 2)) return HUGE_VAL;
  seen.z_m = std::ceil(seen.z_m / kLatticeStepM) * kLatticeStepM;
  // Steps twice as large each time: the height above is right to its last bits.
  for (double step_m = kLatticeStepM; is_blocked(index, eye, seen); step_m *= 2) {
    seen.z_m += step_m;
    if (!(seen.z_m < kLatticeReachM / 2)) return HUGE_VAL;
  }
  return seen.z_m;
}

/// Where cells of an observer's grids lie on the map.
struct MapCells {
  VdbShape shape;

  double x(std::int32_t column) const { return shape.low[0] + (column + 0.5) * shape.cell[0]; }
  double y(std::int32_t row) const { return shape.low[1] + (row + 0.5) * shape.cell[1]; }
};

MapCells map_cells(const LoadedScene& scene, const ExportOptions& options) {
  const RasterGeometry& raster = scene.scene.description().raster;
  const auto& g = raster.geotransform;
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const double column : {0.0, static_cast<double>(raster.columns)})
    for (const double row : {0.0, static_cast<double>(raster.rows)}) {
      const double at[2] = {g[0] + column * g[1] + row * g[2], g[3] + column * g[4] + row * g[5]};
      for (int axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
  const Bounds bounds = bounds_of(scene.tin.vertices);
  const double size_m[2] = {bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m};
  const double cell_m =
      checked_cell_m(options, std::max(size_m[0], size_m[1]), kObserverCellsAcross);
  MapCells cells;
  std::int32_t* const counts[] = {&cells.shape.columns, &cells.shape.rows};
  for (int axis = 0; axis < 2; ++axis) {
    *counts[axis] = std::max(1, static_cast<std::int32_t>(std::lround(size_m[axis] / cell_m)));
    cells.shape.low[axis] = low[axis];
    cells.shape.cell[axis] = (high[axis] - low[axis]) / *counts[axis];
  }
  return cells;
}

void export_airspace(const ExportOptions& options, const LoadedScene& scene,
                     const PartFolder& folder, Stages& stages, nlohmann::json& result) {
  const MapPoint at = resolve(*options.observer, options.crs, scene.frame, scene.index);
  const Position eye = GeoFrame::Placer(scene.frame).place(at);
  const MapCells cells = map_cells(scene, options);
  const VdbShape& shape = cells.shape;
  const auto count = static_cast<std::size_t>(shape.columns) * static_cast<std::size_t>(shape.rows);
  std::vector<double> lowest_m(count, std::nan("")), ground_m(count, std::nan(""));
  stages.run("sight", [&](const Progress&) {
    parallel_for(static_cast<std::size_t>(shape.rows), [&](std::size_t row) {
      const GeoFrame::Placer placer(scene.frame);
      for (std::int32_t column = 0; column < shape.columns; ++column) {
        const double x = cells.x(column), y = cells.y(static_cast<std::int32_t>(row));
        const auto height_m = ground_height_m(placer, scene.index, x, y);
        if (!height_m) continue;
        const std::size_t cell =
            row * static_cast<std::size_t>(shape.columns) + static_cast<std::size_t>(column);
        ground_m[cell] = *height_m;
        Position p = placer.place({x, y, *height_m});
        p.z_m = lowest_seen_m(scene.index, eye, p);
        if (std::isfinite(p.z_m)) lowest_m[cell] = placer.unplace(p).height_m;
      }
    });
  });

  double low_m = HUGE_VAL, high_m = -HUGE_VAL;
  for (const double g_m : ground_m)
    if (!std::isnan(g_m)) low_m = std::min(low_m, g_m), high_m = std::max(high_m, g_m);
  if (low_m > high_m)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': no cell's middle is over ground; give a smaller --cell",
                            scene.scene.path()));
  high_m += options.altitudes_m.empty() ? kAltitudesM.back() : options.altitudes_m.back();
  VdbGrid<float> lowest{"lowest_visible_m", shape, kNoHeight, {}, {}};
  VdbGrid<float> seen{"visible", shape, 0, {}, {}};
  seen.shape.layers = kObserverLayers;
  seen.shape.low[2] = low_m;
  seen.shape.cell[2] = (high_m - low_m) / kObserverLayers;
  std::uint64_t visible = 0;
  for (const double m : lowest_m) {
    // Rounded up, as heights from which on something is seen are.
    const auto nearest = static_cast<float>(m);
    lowest.values.push_back(std::isnan(m) ? kNoHeight
                            : static_cast<double>(nearest) >= m
                                ? nearest
                                : std::nextafter(nearest, HUGE_VALF));
    lowest.is_active.push_back(std::isnan(m) ? 0 : 1);
  }
  for (std::int32_t layer = 0; layer < kObserverLayers; ++layer) {
    const double height_m = seen.shape.low[2] + (layer + 0.5) * seen.shape.cell[2];
    for (const double m : lowest_m) {
      const bool is_seen = height_m >= m;  // not where m is NaN
      seen.values.push_back(is_seen ? 1 : 0);
      seen.is_active.push_back(is_seen ? 1 : 0);
      visible += is_seen;
    }
  }
  auto metadata = metadata_of(scene);
  metadata["OBSERVER"] = fmt::format("{:.10g},{:.10g},{:.10g}", at.x, at.y, at.height_m);
  VdbFile file;
  file.floats.push_back(std::move(lowest));
  file.floats.push_back(std::move(seen));
  file.metadata = std::move(metadata);
  VdbSummary summary;
  stages.run("cells.vdb", [&](const Progress&) {
    summary = write_vdb(folder.path_for("cells.vdb"), file, Existing::kRefuse);
  });
  result["columns"] = shape.columns;
  result["rows"] = shape.rows;
  result["visible_cells"] = visible;
  result["leaves"] = summary.leaves;
  result["tree_tiles"] = summary.tiles;
}

}  // namespace

void export_vdb(const ExportOptions& options, SceneTiles&, const PartFolder& folder, Stages& stages,
                nlohmann::json& result) {
  std::unique_ptr<LoadedScene> scene;
  stages.run("read", [&](const Progress&) {
    scene =
        std::make_unique<LoadedScene>(options.scene, ScenePart{options.common.memory_budget_bytes});
  });
  if (options.observer)
    export_airspace(options, *scene, folder, stages, result);
  else
    export_view_cells(options, *scene, folder, stages, result);
}

}  // namespace scarp
