#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "cli/export.h"
#include "cli/scene_report.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "tiles/layers/ugrid.h"

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
  mesh.values.push_back({"error",
                         "greatest vertical distance of the mesh from its source, measured over "
                         "all of the surface",
                         "m", std::vector<double>(mesh.triangles.size(), error_m)});
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
