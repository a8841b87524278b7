#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/build/run_plan.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "core/error/error.h"
#include "tiles/store/scene.h"

namespace scarp {
namespace {

nlohmann::json read_report(const std::string& scene) {
  return nlohmann::json::parse(std::ifstream(scene + "/report.json"));
}

void print_summary(const BuildOptions& options, const nlohmann::json& report) {
  const auto& mesh = report["mesh"];
  const auto& groups = report["groups"];
  double seconds = 0;
  std::uint64_t peak_bytes = 0;
  for (const auto& stage : report["stages"]) {
    seconds += stage["seconds"].get<double>();
    peak_bytes = std::max(peak_bytes, stage["peak_memory_bytes"].get<std::uint64_t>());
  }
  for (const auto& warning : report["warnings"])
    fmt::print(stderr, "scarp: warning: {}\n", warning.get<std::string>());
  fmt::print("{}: {} x {} samples, {} vertices, {} triangles, error {:.3f} m\n", options.scene,
             report["raster"]["columns"].get<int>(), report["raster"]["rows"].get<int>(),
             mesh["vertices"].get<std::uint64_t>(), mesh["triangles"].get<std::uint64_t>(),
             mesh["error_over_surface_m"].get<double>());
  fmt::print("{} groups, {} orphans; {:.1f} s, {:.0f} MiB\n", groups["groups"].get<std::uint64_t>(),
             groups["orphans"].get<std::uint64_t>(), seconds,
             static_cast<double>(peak_bytes) / 0x1p20);
  if (!report.contains("certified")) return;
  const auto& certified = report["certified"];
  fmt::print("certified with --fans {} --sectors {} --patch {:g}: {:.1f} bytes a triangle",
             certified["fans"].get<int>(), certified["sectors"].get<int>(),
             certified["patch"].get<double>(),
             certified["bytes"].get<double>() / mesh["triangles"].get<double>());
  for (const auto& row : report["verify"])
    if (row["method"] == "certified" && !row["share"].is_null())
      fmt::print("; {:g} m up it culls {:.0f} % of the hidden groups",
                 row["eye_height_m"].get<double>(), 100 * row["share"].get<double>());
  fmt::print("\n");
}

/// Options that would have no effect are a mistake.
void refuse_idle_options(const BuildOptions& options) {
  const auto refuse = [](const char* option, const char* wants) {
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: has no effect without {}; add that, or leave {} out", option,
                            wants, option));
  };
  const bool breadth_first = options.growth == Growth::kBreadthFirst;
  if (options.seeds && !breadth_first) refuse("--seeds", "--growth breadth-first");
  if (options.max_groups > 0 && !breadth_first) refuse("--max-groups", "--growth breadth-first");
  if (breadth_first && !has_stewart(options.horizon))
    throw Error(ErrorCode::kUsage,
                "--growth breadth-first: crystals grow by the horizons of the vertices; add "
                "--horizon stewart or --horizon both");
  if (options.subsectors && !has_stewart(options.horizon))
    refuse("--subsectors", "--horizon stewart or both");
  if (options.fans && !has_certified(options.horizon))
    refuse("--fans", "--horizon certified or both");
  if ((options.budget.seconds || options.budget.bytes_per_triangle) &&
      !has_certified(options.horizon))
    refuse("--budget", "--horizon certified or both");
  if (options.budget.seconds && options.fans)
    throw Error(ErrorCode::kUsage, "--fans: chosen by a --budget of time; give one of the two");
  if (options.budget.bytes_per_triangle && options.sectors)
    throw Error(ErrorCode::kUsage, "--sectors: chosen by a --budget of bytes; give one of the two");
  if (options.patch && !has_certified(options.horizon))
    refuse("--patch", "--horizon certified or both");
}

/// Rows of the thesis may be few; certified regions are kept for eighths of the circle.
void check_sectors(const BuildOptions& options) {
  if (!options.sectors || !has_certified(options.horizon)) return;
  if (*options.sectors % 8 != 0 || *options.sectors < 8)
    throw Error(ErrorCode::kUsage,
                fmt::format("--sectors {}: certified regions are kept for a multiple of 8 sectors; "
                            "give {}, or --horizon stewart",
                            *options.sectors, std::max(8, (*options.sectors + 4) / 8 * 8)));
}

void check_options(const BuildOptions& options) {
  if (options.dem_files.empty())
    throw Error(ErrorCode::kUsage,
                "no DEM: one or several rasters were expected; see scarp build --help");
  if (options.scene.empty())
    throw Error(ErrorCode::kUsage,
                "no scene to write: -o NAME was expected; see scarp build --help");
  if (options.max_error_m && !(*options.max_error_m >= 0 && *options.max_error_m < kLatticeReachM))
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--max-error {}: metres, zero or more, were expected", *options.max_error_m));
  refuse_idle_options(options);
  check_sectors(options);
}

/// Whether a finished scene is what a plan makes: its report, the last file before scene.json,
/// says.
bool is_made_by(const std::string& path, const BuildPlan& plan) {
  if (!is_scene(path)) return false;
  const nlohmann::json report =
      nlohmann::json::parse(std::ifstream(path + "/report.json"), nullptr, false);
  return report.is_object() && report.value("plan", "") == plan.fingerprint;
}

/// A build that was killed between its last file and its name.
bool finish_what_was_killed(Workspace& work) {
  const std::string& folder = work.writer().folder();
  if (!is_made_by(folder, work.plan())) return false;
  work.writer().finish_again();
  return true;
}

/// What a failed build leaves: what it finished, for --resume; nothing where it finished nothing,
/// or would fail in the same way.
bool is_worth_keeping(const Workspace& work, ErrorCode code) {
  return code != ErrorCode::kUsage && work.done_count() > 1;
}

void build_all(const BuildPlan& plan, ProgressBar& bar) {
  const bool resume = plan.options.resume;
  if (resume && is_made_by(plan.options.scene, plan)) return;
  Workspace work(plan, resume ? SceneWriter::Start::kResume : SceneWriter::Start::kAnew);
  if (resume && finish_what_was_killed(work)) return;
  try {
    run_plan(work, bar);
  } catch (const Error& error) {
    const bool keep = resume || is_worth_keeping(work, error.code());
    work.writer().keep_unfinished(keep);
    if (!keep) throw;
    throw Error(error.code(), fmt::format("{}; what was finished is kept in '{}', for --resume",
                                          error.what(), unfinished_scene(plan.options.scene)));
  }
}

int write_plan(const BuildOptions& options) {
  const BuildPlan plan = make_plan(options);
  const std::string text = to_json(plan).dump(2) + "\n";
  write_file(options.plan_file, std::as_bytes(std::span(text)), existing(options.common));
  if (options.common.json)
    fmt::print("{}", text);
  else
    fmt::print(
        "{}: {} steps, {} x {} samples in {} tiles; do them with scarp build --plan {} "
        "--step 0 to {}\n",
        options.plan_file, plan.steps.size(), plan.scheme.columns(), plan.scheme.rows(),
        plan.scheme.tiles(plan.scheme.finest_level()).size(), options.plan_file,
        plan.steps.size() - 1);
  return 0;
}

int build_one_step(const BuildOptions& options) {
  StoredPlan stored = read_plan(options.plan_file);
  stored.options.common.threads = options.common.threads;
  stored.options.common.memory_budget_bytes = options.common.memory_budget_bytes;
  const BuildPlan plan = make_plan(stored.options);
  if (plan.fingerprint != stored.fingerprint)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is of other sources or another version; the DEM as it was when "
                            "the plan was made was expected; make the plan again",
                            options.plan_file));
  bool was_done = is_made_by(plan.options.scene, plan);
  if (!was_done) {
    Workspace work(plan, SceneWriter::Start::kShare);
    ProgressBar bar(!options.common.json);
    was_done = !run_one_step(work, *options.step, bar);
    bar.clear();
  }
  const std::string name = plan.steps[*options.step].name();
  if (options.common.json)
    fmt::print(
        "{}\n",
        nlohmann::json{{"step", *options.step}, {"name", name}, {"was_done", was_done}}.dump(2));
  else
    fmt::print("step {}, '{}': {}\n", *options.step, name, was_done ? "was done already" : "done");
  return 0;
}

}  // namespace

int run_build(const BuildOptions& options) {
  if (options.step) return build_one_step(options);
  check_options(options);
  if (!options.plan_file.empty()) return write_plan(options);
  const BuildPlan plan = make_plan(options);
  ProgressBar bar(!options.common.json);
  build_all(plan, bar);
  bar.clear();
  const nlohmann::json report = read_report(options.scene);
  if (options.common.json)
    fmt::print("{}\n", report.dump(2));
  else
    print_summary(options, report);
  return 0;
}

}  // namespace scarp
