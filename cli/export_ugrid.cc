#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "cli/export.h"
#include "cli/scene_report.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/mesh/mesh.h"
#include "tiles/layers/ugrid.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

/// What the whole mesh takes while it is welded, placed and written, for each triangle. Measured.
constexpr std::uint64_t kBytesPerTriangle = 400;

constexpr double kNoAngle = std::numeric_limits<double>::quiet_NaN();

void check_memory(const ExportOptions& options, const SceneTiles& scene) {
  std::uint64_t triangles = 0;
  for (std::size_t i = 0; i < scene.size(); ++i)
    if (scene.tile(i).contents) triangles += scene.tile(i).contents->triangles;
  const std::uint64_t bytes = triangles * kBytesPerTriangle;
  if (bytes > options.common.memory_budget_bytes)
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': its {} triangles take {} MiB as one mesh, and --memory is {} "
                            "MiB; give more memory, or export --to 3dtiles, tile by tile",
                            options.scene, triangles, bytes >> 20,
                            options.common.memory_budget_bytes >> 20));
}

/// A tile's samples in the DEM that the scene was built from, in the scene's frame.
SampleGrid samples_of_tile(const DemWindows& source, const TileWindow& window) {
  return place_window(source.dem(), source.read({window.first_column, window.first_row,
                                                 window.columns, window.rows}));
}

/// Greatest distance of each triangle of a tile from the DEM that it was made of.
/// Throws Error{kInput} where the DEM is another one.
std::vector<double> triangle_errors_m(const ExportOptions& options, SceneTiles& scene,
                                      std::size_t tile, const DemWindows& source) {
  const auto refuse = [&](const std::string& found) {
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': {}; the DEMs that '{}' was built from were expected, in the "
                            "same order; leave --dem out for one error of all triangles",
                            options.dem_files[0], found, options.scene));
  };
  const TileWindow window = scene.window_of({tile});
  const SampleGrid grid = samples_of_tile(source, window);
  Mesh mesh;
  SampledTin sampled =
      read_sampled_tin(scene.scene().open(scene.scene().require(scene.tile(tile).id, "tin")));
  mesh.tin = std::move(sampled.tin);
  mesh.sample_of_vertex = std::move(sampled.sample_of_vertex);
  if (mesh.sample_of_vertex.size() != mesh.tin.vertices.size())
    refuse("has no samples where the scene has vertices");
  for (std::size_t v = 0; v < mesh.tin.vertices.size(); ++v) {
    std::int64_t& sample = mesh.sample_of_vertex[v];
    if (sample < 0) refuse("has no samples where the scene has buildings");
    const std::int64_t columns = source.dem().columns;
    const std::int64_t column = sample % columns - window.first_column;
    const std::int64_t row = sample / columns - window.first_row;
    if (column < 0 || row < 0 || column >= window.columns || row >= window.rows)
      refuse("its samples are not those of the scene");
    sample = row * window.columns + column;
    if (grid.positions[static_cast<std::size_t>(sample)] != mesh.tin.vertices[v])
      refuse("its heights or its place are not those of the scene");
  }
  return measure_triangle_errors(grid, mesh);
}

/// The DEM of --dem, read as the scene says that it was.
std::unique_ptr<DemWindows> open_source(const ExportOptions& options, const SceneTiles& scene) {
  if (options.dem_files.empty()) return nullptr;
  const SceneDescription& description = scene.scene().description();
  DemOptions dem;
  dem.earth = scene.frame().description().earth;
  dem.refraction = description.earth.refraction;
  dem.geoid_file = description.earth.geoid;
  dem.height_unit = SceneReport(scene.scene()).height_unit();
  auto source = std::make_unique<DemWindows>(options.dem_files, dem);
  if (source->dem().columns != description.raster.columns ||
      source->dem().rows != description.raster.rows)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is of {} x {} samples; the DEMs that '{}' was built from were "
                            "expected, {} x {} in all; leave --dem out for one error of all "
                            "triangles",
                            options.dem_files[0], source->dem().columns, source->dem().rows,
                            options.scene, description.raster.columns, description.raster.rows));
  return source;
}

/// The slopes under which a group is hidden from far cameras, as angles above the level, degrees:
/// the least and the mean over all sectors. NaN where a sector hides nothing at any height.
struct FarHorizon {
  double least_deg = kNoAngle, mean_deg = kNoAngle;
};

FarHorizon far_horizon(const CertifiedRegions& regions, std::uint32_t group) {
  FarHorizon horizon;
  double sum = 0;
  std::int32_t counted = 0;
  bool everywhere = true;
  for (std::int32_t s = 0; s < regions.layout.sectors; ++s) {
    const std::int32_t code = regions.at(group, s).back() & (kSlopeCodes - 1);
    if (code == 0) {
      everywhere = false;
      continue;
    }
    const double angle_deg = std::atan(static_cast<double>(slope_of(regions.groups[group], code))) *
                             180 / std::numbers::pi;
    horizon.least_deg = counted == 0 ? angle_deg : std::min(horizon.least_deg, angle_deg);
    sum += angle_deg;
    ++counted;
  }
  if (counted > 0) horizon.mean_deg = sum / counted;
  if (!everywhere) horizon.least_deg = kNoAngle;
  return horizon;
}

}  // namespace

void export_ugrid(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                  Stages& stages, nlohmann::json& result) {
  check_memory(options, scene);
  const std::unique_ptr<DemWindows> source = open_source(options, scene);
  MapMesh mesh;
  mesh.crs_wkt = scene.scene().description().crs_wkt;
  FaceValues mean{"horizon",
                  "mean over all directions of the angle above the level under which a "
                  "far camera does not see the group",
                  "degree",
                  {}};
  FaceValues least{
      "horizon_least", "least angle of all directions, none where one hides nothing", "degree", {}};
  stages.run("read", [&](const Progress&) {
    std::vector<std::size_t> all(scene.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const Tin tin = scene.read_ground(all);
    mesh.triangles.assign(tin.triangles.begin(), tin.triangles.end());
    for (const std::size_t i : all) {
      const Groups groups = scene.read_groups(i);
      std::vector<FarHorizon> horizons(groups.leaf_count);
      if (groups.has_certified())
        for (std::uint32_t g = 0; g < groups.leaf_count; ++g)
          horizons[g] = far_horizon(groups.certified, g);
      for (const GroupIndex group : groups.group_of_triangle) {
        const bool has = group != kNone;
        mesh.group_of_triangle.push_back(
            has ? static_cast<std::int32_t>(scene.first_group(i) + group) : -1);
        mean.values.push_back(has ? horizons[group].mean_deg : kNoAngle);
        least.values.push_back(has ? horizons[group].least_deg : kNoAngle);
      }
    }
    mesh.places.resize(tin.vertices.size());
    mesh.heights_m.resize(tin.vertices.size());
    constexpr std::size_t kBlock = 4096;
    parallel_for((tin.vertices.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
      const GeoFrame::Placer placer(scene.frame());
      const std::size_t end = std::min((block + 1) * kBlock, tin.vertices.size());
      for (std::size_t v = block * kBlock; v < end; ++v) {
        const MapPoint at = placer.unplace(tin.vertices[v]);
        mesh.places[v] = {at.x, at.y};
        mesh.heights_m[v] = at.height_m;
      }
    });
  });
  if (mesh.group_of_triangle.size() != mesh.triangles.size())
    throw Error(ErrorCode::kCorrupt,
                fmt::format("'{}': groups of {} triangles for a mesh of {}; files of one scene "
                            "were expected; build it again",
                            options.scene, mesh.group_of_triangle.size(), mesh.triangles.size()));
  const double error_m = SceneReport(scene.scene()).mesh_error_m();
  FaceValues error{"error", "greatest vertical distance of the triangle from the source", "m", {}};
  if (source) {
    stages.run("errors", [&](const Progress& progress) {
      for (std::size_t i = 0; i < scene.size(); ++i) {
        const std::vector<double> own = triangle_errors_m(options, scene, i, *source);
        error.values.insert(error.values.end(), own.begin(), own.end());
        if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(scene.size()));
      }
    });
  } else {
    error.description = "greatest vertical distance of the mesh from the source, of all triangles";
    error.values.assign(mesh.triangles.size(), error_m);
  }
  mesh.values.push_back(std::move(error));
  mesh.values.push_back(std::move(mean));
  mesh.values.push_back(std::move(least));
  stages.run("write", [&](const Progress&) {
    write_ugrid(folder.path_for("mesh.nc"), mesh, Existing::kRefuse);
  });
  result["vertices"] = mesh.places.size();
  result["triangles"] = mesh.triangles.size();
  result["mesh_error_m"] = error_m;
}

}  // namespace scarp
