#include "cli/build/report.h"

#include <gdal_version.h>
#include <proj.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/build/options_json.h"

namespace scarp {
namespace {

using nlohmann::json;

double number(const json& facts, const char* name) {
  return facts.contains(name) ? facts[name].get<double>() : 0;
}
std::uint64_t whole_number(const json& facts, const char* name) {
  return facts.contains(name) ? facts[name].get<std::uint64_t>() : 0;
}

/// Facts of all steps of a kind that made something, in the plan's order.
std::vector<json> facts_of_all(const StepRun& run, StepKind kind) {
  std::vector<json> all;
  for (std::size_t i = 0; i < run.plan().steps.size(); ++i)
    if (run.plan().steps[i].kind == kind) all.push_back(run.work().record(i).facts);
  return all;
}

std::uint64_t sum(const std::vector<json>& facts, const char* name) {
  std::uint64_t total = 0;
  for (const json& fact : facts) total += whole_number(fact, name);
  return total;
}

double greatest(const std::vector<json>& facts, const char* name) {
  double most = 0;
  for (const json& fact : facts) most = std::max(most, number(fact, name));
  return most;
}

json mesh_report(const std::vector<json>& tiles) {
  return {{"vertices", sum(tiles, "vertices")},
          {"triangles", sum(tiles, "triangles")},
          {"error_at_samples_m", greatest(tiles, "error_at_samples_m")},
          {"error_over_surface_m", greatest(tiles, "error_over_surface_m")},
          {"cell_ambiguity_m", greatest(tiles, "cell_ambiguity_m")},
          {"lost_samples", sum(tiles, "lost_samples")}};
}

/// Each coarser level, from the finest: what it holds and how far it may lie from the finest one.
json levels_report(const StepRun& run) {
  json levels = json::array();
  const BuildPlan& plan = run.plan();
  for (std::int32_t level = plan.scheme.finest_level() - 1; level >= 0; --level) {
    std::vector<json> tiles;
    for (std::size_t i = 0; i < plan.steps.size(); ++i)
      if (plan.steps[i].kind == StepKind::kLevel && plan.steps[i].tile->level == level)
        tiles.push_back(run.work().record(i).facts);
    levels.push_back({{"level", level},
                      {"tiles", tiles.size()},
                      {"triangles", sum(tiles, "triangles")},
                      {"max_error_m", plan.max_error_m_of(level)},
                      {"above_finest_m", greatest(tiles, "above_m")},
                      {"below_finest_m", greatest(tiles, "below_m")}});
  }
  return levels;
}

json groups_report(const std::vector<json>& tiles) {
  json sizes;
  std::uint32_t least = 0, most = 0;
  std::vector<std::uint32_t> medians;
  for (const json& fact : tiles) {
    if (whole_number(fact, "groups") == 0) continue;
    const auto own = fact["sizes"].get<std::vector<std::uint32_t>>();
    least = medians.empty() ? own[0] : std::min(least, own[0]);
    medians.push_back(own[1]);
    most = std::max(most, own[2]);
  }
  if (!medians.empty()) {
    std::sort(medians.begin(), medians.end());
    sizes = {{"least", least}, {"median", medians[medians.size() / 2]}, {"most", most}};
  }
  return {{"groups", sum(tiles, "groups")},
          {"nodes", sum(tiles, "nodes")},
          {"orphans", sum(tiles, "orphans")},
          {"passes", static_cast<std::uint64_t>(greatest(tiles, "passes"))},
          {"triangles_of_a_group", sizes}};
}

/// How much less there is to do than if every sample were a vertex and every tile were seen at full
/// detail from every other.
json refinement_report(const std::vector<json>& meshes, const std::vector<json>& groups) {
  const auto full = static_cast<double>(2 * sum(meshes, "ground_cells"));
  const auto triangles = static_cast<double>(sum(meshes, "triangles"));
  const auto seen = static_cast<double>(sum(groups, "seen_triangles"));
  const auto tiles = static_cast<double>(std::count_if(
      groups.begin(), groups.end(), [](const json& g) { return g.contains("seen_triangles"); }));
  json report = {{"triangles_of_all_samples", full}, {"saved_of_mesh", 1 - triangles / full}};
  if (tiles > 0) report["saved_of_seen_ground"] = 1 - seen / (tiles * triangles);
  return report;
}

/// What steps took, by the names of their parts; memory is the most of any.
json stages_report(const StepRun& run) {
  std::vector<StageCost> all;
  const auto add = [&](const std::vector<StageCost>& costs) {
    for (const StageCost& cost : costs) {
      const auto same = std::find_if(all.begin(), all.end(),
                                     [&](const StageCost& s) { return s.name == cost.name; });
      if (same == all.end()) {
        all.push_back(cost);
        continue;
      }
      same->seconds += cost.seconds;
      same->peak_bytes = std::max(same->peak_bytes, cost.peak_bytes);
    }
  };
  for (std::size_t i = 0; i < run.plan().steps.size(); ++i)
    if (run.work().is_done(i)) add(run.work().record(i).stages);
  add(run.parts());
  json stages = json::array();
  for (const StageCost& stage : all)
    stages.push_back({{"name", stage.name},
                      {"seconds", stage.seconds},
                      {"peak_memory_bytes", stage.peak_bytes}});
  return stages;
}

json parameters_report(const StepRun& run, const std::optional<MapPoint>& observer) {
  const BuildPlan& plan = run.plan();
  const BuildOptions& options = plan.options;
  const json source = run.facts_of(StepKind::kSource, {});
  const FrameDescription frame = run.open_source().dem().frame->description();
  json parameters = {
      {"earth", frame.earth == Earth::kFlat ? "flat" : "ellipsoid"},
      {"refraction", frame.refraction},
      {"heights", frame.geoid_file.empty() ? "taken as ellipsoidal" : "geoid undulation added"},
      {"height_unit", source["height_unit"]},
      {"accuracy", name_of(options.accuracy)},
      {"horizon", horizon_name(options.horizon)},
      {"growth", growth_name(options.growth)},
      {"group_triangles", options.group_triangles},
      {"min_group_triangles", options.min_group_triangles},
      {"seed", options.seed},
      {"tile_samples", plan.scheme.tile_samples()}};
  if (observer) parameters["observer"] = {observer->x, observer->y, observer->height_m};
  if (options.vertices)
    parameters["vertices"] = *options.vertices;
  else
    parameters["max_error_m"] = plan.max_error_m;
  return parameters;
}

}  // namespace

json library_versions() {
  return {{"scarp", SCARP_VERSION},
          {"gdal", GDAL_RELEASE_NAME},
          {"proj", std::to_string(PROJ_VERSION_MAJOR) + "." + std::to_string(PROJ_VERSION_MINOR) +
                       "." + std::to_string(PROJ_VERSION_PATCH)}};
}

SectorLayout stewart_layout(const BuildOptions& options) {
  SectorLayout layout;
  if (!has_certified(options.horizon)) layout.count = options.sectors.value_or(layout.count);
  layout.subsectors = options.subsectors.value_or(layout.subsectors);
  return layout;
}

json build_report(const StepRun& run, const std::optional<MapPoint>& observer) {
  const BuildPlan& plan = run.plan();
  const json source = run.facts_of(StepKind::kSource, {});
  const std::vector<json> meshes = facts_of_all(run, StepKind::kMesh);
  const std::vector<json> groups = facts_of_all(run, StepKind::kGroups);
  json report;
  for (const json& input : source["inputs"])
    report["inputs"].push_back(
        {{"name", input["name"]}, {"samples", input["samples"]}, {"xxh3", input["xxh3"]}});
  report["raster"] = {{"columns", plan.scheme.columns()},
                      {"rows", plan.scheme.rows()},
                      {"known_samples", sum(meshes, "known_samples")}};
  report["parameters"] = parameters_report(run, observer);
  report["tiles"] = {{"levels", plan.scheme.finest_level() + 1}, {"finest", meshes.size()}};
  report["mesh"] = mesh_report(meshes);
  if (!plan.has_one_tile()) report["levels"] = levels_report(run);
  report["groups"] = groups_report(groups);
  if (has_stewart(plan.options.horizon)) {
    const SectorLayout layout = stewart_layout(plan.options);
    report["stewart"] = {{"sectors", layout.count}, {"subsectors", layout.subsectors}};
  }
  for (const json& tile : groups) {
    if (!tile.contains("certified")) continue;
    if (!report.contains("certified")) {
      report["certified"] = tile["certified"];
      if (tile.contains("budget")) report["certified"]["budget"] = tile["budget"];
    } else {
      report["certified"]["bytes"] = report["certified"]["bytes"].get<std::uint64_t>() +
                                     tile["certified"]["bytes"].get<std::uint64_t>();
    }
  }
  report["refinement"] = refinement_report(meshes, groups);
  report["stages"] = stages_report(run);
  std::uint64_t peak_bytes = peak_memory_bytes();  // steps of other processes may have more
  for (const json& stage : report["stages"])
    peak_bytes = std::max(peak_bytes, stage["peak_memory_bytes"].get<std::uint64_t>());
  report["peak_memory_bytes"] = peak_bytes;
  const FileBytes bytes = run.bytes_of_all();
  report["bytes_read"] = bytes.read;
  report["bytes_written"] = bytes.written;
  report["warnings"] = source["warnings"];
  for (const std::vector<json>& steps : {meshes, groups})
    for (const json& tile : steps)
      if (tile.contains("warnings"))
        for (const json& warning : tile["warnings"]) report["warnings"].push_back(warning);
  report["versions"] = library_versions();
  report["plan"] = plan.fingerprint;
  return report;
}

}  // namespace scarp
