#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <variant>

#include "cli/commands.h"
#include "cli/compare/compared_ground.h"
#include "cli/compare/compared_page.h"
#include "cli/compare/flight_job.h"
#include "cli/compare/grass_peers.h"
#include "cli/compare/groups_job.h"
#include "cli/compare/jobs.h"
#include "cli/compare/scale_job.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/stopwatch.h"
#include "core/error/error.h"
#include "ingest/mesh/mesh.h"
#include "tiles/store/checksum.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;

constexpr int kEyesOfViewsheds = 3;
/// Facts that name jobs begin so.
constexpr char kLeftOut[] = "left out: ", kNoTime[] = "for lack of time; give --time more";
/// Groups of a DEM are those of a mesh with so many vertices at most: certifying is what takes
/// time.
constexpr std::uint32_t kMostVertices = 8'000;

/// Of the time that is left: what measuring by size may take, and then groups, so that flights
/// follow.
constexpr double kScaleShare = 0.3, kGroupsShare = 0.7;
/// Frames of each flight.
constexpr int kFrames = 10;

/// Sides of the square that is judged sample by sample, by the time that there is.
std::int32_t side_within(double limit_s) {
  return limit_s >= 240 ? 512 : limit_s >= 60 ? 256 : 128;
}

std::int64_t whole_parameter(const SceneDescription& scene, const char* name,
                             std::int64_t otherwise) {
  const auto found = scene.parameters.find(name);
  if (found == scene.parameters.end()) return otherwise;
  const auto* value = std::get_if<std::int64_t>(&found->second);
  return value ? *value : otherwise;
}

/// What the scene's groups were asked to be, grown as certified regions like them best.
HiddenTogetherOptions growth_of(const SceneDescription& scene) {
  HiddenTogetherOptions growth;
  growth.seed = static_cast<std::uint64_t>(
      whole_parameter(scene, "seed", static_cast<std::int64_t>(growth.seed)));
  growth.group_triangles =
      static_cast<std::uint32_t>(whole_parameter(scene, "group_triangles", growth.group_triangles));
  growth.min_group_triangles = static_cast<std::uint32_t>(
      whole_parameter(scene, "min_group_triangles", growth.min_group_triangles));
  return growth;
}

/// What a file is, wherever it lies.
std::string fact_of_file(const std::string& path) {
  std::error_code no_file;
  if (!fs::is_regular_file(path, no_file)) return "no plain file";
  const FileDigest digest = digest_of_file(path);
  return fmt::format("{} bytes, XXH3-128 {}", digest.size, to_hex(digest.checksum));
}

class Comparing {
 public:
  explicit Comparing(const CompareOptions& options)
      : options_(options), bar_(!options.common.json) {}

  ComparedRun run() {
    run_.title =
        "Speed against accuracy: " + fs::path(options_.sources.front()).filename().string();
    run_.facts = machine_facts();
    run_.facts["command"] =
        fmt::format("scarp compare '{}' -o DIR --time {:g}s --seed {} --eyes {} --heights {:g}",
                    fmt::join(options_.sources, "' '"), options_.limit_s, options_.seed,
                    options_.eyes, fmt::join(options_.heights_m, ","));
    if (const std::string* scene = scene_among(options_.sources, options_.dem))
      compare_scene(*scene);
    else
      compare_dem();
    name_commands(run_);
    bar_.clear();
    return std::move(run_);
  }

 private:
  StageProgress stages() {
    return [this](const std::string& name) { return bar_.stage(name); };
  }

  double left_s() const { return options_.limit_s - watch_.seconds(); }

  GroupsQuestion question() const {
    GroupsQuestion question;
    question.eyes = options_.eyes;
    question.heights_m = options_.heights_m;
    question.seed = options_.seed;
    question.limit_s = kGroupsShare * left_s();
    return question;
  }

  /// Adds a job, or says why it is not there.
  void add(const char* name, std::optional<ComparedJob> job, const std::string& why) {
    if (job)
      run_.jobs.push_back(*std::move(job));
    else
      run_.facts[kLeftOut + std::string(name)] = why;
  }

  void fly_over(const FlownGround& ground, const std::string& words, const std::string& commands,
                const std::string& scene) {
    FlightQuestion question;
    question.routes = {"walk", "helicopter"};
    question.frames = kFrames;
    question.seed = options_.seed;
    question.limit_s = left_s();
    question.ground = words;
    question.commands = commands;
    question.scene = scene;
    std::string why;
    auto job = compare_flight(ground, question, bar_.stage("flight"), why);
    add("flight", std::move(job), why);
  }

  void compare_scene(const std::string& path) {
    const LoadedScene scene(path, {options_.common.memory_budget_bytes});
    for (const SourceFile& source : scene.scene.description().sources)
      run_.facts["input " + source.name] =
          fmt::format("{} bytes, XXH3-128 {}", source.size, to_hex(source.checksum));
    run_.jobs.push_back(
        compare_groups({scene.tin, scene.index, scene.frame, growth_of(scene.scene.description()),
                        "scarp build DEM -o S"},
                       question(), stages()));
    fly_over(flown(scene), fmt::format("The scene's {} groups", scene.groups.leaf_count), "",
             "'" + path + "'");
  }

  void compare_dem() {
    const ComparedGround ground =
        read_compared_ground(options_.sources, options_.dem, side_within(options_.limit_s),
                             kEyesOfViewsheds, options_.seed);
    for (const std::string& file : options_.sources)
      run_.facts["input " + fs::path(file).filename().string()] = fact_of_file(file);
    run_.facts["command"] += ground.surface_flags;
    if (!ground.cut_command.empty()) run_.facts["square.tif"] = ground.cut_command;
    std::string why;
    const std::unique_ptr<GrassPeers> grass = GrassPeers::find(ground, why);
    std::vector<ViewshedPeer> viewsheds;
    std::vector<HorizonPeer> horizons;
    if (grass) {
      viewsheds.push_back(grass->viewshed());
      horizons.push_back(grass->horizon());
    }
    const auto compare = [&](const char* name, const auto& job) {
      if (watch_.seconds() < options_.limit_s)
        run_.jobs.push_back(job(bar_.stage(name)));
      else
        run_.facts[kLeftOut + std::string(name)] = kNoTime;
    };
    compare("viewsheds",
            [&](const Progress& p) { return compare_viewsheds(ground, p, viewsheds); });
    compare("heights", [&](const Progress& p) { return compare_heights(ground, p); });
    compare("horizons", [&](const Progress& p) {
      return compare_horizons(ground, options_.seed, p, horizons);
    });
    compare("meshes", [&](const Progress& p) { return compare_meshes(ground, p); });
    std::string no_scale = kNoTime;
    ScaleQuestion scale{options_.sources, options_.dem, options_.seed, kScaleShare * left_s(),
                        options_.common.memory_budget_bytes};
    auto by_size = compare_scale(scale, bar_.stage("scale"), no_scale);
    add("scale", std::move(by_size), no_scale);
    compare_groups_and_fly(ground);
    if (!grass)
      for (ComparedJob& job : run_.jobs)
        for (const auto& [name, program] :
             {std::pair("viewshed", "r.viewshed"), std::pair("horizon", "r.horizon")})
          if (job.name == name) job.left_out.push_back(fmt::format("{}: {}", program, why));
  }

  /// Groups of a mesh, prepared in several ways; and then flights over them.
  void compare_groups_and_fly(const ComparedGround& ground) {
    if (left_s() <= 0) {
      for (const char* name : {"groups", "flight"}) add(name, {}, kNoTime);
      return;
    }
    const Mesh mesh = mesh_samples(ground.samples, {.vertex_budget = kMostVertices}, {});
    const TinIndex index(mesh.tin);
    HiddenTogetherOptions growth;
    growth.seed = options_.seed;
    const std::string build =
        fmt::format("scarp build '{}' -o S --vertices {}{}", fmt::join(ground.files, "' '"),
                    kMostVertices, ground.surface_flags);
    Groups groups;
    run_.jobs.push_back(compare_groups({mesh.tin, index, *ground.dem.frame, growth, build},
                                       question(), stages(), &groups));
    if (groups.leaf_count == 0) return add("flight", {}, kNoTime);
    fly_over({mesh.tin, index, groups, *ground.dem.frame, !groups.nodes.empty(), "the square"},
             fmt::format("The square's {} groups", groups.leaf_count),
             build + " --horizon both && ", "S");
  }

  const CompareOptions& options_;
  ProgressBar bar_;
  const Stopwatch watch_;
  ComparedRun run_;
};

void print_table(const ComparedJob& job) {
  fmt::print("{}\n", job.title);
  if (job.charts.empty()) return;
  std::vector<std::string> figures;
  for (const ComparedChart& chart : job.charts)
    for (const std::string& name : {chart.x, chart.y})
      if (std::find(figures.begin(), figures.end(), name) == figures.end()) figures.push_back(name);
  fmt::print("  {:<28} {:<24}", "method", "setting");
  for (const std::string& figure : figures) fmt::print(" {:>24}", figure);
  fmt::print("\n");
  for (const ComparedPoint& p : job.points) {
    fmt::print("  {:<28} {:<24}", p.method, p.setting + (p.is_default ? " *" : ""));
    for (const std::string& figure : figures)
      fmt::print(" {:>24}",
                 p.figures.contains(figure) ? fmt::format("{:.4g}", p.figures.at(figure)) : "");
    fmt::print("{}\n", p.is_unsafe ? "  culls some that are visible" : "");
  }
  for (const std::string& line : job.left_out) fmt::print("  Left out: {}\n", line);
}

}  // namespace

int run_compare(const CompareOptions& options) {
  for (const double height_m : options.heights_m)
    if (!(std::abs(height_m) <= 1e7))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--heights {}: metres above ground were expected", height_m));
  PartFolder folder(options.output, kComparisonName, existing(options.common));
  const ComparedRun run = Comparing(options).run();
  write_comparison(run, folder);
  if (options.common.json) {
    fmt::print("{}\n", to_json(run).dump(2));
    return 0;
  }
  for (const ComparedJob& job : run.jobs) print_table(job);
  for (const auto& [name, why] : run.facts)
    if (name.starts_with(kLeftOut)) fmt::print("L{}, {}\n", name.substr(1), why);
  fmt::print("* default. Charts: {}/compare.html\n", options.output);
  return 0;
}

}  // namespace scarp
