// Speed against accuracy of everything, each figure in one run with what it is compared with.
//   scripts/bench all [--output DIR] [--scale 0.1,1,10] [--only JOB,JOB] [--keep] [--check]
// Writes the page of `scarp compare` for Big Tujunga, with what other programs make of it that are
// installed (GRASS, Embree), a flight with every method of culling, and builds by size.
//   --keep   the least times of three runs, and the errors, become tests/bench/kept.json
//   --check  says what became slower or less accurate than that, exit 1 where anything did: half as
//            slow again beside how much slower this machine is than that of the kept times, three
//            times in a row, or an error greater by a twentieth. Without --output nothing is
//            written
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/compare/compared_ground.h"
#include "cli/compare/compared_page.h"
#include "cli/compare/flight_job.h"
#include "cli/compare/grass_peers.h"
#include "cli/compare/groups_job.h"
#include "cli/compare/jobs.h"
#include "cli/compare/scale_job.h"
#include "cli/loaded_scene.h"
#include "cli/stopwatch.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "ingest/mesh/mesh.h"
#include "tests/bench/embree_horizons.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"
#include "tiles/store/checksum.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::int32_t kSide = 512;
constexpr std::uint64_t kSeed = 1;
/// Of everything, for what is kept and before anything is called slower.
constexpr int kRuns = 3;

struct Options {
  std::string output, scale = "0.1,1,10", only;
  bool keep = false, check = false;

  bool wants(const std::string& job) const {
    return only.empty() || only.find(fmt::format(",{},", job)) != std::string::npos;
  }
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--keep")
      options.keep = true;
    else if (name == "--check")
      options.check = true;
    else if (name == "--output" && i + 1 < argc)
      options.output = argv[++i];
    else if (name == "--scale" && i + 1 < argc)
      options.scale = argv[++i];
    else if (name == "--only" && i + 1 < argc)
      options.only = "," + std::string(argv[++i]) + ",";
    else
      throw Error(
          ErrorCode::kUsage,
          fmt::format(
              "'{}': --output DIR, --scale N,N, --only JOB,JOB, --keep or --check was expected",
              name));
  }
  if (options.keep && !options.only.empty())
    throw Error(ErrorCode::kUsage, "--keep: keeps all jobs; leave --only out");
  if (options.output.empty() && !options.check && !options.keep) options.output = "out/compared";
  return options;
}

void run(const std::string& line) {
  if (std::system(line.c_str()) != 0)
    throw Error(ErrorCode::kResource, fmt::format("'{}' failed", line));
}

ComparedJob fly_over_bigtujunga(const std::string& scarp, const std::string& dem,
                                const test::TempFolder& folder) {
  const std::string path = folder.path("s.scene");
  run(fmt::format("'{}' build '{}' -o '{}' --vertices 20000 --horizon both > /dev/null", scarp, dem,
                  path));
  const LoadedScene scene(path, {});
  FlightQuestion question;
  question.routes = {"walk", "helicopter", "airliner"};
  question.seed = kSeed;
  question.limit_s = HUGE_VAL;
  question.ground = "Big Tujunga with 20,000 vertices";
  question.commands = fmt::format("scarp build '{}' -o S --vertices 20000 --horizon both && ", dem);
  question.scene = "S";
  std::string why;
  auto job = compare_flight(flown(scene), question, {}, why);
  if (!job) throw Error(ErrorCode::kResource, "no flight: " + why);
  return *std::move(job);
}

ComparedJob build_by_size(const std::string& bench, const std::string& millions,
                          const test::TempFolder& folder) {
  ComparedJob job;
  job.name = "scale";
  job.title = "Builds by size";
  const std::string rows_file = folder.path("scale.json");
  const std::string options =
      fmt::format("--samples {} --memory 2GiB --max-error 20 --fans 32", millions);
  run(fmt::format("'{}' {} --json '{}' > /dev/null", bench, options, rows_file));
  const json rows = json::parse(std::ifstream(rows_file));
  for (const json& row : rows) {
    ComparedPoint point{
        "scarp build",
        fmt::format("{:g} M", std::round(1e-4 * row["samples"].get<double>()) / 100),
        {},
        false,
        false,
        false,
        "scripts/bench scale " + options};
    for (const auto& [name, value] : row.items()) point.figures[name] = value;
    job.points.push_back(std::move(point));
  }
  const auto exponents = [&](std::size_t last) {
    const auto points = std::span(job.points).last(std::min(last, job.points.size()));
    return fmt::format("{:.2f}, time of processors {:.2f}, memory {:.2f}",
                       fitted_exponent(points, "seconds"), fitted_exponent(points, "cpu_seconds"),
                       fitted_exponent(points, "peak_mib"));
  };
  job.notes = {"Fractal mountains, --max-error 20 --fans 32 --memory 2GiB; each built once."};
  if (job.points.size() > 1) {
    job.notes.push_back(fmt::format("Time grows as samples to the power of {} over all sizes;",
                                    exponents(job.points.size())));
    job.notes.push_back(
        fmt::format("{} between the two largest, where pictures and the program's "
                    "start no longer count.",
                    exponents(2)));
  }
  job.charts = {
      {"samples", "samples", "seconds", "seconds of a build", "scarp build"},
      {"samples", "samples", "cpu_seconds", "processor seconds of a build", "scarp build"},
      {"samples", "samples", "peak_mib", "greatest memory, MiB", "scarp build"}};
  return job;
}

ComparedRun measure(const Options& options, const std::string& dem, const fs::path& programs) {
  const test::TempFolder folder;
  const ComparedGround ground = read_compared_ground({dem}, {}, kSide, 3, kSeed);
  std::string why;
  const auto grass = GrassPeers::find(ground, why);
  std::vector<ViewshedPeer> viewsheds;
  std::vector<HorizonPeer> horizons;
  if (grass) {
    viewsheds.push_back(grass->viewshed());
    horizons.push_back(grass->horizon());
  }
  if (auto embree = test::embree_horizons(ground)) horizons.push_back(std::move(*embree));
  ComparedRun all;
  all.title = "Speed against accuracy";
  all.facts = machine_facts();
  all.facts["command"] = "scripts/bench all --scale " + options.scale;
  const FileDigest digest = digest_of_file(dem);
  if (!ground.cut_command.empty()) all.facts["square.tif"] = ground.cut_command;
  all.facts["input " + fs::path(dem).filename().string()] =
      fmt::format("{} bytes, XXH3-128 {}", digest.size, to_hex(digest.checksum));
  const auto compare = [&](const std::string& job, const auto& run_job) {
    if (!options.wants(job)) return;
    fmt::print(stderr, "{}\n", job);
    all.jobs.push_back(run_job());
  };
  compare("viewshed", [&] { return compare_viewsheds(ground, {}, viewsheds); });
  compare("heights", [&] { return compare_heights(ground, {}); });
  compare("horizon", [&] { return compare_horizons(ground, kSeed, {}, horizons); });
  compare("mesh", [&] { return compare_meshes(ground, {}); });
  compare("groups", [&] {
    const Mesh mesh = mesh_samples(ground.samples, {.vertex_budget = 8'000}, {});
    const TinIndex index(mesh.tin);
    const std::string build =
        fmt::format("scarp build '{}' -o S --vertices 8000", ground.files.front());
    return compare_groups({mesh.tin, index, *ground.dem.frame, {}, build}, {},
                          [](const std::string&) { return Progress([](double) {}); });
  });
  compare("flight", [&] {
    return fly_over_bigtujunga((programs.parent_path() / "scarp").string(), dem, folder);
  });
  if (!options.scale.empty())
    compare("scale", [&] {
      return build_by_size((programs / "scale_bench").string(), options.scale, folder);
    });
  name_commands(all);
  const auto without_folder = [&](std::string& text) {
    for (std::size_t at; (at = text.find(dem)) != std::string::npos;)
      text.replace(at, dem.size(), fs::path(dem).filename().string());
  };
  for (auto& [name, fact] : all.facts) without_folder(fact);
  for (ComparedJob& job : all.jobs)
    for (ComparedPoint& p : job.points) without_folder(p.command);
  return all;
}

/// The time that is kept of a job's points, and what of it is too short to be compared.
struct KeptTime {
  std::string figure;
  double least;
};
const std::map<std::string, KeptTime> kKeptTimes = {{"viewshed", {"seconds", 1e-4}},
                                                    {"heights", {"seconds", 1e-4}},
                                                    {"horizon", {"ns_a_point_and_direction", 1}},
                                                    {"mesh", {"seconds", 1e-3}},
                                                    {"groups", {"seconds", 1e-3}},
                                                    {"flight", {"find_ms", 0.01}}};

/// Times and errors of a run: job, point, {time, errors by figure}.
json kept_of(const ComparedRun& run) {
  json kept = json::object();
  for (const ComparedJob& job : run.jobs) {
    const auto time = kKeptTimes.find(job.name);
    if (time == kKeptTimes.end()) continue;
    for (const ComparedPoint& p : job.points) {
      json errors = json::object();
      for (const ComparedChart& chart : job.charts)
        if (const auto found = p.figures.find(chart.y); found != p.figures.end())
          errors[chart.y] = found->second;
      kept[job.name][p.method + ", " + p.setting] = {{"time", p.figures.at(time->second.figure)},
                                                     {"errors", errors}};
    }
  }
  return kept;
}

/// Calls see(job, point, kept, now) for what both have.
template <typename See>
void for_each_of_both(const json& kept, const json& now, const See& see) {
  for (const auto& [job, points] : kept.items())
    for (const auto& [name, was] : points.items())
      if (now.contains(job) && now[job].contains(name)) see(job, name, was, now[job][name]);
}

/// The lesser time of two runs for each point: what is slow only once was disturbed.
void take_lesser_times(json& into, const json& other) {
  for_each_of_both(
      other, into, [&](const auto& job, const auto& name, const json& a, const json& b) {
        into[job][name]["time"] =
            std::min(a["time"].template get<double>(), b["time"].template get<double>());
      });
}

/// How much slower this machine is, now: the median over all points. What becomes slower in one
/// place hardly moves it.
double drift_of(const json& kept, const json& now) {
  std::vector<double> ratios;
  for_each_of_both(kept, now, [&](const auto&, const auto&, const json& was, const json& is) {
    ratios.push_back(is["time"].template get<double>() / was["time"].template get<double>());
  });
  if (ratios.empty()) return 1;
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  return ratios[ratios.size() / 2];
}

/// What became worse, a line each.
struct Worse {
  std::vector<std::string> slower, less_accurate, missing;
};

Worse compare_with_kept(const json& kept, const json& now) {
  constexpr double kSlower = 1.5, kLessAccurate = 1.05, kLeastError = 1e-4;
  const double drift = drift_of(kept, now);
  Worse worse;
  for (const auto& [job, points] : kept.items())
    for (const auto& [name, was] : points.items())
      if (!now.contains(job) || !now[job].contains(name))
        worse.missing.push_back(fmt::format("{}: {}: was not measured", job, name));
  for_each_of_both(
      kept, now,
      [&](const std::string& job, const std::string& name, const json& was, const json& is) {
        const double was_time = was["time"], time = is["time"].get<double>() / drift;
        if (time > kSlower * was_time + kKeptTimes.at(job).least)
          worse.slower.push_back(
              fmt::format("{}: {}: slower, {:.2f}x what is kept, where all is {:.2f}x", job, name,
                          drift * time / was_time, drift));
        for (const auto& [figure, was_error] : was["errors"].items()) {
          const double error = is["errors"].value(figure, HUGE_VAL);
          if (error > kLessAccurate * was_error.get<double>() + kLeastError)
            worse.less_accurate.push_back(fmt::format("{}: {}: {} is {:.4g} in place of {:.4g}",
                                                      job, name, figure, error,
                                                      was_error.get<double>()));
        }
      });
  return worse;
}

/// What is kept of the jobs that are wanted.
json kept_of_wanted(json kept, const Options& options) {
  for (const auto& [job, time] : kKeptTimes)
    if (!options.wants(job)) kept.erase(job);
  return kept;
}

/// @return how many points became worse
std::size_t say(const Worse& worse) {
  for (const auto* lines : {&worse.missing, &worse.slower, &worse.less_accurate})
    for (const std::string& line : *lines) fmt::print("{}\n", line);
  const std::size_t count = worse.slower.size() + worse.less_accurate.size();
  if (count == 0) fmt::print("nothing became slower or less accurate\n");
  return count;
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) try {
  using namespace scarp;
  const Options options = parse(argc, argv);
  const auto dem = test::shared_data("projected/bigtujunga_srtm30m_utm11.tif");
  if (!dem) {
    fmt::print(stderr, "all_bench: the shared data are not there\n");
    return 1;
  }
  const std::filesystem::path programs = std::filesystem::canonical(argv[0]).parent_path();
  std::optional<PartFolder> folder;
  if (!options.output.empty()) {
    std::filesystem::create_directories(std::filesystem::path(options.output).parent_path());
    folder.emplace(options.output, kComparisonName, Existing::kReplace);
  }
  const ComparedRun all = measure(options, *dem, programs);
  if (folder) {
    write_comparison(all, *folder);
    fmt::print("{}/compare.html\n", options.output);
  }
  nlohmann::json now = kept_of(all);
  Options again = options;
  again.scale.clear();
  const std::string kept_file = SCARP_SOURCE_DIR "/tests/bench/kept.json";
  if (options.keep) {
    for (int run = 1; run < kRuns; ++run)
      take_lesser_times(now, kept_of(measure(again, *dem, programs)));
    std::ofstream(kept_file) << now.dump(1) << '\n';
  }
  if (options.check) {
    const nlohmann::json kept =
        kept_of_wanted(nlohmann::json::parse(std::ifstream(kept_file)), options);
    Worse worse = compare_with_kept(kept, now);
    for (int run = 1; run < kRuns && !worse.slower.empty(); ++run) {
      take_lesser_times(now, kept_of(measure(again, *dem, programs)));
      worse = compare_with_kept(kept, now);
    }
    return say(worse) > 0 ? 1 : 0;
  }
} catch (const std::exception& failure) {
  fmt::print(stderr, "all_bench: {}\n", failure.what());
  return 1;
}
