#include "cli/build/build_plan.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/build/certified_settings.h"
#include "cli/build/options_json.h"
#include "cli/build/report.h"
#include "core/error/error.h"
#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"
#include "ingest/dem/dem_windows.h"
#include "tiles/store/checksum.h"
#include "tiles/store/scene.h"

namespace scarp {
namespace {

using nlohmann::json;

constexpr int kPlanVersion = 2;

/// Rough costs, in seconds of one core, and bytes; docs/scale.md has what is measured.
constexpr double kReadS = 0.05e-6;      // a sample
constexpr double kMeshS = 2e-6;         // a sample
constexpr double kFanS = 3e-6;          // a fan and triangle
constexpr double kTriangleShare = 0.1;  // triangles to a sample
/// A step on groups holds meshes of up to nine fine tiles and of eight a level; on rugged ground a
/// fifth of the samples is in the mesh.
constexpr double kVertexShare = 0.2;
constexpr double kBytesPerSeenVertex = 250;
constexpr double kBytesPerGroupSample = 24;   // index, raster of groups
constexpr double kBytesPerBoundSector = 384;  // of a group, while it is certified
constexpr double kBytesPerDrawnTriangle = 150;
constexpr std::uint64_t kBytesOfPictures = 64U << 20;
constexpr std::uint64_t kBytesOfProcess = 96U << 20;

std::string work_file_name(const TileId& tile, const char* kind) {
  return std::string(kWorkFolder) + "/" + tile_file_name(name_of(tile), kind);
}

/// Adds steps one after the other and knows which file is whose.
class Planner {
 public:
  Planner(BuildPlan& plan, std::int32_t widest_columns)
      : plan_(plan), scheme_(plan.scheme), widest_columns_(widest_columns) {}

  void run() {
    const double samples = static_cast<double>(scheme_.columns()) * scheme_.rows();
    add({StepKind::kSource, {}, {}, {}, {}, source_bytes(), kReadS * samples});
    const std::int32_t finest = scheme_.finest_level();
    for (const TileId& tile : scheme_.tiles(finest)) add_mesh(tile);
    if (!plan_.has_one_tile()) {
      add_ranges();
      for (std::int32_t level = finest - 1; level >= 0; --level)
        for (const TileId& tile : scheme_.tiles(level)) add_level(tile);
    }
    if (has_stewart(plan_.options.horizon)) add_horizons();
    for (const TileId& tile : scheme_.tiles(finest)) add_groups(tile);
    add_finish();
  }

 private:
  void add(PlanStep step) {
    for (const std::string& input : step.inputs) {
      const std::size_t maker = maker_.at(input);
      if (std::find(step.after.begin(), step.after.end(), maker) == step.after.end())
        step.after.push_back(maker);
    }
    std::sort(step.after.begin(), step.after.end());
    for (const std::string& output : step.outputs) maker_[output] = plan_.steps.size();
    plan_.steps.push_back(std::move(step));
  }

  double samples_of(const TileId& tile) const {
    const TileWindow window = scheme_.window_with_halo(tile);
    return static_cast<double>(window.columns) * window.rows;
  }

  /// Steps that read heights wait for the one that has checked them.
  void add_mesh(const TileId& tile) {
    PlanStep step{StepKind::kMesh,          tile, {},
                  {tile_file(tile, "tin")}, {0},  mesh_bytes(tile),
                  kMeshS * samples_of(tile)};
    if (!plan_.has_one_tile()) {
      step.outputs.push_back(tile_file(tile, "range"));
      step.outputs.push_back(samples_file_name(tile));
    }
    add(std::move(step));
  }

  void add_ranges() {
    PlanStep step{StepKind::kRanges, {}, {}, {}, {}, kBytesOfProcess, 1};
    for (std::int32_t level = scheme_.finest_level(); level >= 0; --level)
      for (const TileId& tile : scheme_.tiles(level))
        (level == scheme_.finest_level() ? step.inputs : step.outputs)
            .push_back(tile_file(tile, "range"));
    // --observer stands on ground, which is to be known before the long work.
    if (plan_.options.observer)
      for (const TileId& tile : scheme_.tiles(scheme_.finest_level()))
        step.inputs.push_back(tile_file(tile, "tin"));
    ranges_ = plan_.steps.size();
    add(std::move(step));
  }

  void add_level(const TileId& tile) {
    const bool above_finest = tile.level + 1 == scheme_.finest_level();
    PlanStep step{StepKind::kLevel, tile, {}, {}, {}, level_bytes(tile), kMeshS * samples_of(tile)};
    for (const TileId& finer : scheme_.finer_around(tile)) {
      step.inputs.push_back(samples_file_name(finer));
      step.inputs.push_back(tile_file(finer, "tin"));
      if (!above_finest) step.inputs.push_back(occluder_file_name(finer));
    }
    step.outputs = {tile_file(tile, "tin"), occluder_file_name(tile)};
    if (tile.level > 0) step.outputs.push_back(samples_file_name(tile));
    add(std::move(step));
  }

  void add_horizons() {
    const TileId tile{};
    add({StepKind::kHorizons,
         tile,
         {tile_file(tile, "tin")},
         {tile_file(tile, "horizon")},
         {},
         groups_bytes(tile),
         kMeshS * samples_of(tile)});
  }

  void add_groups(const TileId& tile) {
    PlanStep step{StepKind::kGroups,           tile, {},
                  {tile_file(tile, "groups")}, {},   groups_bytes(tile),
                  cost_of_groups(tile)};
    for (const TileId& seen : scheme_.seen_from(tile))
      step.inputs.push_back(seen.level == scheme_.finest_level() ? tile_file(seen, "tin")
                                                                 : occluder_file_name(seen));
    if (has_stewart(plan_.options.horizon)) step.inputs.push_back(tile_file(tile, "horizon"));
    if (!plan_.has_one_tile()) {
      step.after.push_back(ranges_);
      step.outputs.push_back(group_raster_file_name(tile));
      step.outputs.push_back(tree_node_file_name(tile));
    }
    add(std::move(step));
  }

  void add_finish() {
    PlanStep step{StepKind::kFinish, {}, {}, {kSceneJson}, {0}, kBytesOfProcess, 1};
    for (const PlanStep& made : plan_.steps)
      for (const std::string& output : made.outputs)
        if (!output.starts_with(kWorkFolder) || made.kind == StepKind::kGroups)
          step.inputs.push_back(output);
    if (plan_.has_one_tile()) {
      step.memory_bytes = mesh_bytes(TileId{});
      step.cost_s = 2 * kMeshS * samples_of(TileId{});
    } else {
      step.memory_bytes = finish_bytes();
      step.cost_s = 20;
    }
    add(std::move(step));
  }

  static std::string tile_file(const TileId& tile, const char* kind) {
    return tile_file_name(name_of(tile), kind);
  }

  std::uint64_t source_bytes() const {
    return kBytesOfProcess + 64 * 9 * static_cast<std::uint64_t>(widest_columns_);
  }
  std::uint64_t mesh_bytes(const TileId& tile) const {
    return kBytesOfProcess + static_cast<std::uint64_t>(kBytesPerSample * samples_of(tile));
  }
  /// Besides its own mesh, those of the four tiles that it is lowered under.
  std::uint64_t level_bytes(const TileId& tile) const {
    constexpr double kChildren = 4;
    return mesh_bytes(tile) + static_cast<std::uint64_t>(kChildren * kBytesPerSeenVertex *
                                                         kVertexShare * samples_of(tile));
  }
  std::uint64_t groups_bytes(const TileId& tile) const {
    const double seen = static_cast<double>(scheme_.seen_from(tile).size());
    const double groups = 2 * kVertexShare * samples_of(tile) / plan_.options.group_triangles;
    return kBytesOfProcess + static_cast<std::uint64_t>(
                                 samples_of(tile) * (kBytesPerGroupSample +
                                                     kBytesPerSeenVertex * kVertexShare * seen) +
                                 groups * kBytesPerBoundSector * certified_sectors());
  }
  /// 0 where nothing is certified.
  std::int32_t certified_sectors() const {
    if (!has_certified(plan_.options.horizon)) return 0;
    const auto triangles = static_cast<std::size_t>(plan_.options.group_triangles);
    return plan_.options.sectors ? *plan_.options.sectors
                                 : sectors_within(kCertifiedBytes, triangles, 1);
  }
  /// Pictures, or the tiles that are judged or looked over at once.
  std::uint64_t finish_bytes() const {
    const double triangles =
        std::min(static_cast<double>(kMostDrawnTriangles),
                 2.0 * scheme_.columns() * static_cast<double>(scheme_.rows()));
    const double of_pictures =
        static_cast<double>(kBytesOfPictures) + kBytesPerDrawnTriangle * triangles;
    const std::int32_t finest = scheme_.finest_level();
    const double across = scheme_.tiles_across(finest), down = scheme_.tiles_down(finest);
    const double around = std::min(3.0, across) * std::min(3.0, down);
    const double between = std::min(across * down, 2 * std::max(across, down) + 8);
    const double tiles = plan_.options.observer ? std::max(around, between) : around;
    const double of_tiles =
        tiles * kBytesPerSeenVertex * kVertexShare * samples_of(TileId{finest, 0, 0});
    return kBytesOfProcess + static_cast<std::uint64_t>(std::max(of_pictures, of_tiles));
  }
  double cost_of_groups(const TileId& tile) const {
    const int fans = plan_.options.fans.value_or(build_accuracy(plan_.options.accuracy).fans);
    return has_certified(plan_.options.horizon) ? kFanS * fans * kTriangleShare * samples_of(tile)
                                                : kMeshS * samples_of(tile);
  }

  BuildPlan& plan_;
  const TileScheme& scheme_;
  std::int32_t widest_columns_;
  std::size_t ranges_ = 0;
  std::map<std::string, std::size_t> maker_;  // of each file
};

std::string fingerprint_of(const BuildPlan& plan) {
  json facts = {{"version", kPlanVersion},
                {"made_by", "scarp " SCARP_VERSION},
                {"options", to_json(plan.options)}};
  for (const PlanSource& source : plan.sources)
    facts["sources"].push_back({source.path, source.size, source.changed_ns});
  const std::string text = facts.dump(-1, ' ', false, json::error_handler_t::replace);
  return to_hex(checksum_of(std::as_bytes(std::span(text))));
}

std::string gibibytes(std::uint64_t bytes) {
  return fmt::format("{:.2f} GiB", static_cast<double>(bytes) / 0x1p30);
}

/// Refuses before the work what will not fit into memory.
void check_memory(const BuildPlan& plan, const BuildOptions& options) {
  const std::uint64_t allowed = options.common.memory_budget_bytes;
  const auto largest = std::max_element(
      plan.steps.begin(), plan.steps.end(),
      [](const PlanStep& a, const PlanStep& b) { return a.memory_bytes < b.memory_bytes; });
  if (allowed == 0 || largest->memory_bytes <= allowed) return;
  const TileScheme& scheme = plan.scheme;
  const std::string size = fmt::format("'{}': {} x {} samples", plan.sources.front().path,
                                       scheme.columns(), scheme.rows());
  if (const char* option = option_for_one_tile(options))
    throw Error(
        ErrorCode::kResource,
        fmt::format("{} need about {} with {}, which takes them in one piece, and --memory "
                    "allows {}; raise --memory, or leave {} out",
                    size, gibibytes(largest->memory_bytes), option, gibibytes(allowed), option));
  if (options.observer && largest->kind == StepKind::kFinish)
    throw Error(ErrorCode::kResource,
                fmt::format("{} need about {} for the viewshed of --observer, and --memory allows "
                            "{}; raise --memory, or leave it out and ask scarp viewshed",
                            size, gibibytes(largest->memory_bytes), gibibytes(allowed)));
  for (BuildOptions smaller = options; smaller.tile_samples > kLeastTileSamples;) {
    smaller.tile_samples /= 2;
    smaller.common.memory_budget_bytes = 0;
    const BuildPlan other = make_plan(smaller);
    if (std::all_of(other.steps.begin(), other.steps.end(),
                    [&](const PlanStep& step) { return step.memory_bytes <= allowed; }))
      throw Error(ErrorCode::kResource,
                  fmt::format("{}: step '{}' needs about {}, and --memory allows {}; give "
                              "--tile-samples {}, or raise --memory",
                              size, largest->name(), gibibytes(largest->memory_bytes),
                              gibibytes(allowed), smaller.tile_samples));
  }
  throw Error(
      ErrorCode::kResource,
      fmt::format("{}: step '{}' needs about {}, and --memory allows {}; raise --memory", size,
                  largest->name(), gibibytes(largest->memory_bytes), gibibytes(allowed)));
}

}  // namespace

PlanSource plan_source(const std::string& path) {
  PlanSource source{path, 0, 0};
  struct stat status;
  if (::stat(path.c_str(), &status) == 0) {
    source.size = static_cast<std::uint64_t>(status.st_size);
    source.changed_ns =
        std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
  }
  return source;
}

const char* name_of(StepKind kind) {
  switch (kind) {
    case StepKind::kSource:
      return "read";
    case StepKind::kMesh:
      return "mesh";
    case StepKind::kRanges:
      return "ranges";
    case StepKind::kLevel:
      return "levels";
    case StepKind::kHorizons:
      return "horizons";
    case StepKind::kGroups:
      return "groups";
    case StepKind::kFinish:
      return "finish";
  }
  return "";
}

std::string PlanStep::name() const {
  return tile ? fmt::format("{} {}", name_of(kind), name_of(*tile)) : name_of(kind);
}

std::string samples_file_name(const TileId& tile) {
  return work_file_name(tile, "samples");
}
std::string occluder_file_name(const TileId& tile) {
  return work_file_name(tile, "occluder");
}
std::string group_raster_file_name(const TileId& tile) {
  return work_file_name(tile, "group_raster");
}
std::string tree_node_file_name(const TileId& tile) {
  return work_file_name(tile, "tree_node");
}

const char* option_for_one_tile(const BuildOptions& options) {
  if (options.vertices) return "--vertices";
  if (!options.footprints_file.empty()) return "--footprints";
  if (has_stewart(options.horizon)) return "--horizon stewart or both";
  if (options.budget.seconds) return "a --budget of time";
  return nullptr;
}

BuildPlan make_plan(const BuildOptions& options) {
  BuildPlan plan;
  plan.options = options;
  const DemWindows source(options.dem_files, options.dem);
  const Dem& dem = source.dem();
  for (const std::string& file : options.dem_files)
    plan.sources.push_back(plan_source(std::filesystem::absolute(file).string()));
  std::int32_t side = options.tile_samples;
  if (option_for_one_tile(options) != nullptr)
    while (side < std::max(dem.columns, dem.rows) - 1) side *= 2;
  plan.scheme = TileScheme(dem.columns, dem.rows, side);
  const CellMeasures cells = measure_cells(dem);
  plan.max_error_m = options.max_error_m.value_or(build_accuracy(options.accuracy).error_cells *
                                                  std::min(cells.cell_x_m, cells.cell_y_m));
  plan.fingerprint = fingerprint_of(plan);
  Planner(plan, source.widest_columns()).run();
  check_memory(plan, options);
  return plan;
}

json to_json(const BuildPlan& plan) {
  json sources = json::array(), steps = json::array();
  for (const PlanSource& source : plan.sources)
    sources.push_back(
        {{"path", source.path}, {"size", source.size}, {"changed_ns", source.changed_ns}});
  for (std::size_t i = 0; i < plan.steps.size(); ++i) {
    const PlanStep& step = plan.steps[i];
    steps.push_back({{"step", i},
                     {"name", step.name()},
                     {"after", step.after},
                     {"inputs", step.inputs},
                     {"outputs", step.outputs},
                     {"memory_bytes", step.memory_bytes},
                     {"cost_s", step.cost_s}});
  }
  return {{"format", "scarp plan"},
          {"version", kPlanVersion},
          {"scene", std::filesystem::absolute(plan.options.scene).string()},
          {"overwrite", plan.options.common.overwrite},
          {"options", to_json(plan.options)},
          {"raster", {{"columns", plan.scheme.columns()}, {"rows", plan.scheme.rows()}}},
          {"sources", std::move(sources)},
          {"steps", std::move(steps)},
          {"fingerprint", plan.fingerprint}};
}

StoredPlan read_plan(const std::string& path) {
  const auto refuse = [&](const std::string& found) {
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': {}; a plan was expected; make one with scarp build --plan", path,
                            found));
  };
  std::ifstream file(path);
  if (!file) refuse("cannot be read");
  const json object = json::parse(file, nullptr, false);
  if (object.is_discarded()) refuse("is not JSON");
  try {
    if (object.at("format") != "scarp plan" || object.at("version") != kPlanVersion)
      refuse("is of another format or version");
    StoredPlan plan;
    plan.options = build_options_from(object.at("options"));
    plan.options.scene = object.at("scene").get<std::string>();
    plan.options.common.overwrite = object.at("overwrite").get<bool>();
    for (const json& source : object.at("sources"))
      plan.options.dem_files.push_back(source.at("path").get<std::string>());
    plan.fingerprint = object.at("fingerprint").get<std::string>();
    plan.steps = object.at("steps").size();
    return plan;
  } catch (const json::exception& failure) {
    refuse(failure.what());
  }
  return {};
}

}  // namespace scarp
