#include "cli/build/report.h"

#include <gdal_version.h>
#include <proj.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/verify.h"

namespace scarp {
namespace {

nlohmann::json group_sizes(const Groups& groups) {
  if (groups.leaf_count == 0) return nullptr;
  const GroupFigures figures = figures_of(groups);
  return {{"least", figures.least}, {"median", figures.median}, {"most", figures.most}};
}

}  // namespace

nlohmann::json library_versions() {
  return {{"scarp", SCARP_VERSION},
          {"gdal", GDAL_RELEASE_NAME},
          {"proj", std::to_string(PROJ_VERSION_MAJOR) + "." + std::to_string(PROJ_VERSION_MINOR) +
                       "." + std::to_string(PROJ_VERSION_PATCH)}};
}

std::string growth_name(Growth growth) {
  return growth == Growth::kBreadthFirst ? "breadth-first" : "hidden-together";
}

std::string horizon_name(Hiding horizon) {
  return horizon == Hiding::kCertified ? "certified"
         : horizon == Hiding::kStewart ? "stewart"
                                       : "both";
}

SectorLayout stewart_layout(const BuildOptions& options) {
  SectorLayout layout;
  if (!has_certified(options.horizon)) layout.count = options.sectors.value_or(layout.count);
  layout.subsectors = options.subsectors.value_or(layout.subsectors);
  return layout;
}

nlohmann::json build_report(const BuildOptions& options, const Dem& dem, const Mesh& mesh,
                            const MeshOptions& mesh_options, const Groups& groups,
                            const std::optional<CertifiedSettings>& certified,
                            const std::optional<BudgetChoice>& budget,
                            const GroupingReport& grouping, const MapPoint& observer,
                            const std::vector<StageCost>& stages) {
  nlohmann::json report;
  const FrameDescription& frame = dem.frame->description();
  for (const DemSource& source : dem.sources)
    report["inputs"].push_back(
        {{"name", source.name}, {"samples", source.samples}, {"xxh3", source.checksum}});
  report["raster"] = {{"columns", dem.columns},
                      {"rows", dem.rows},
                      {"known_samples", std::count(dem.known.begin(), dem.known.end(), 1)}};
  report["parameters"] = {
      {"earth", frame.earth == Earth::kFlat ? "flat" : "ellipsoid"},
      {"refraction", frame.refraction},
      {"heights", frame.geoid_file.empty() ? "taken as ellipsoidal" : "geoid undulation added"},
      {"height_unit", dem.height_unit},
      {"horizon", horizon_name(options.horizon)},
      {"growth", growth_name(options.growth)},
      {"group_triangles", options.group_triangles},
      {"min_group_triangles", options.min_group_triangles},
      {"seed", options.seed},
      {"observer", {observer.x, observer.y, observer.height_m}}};
  if (mesh_options.max_error_m) report["parameters"]["max_error_m"] = *mesh_options.max_error_m;
  if (mesh_options.vertex_budget) report["parameters"]["vertices"] = *mesh_options.vertex_budget;
  report["mesh"] = {{"vertices", mesh.tin.vertices.size()},
                    {"triangles", mesh.tin.triangles.size()},
                    {"error_at_samples_m", mesh.error_at_samples_m},
                    {"error_over_surface_m", mesh.error_over_surface_m},
                    {"cell_ambiguity_m", mesh.cell_ambiguity_m},
                    {"lost_samples", mesh.lost_samples}};
  report["groups"] = {{"groups", groups.leaf_count},
                      {"nodes", groups.nodes.size()},
                      {"orphans", grouping.orphans},
                      {"passes", grouping.passes},
                      {"triangles_of_a_group", group_sizes(groups)}};
  if (has_stewart(options.horizon)) {
    const SectorLayout layout = stewart_layout(options);
    report["stewart"] = {{"sectors", layout.count}, {"subsectors", layout.subsectors}};
  }
  if (certified)
    report["certified"] = {{"sectors", certified->sectors},
                           {"fans", certified->fans},
                           {"patch", certified->patch},
                           {"bytes", certified_bytes(groups.certified)}};
  if (budget)
    report["certified"]["budget"] = {{"seconds", budget->seconds},
                                     {"measured_s", budget->measured_s},
                                     {"predicted_s", budget->predicted_s}};
  for (const StageCost& stage : stages)
    report["stages"].push_back({{"name", stage.name},
                                {"seconds", stage.seconds},
                                {"peak_memory_bytes", stage.peak_bytes}});
  report["warnings"] = dem.warnings;
  report["versions"] = library_versions();
  return report;
}

}  // namespace scarp
