// Speed against accuracy of everything, each figure in one run with what it is compared with.
//   scripts/bench all [--output DIR] [--scale 0.1,1,10] [--keep] [--check]
// Writes the page of `scarp compare` for Big Tujunga, with what other programs make of it that are
// installed (GRASS, Embree), a flight with every method of culling, and builds by size.
//   --keep   ratios of time and errors become tests/bench/kept.json
//   --check  says what became slower or less accurate than that, exit 1 where anything did;
//            without --output nothing is written
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "cli/compare/compared_ground.h"
#include "cli/compare/compared_page.h"
#include "cli/compare/groups_job.h"
#include "cli/compare/jobs.h"
#include "cli/stopwatch.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/view_limits.h"
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

struct Options {
  std::string output, scale = "0.1,1,10";
  bool keep = false, check = false;
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
    else
      throw Error(
          ErrorCode::kUsage,
          fmt::format("'{}': --output DIR, --scale N,N, --keep or --check was expected", name));
  }
  if (options.output.empty() && !options.check && !options.keep) options.output = "out/compared";
  return options;
}

void run(const std::string& line) {
  if (std::system(line.c_str()) != 0)
    throw Error(ErrorCode::kResource, fmt::format("'{}' failed", line));
}

bool has_grass() {
  return std::system("command -v grass > /dev/null") == 0;
}

/// The square as a file that other programs read.
void write_square(const ComparedGround& ground, const std::string& path) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), ground.dem.columns, ground.dem.rows, 1, GDT_Float32, nullptr));
  std::array<double, 6> to_map = ground.dem.geotransform;
  dataset->SetGeoTransform(to_map.data());
  dataset->SetProjection(ground.dem.frame->description().crs_wkt.c_str());
  std::vector<double> heights_m = ground.dem.heights_m;
  if (dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, ground.dem.columns, ground.dem.rows,
                                          heights_m.data(), ground.dem.columns, ground.dem.rows,
                                          GDT_Float64, 0, 0, nullptr) != CE_None)
    throw Error(ErrorCode::kResource, fmt::format("'{}' cannot be written", path));
}

std::vector<double> read_raster(const std::string& path) {
  GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!dataset) throw Error(ErrorCode::kResource, fmt::format("'{}' cannot be read", path));
  const int columns = dataset->GetRasterXSize(), rows = dataset->GetRasterYSize();
  std::vector<double> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  if (dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns,
                                          rows, GDT_Float64, 0, 0, nullptr) != CE_None)
    throw Error(ErrorCode::kResource, fmt::format("'{}' cannot be read", path));
  return values;
}

/// Runs commands of GRASS over the square, in a project of its own.
/// @return seconds of the one command that is timed
double run_grass(const std::string& square, const std::string& timed, const std::string& then,
                 const test::TempFolder& folder) {
  const std::string script = folder.path("grass.sh"), time = folder.path("grass.time");
  std::ofstream(script) << "set -e\nr.in.gdal -o --quiet input='" << square
                        << "' output=dem\ng.region raster=dem\nstart=$(date +%s.%N)\n"
                        << timed << " > /dev/null 2>&1\necho $start $(date +%s.%N) > '" << time
                        << "'\n"
                        << then << '\n';
  run(fmt::format("grass --tmp-location '{}' --exec bash '{}' > /dev/null 2>&1", square, script));
  double begun_s = 0, ended_s = 0;
  std::ifstream(time) >> begun_s >> ended_s;
  return ended_s - begun_s;
}

ViewshedPeer grass_viewshed(const ComparedGround& ground, const std::string& square,
                            const test::TempFolder& folder) {
  const auto command = [&ground](const ComparedGround::Eye& eye) {
    return fmt::format(
        "r.viewshed -b -c input=dem output=seen coordinates={:.10g},{:.10g} observer_elevation=2 "
        "memory=4000",
        ground.dem.x_of(eye.column), ground.dem.y_of(eye.row));
  };
  return {
      "r.viewshed", "grid", command(ground.eyes.front()),
      [&ground, square, &folder, command](const ComparedGround::Eye& eye, std::span<Seen> seen) {
        const std::string out = folder.path("seen.tif");
        const double seconds = run_grass(square, command(eye),
                                         "r.out.gdal --overwrite input=seen output='" + out +
                                             "' type=Byte nodata=255 "
                                             "format=GTiff",
                                         folder);
        const std::vector<double> values = read_raster(out);
        for (std::size_t i = 0; i < seen.size(); ++i)
          seen[i] = values[i] == 1 ? Seen::kVisible : Seen::kHidden;
        return seconds;
      }};
}

HorizonPeer grass_horizon(const ComparedGround& ground, const std::string& square,
                          const test::TempFolder& folder) {
  const std::string command =
      fmt::format("r.horizon elevation=dem step={} start=0 output=h", 360.0 / kComparedAzimuths);
  const double looks =
      static_cast<double>(ground.dem.columns) * ground.dem.rows * kComparedAzimuths;
  return {
      "r.horizon", "every cell", command, looks,
      [&ground, square, &folder, command](std::span<const ComparedGround::Eye> places,
                                          std::span<double> elevation_deg) {
        std::string then;
        for (int i = 0; i < kComparedAzimuths; ++i)
          then += fmt::format(
              "r.out.gdal -f --overwrite input=$(g.list raster pattern='h_*' | sed -n {}p) "
              "output='{}' type=Float32 format=GTiff\n",
              i + 1, folder.path(fmt::format("h{}.tif", i)));
        const double seconds = run_grass(square, command, then, folder);
        for (int i = 0; i < kComparedAzimuths; ++i) {
          const std::vector<double> values = read_raster(folder.path(fmt::format("h{}.tif", i)));
          // It counts from east, against the clock; elevations are radians.
          const int azimuth = (kComparedAzimuths / 4 - i + kComparedAzimuths) % kComparedAzimuths;
          for (std::size_t p = 0; p < places.size(); ++p)
            elevation_deg[p * kComparedAzimuths + static_cast<std::size_t>(azimuth)] =
                values[static_cast<std::size_t>(places[p].row) *
                           static_cast<std::size_t>(ground.dem.columns) +
                       static_cast<std::size_t>(places[p].column)] *
                180 / std::numbers::pi;
        }
        return seconds;
      }};
}

/// The sums of a flight, method by method.
ComparedJob compare_flight(const std::string& scarp, const std::string& dem,
                           const test::TempFolder& folder) {
  ComparedJob job;
  job.name = "flight";
  job.title = "Wrong pixels of a walk, and what they gain";
  job.notes = {
      "Big Tujunga with 20,000 vertices, 40 frames at 2 m along a valley, 640 pixels wide."};
  job.charts = {{"find_ms", "milliseconds to find what is visible, median of the frames",
                 "wrong_pixels", "wrong pixels a frame", ""},
                {"drawn_of_visible", "triangles drawn, of those in visible groups", "wrong_pixels",
                 "wrong pixels a frame", ""}};
  const std::string scene = folder.path("s.scene"), out = folder.path("flight");
  const std::string fly = fmt::format("fly S --route walk --frames 40 --seed {}", kSeed);
  run(fmt::format("'{}' build '{}' -o '{}' --vertices 20000 --horizon both > /dev/null", scarp, dem,
                  scene));
  run(fmt::format(
      "'{}' fly '{}' --route walk --frames 40 --seed {} --pictures 0 -o '{}' > /dev/null", scarp,
      scene, kSeed, out));
  std::ifstream csv(out + "/frames.csv");
  std::string line;
  std::getline(csv, line);
  const auto cells_of = [](const std::string& text) {
    std::vector<std::string> cells;
    std::istringstream list(text);
    for (std::string cell; std::getline(list, cell, ',');) cells.push_back(cell);
    return cells;
  };
  const std::vector<std::string> names = cells_of(line);
  const auto column = [&](const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end())
      throw Error(ErrorCode::kCorrupt, fmt::format("frames.csv: no column '{}'", name));
    return static_cast<std::size_t>(at - names.begin());
  };
  struct Sum {
    std::vector<double> find_ms;
    double drawn = 0, in_groups = 0, wrong = 0;
  };
  std::map<std::string, Sum> sums;
  while (std::getline(csv, line)) {
    const std::vector<std::string> cells = cells_of(line);
    Sum& sum = sums[cells[column("method")]];
    sum.find_ms.push_back(std::stod(cells[column("find_ms")]));
    sum.drawn += std::stod(cells[column("drawn")]);
    sum.in_groups += std::stod(cells[column("in_visible_groups")]);
    sum.wrong += std::stod(cells[column("wrong_px_x1")]);
  }
  for (auto& [method, sum] : sums) {
    std::sort(sum.find_ms.begin(), sum.find_ms.end());
    ComparedPoint point{method,
                        method,
                        {},
                        method == "certified",
                        false,
                        false,
                        "scarp " + fly + " --methods " + method};
    point.figures = {{"find_ms", sum.find_ms[sum.find_ms.size() / 2]},
                     {"drawn_of_visible", sum.drawn / std::max(1.0, sum.in_groups)},
                     {"wrong_pixels", sum.wrong / static_cast<double>(sum.find_ms.size())}};
    job.points.push_back(std::move(point));
  }
  return job;
}

/// Slope of a line through the logarithms.
double fitted_exponent(const std::vector<ComparedPoint>& points, const std::string& figure) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const ComparedPoint& p : points) {
    const double x = std::log(p.figures.at("samples")), y = std::log(p.figures.at(figure));
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

ComparedJob compare_scale(const std::string& bench, const std::string& millions,
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
    ComparedPoint point{"scarp build",
                        fmt::format("{:.3g} M", 1e-6 * row["samples"].get<double>()),
                        {},
                        false,
                        false,
                        false,
                        "scripts/bench scale " + options};
    for (const auto& [name, value] : row.items()) point.figures[name] = value;
    job.points.push_back(std::move(point));
  }
  job.notes = {
      "Fractal mountains, --max-error 20 --fans 32 --memory 2GiB.",
      fmt::format("Time grows as samples to the power of {:.2f}, time of processors {:.2f}, "
                  "memory {:.2f}.",
                  fitted_exponent(job.points, "seconds"),
                  fitted_exponent(job.points, "cpu_seconds"),
                  fitted_exponent(job.points, "peak_mib"))};
  job.charts = {{"samples", "samples", "seconds", "seconds of a build", "scarp build"},
                {"samples", "samples", "peak_mib", "greatest memory, MiB", "scarp build"}};
  return job;
}

ComparedRun measure(const Options& options, const std::string& dem, const fs::path& programs) {
  const test::TempFolder folder;
  const ComparedGround ground = read_compared_ground({dem}, {}, kSide, 3, kSeed);
  const std::string square = folder.path("square.tif");
  write_square(ground, square);
  std::vector<ViewshedPeer> viewsheds;
  std::vector<HorizonPeer> horizons;
  if (has_grass()) {
    viewsheds.push_back(grass_viewshed(ground, square, folder));
    horizons.push_back(grass_horizon(ground, square, folder));
  }
  if (auto embree = test::embree_horizons(ground)) horizons.push_back(std::move(*embree));
  ComparedRun all;
  all.title = "Speed against accuracy";
  all.facts = machine_facts();
  all.facts["command"] = "scripts/bench all --scale " + options.scale;
  const FileDigest digest = digest_of_file(dem);
  all.facts["input " + fs::path(dem).filename().string()] =
      fmt::format("{} bytes, XXH3-128 {}", digest.size, to_hex(digest.checksum));
  const auto say = [](const char* what) { fmt::print(stderr, "{}\n", what); };
  say("viewsheds");
  all.jobs.push_back(compare_viewsheds(ground, {}, viewsheds));
  say("heights");
  all.jobs.push_back(compare_heights(ground, {}));
  say("horizons");
  all.jobs.push_back(compare_horizons(ground, kSeed, {}, horizons));
  say("meshes");
  all.jobs.push_back(compare_meshes(ground, {}));
  say("groups");
  const Mesh mesh = mesh_samples(ground.samples, {.vertex_budget = 8'000}, {});
  const TinIndex index(mesh.tin);
  all.jobs.push_back(compare_groups(
      {mesh.tin, index, *ground.dem.frame, {}, "scarp build DEM -o S --vertices 8000"}, {},
      [](const std::string&) { return Progress([](double) {}); }));
  say("flight");
  all.jobs.push_back(compare_flight((programs.parent_path() / "scarp").string(), dem, folder));
  say("scale");
  if (!options.scale.empty())
    all.jobs.push_back(compare_scale((programs / "scale_bench").string(), options.scale, folder));
  // The temporary square is nobody's business.
  for (ComparedJob& job : all.jobs)
    for (ComparedPoint& p : job.points) {
      const std::string path = dem;
      for (std::size_t at; (at = p.command.find(path)) != std::string::npos;)
        p.command.replace(at, path.size(), fs::path(dem).filename().string());
    }
  return all;
}

/// What is kept of a run: times as ratios to a point of the same job, errors as they are.
json kept_of(const ComparedRun& run) {
  static const std::map<std::string, std::string> kTimes = {
      {"viewshed", "seconds"}, {"heights", "seconds"}, {"horizon", "ns_a_point_and_direction"},
      {"mesh", "seconds"},     {"groups", "seconds"},  {"flight", "find_ms"}};
  json kept = json::object();
  for (const ComparedJob& job : run.jobs) {
    const auto time = kTimes.find(job.name);
    if (time == kTimes.end()) continue;
    const auto usual = std::find_if(job.points.begin(), job.points.end(),
                                    [](const ComparedPoint& p) { return p.is_default; });
    if (usual == job.points.end()) continue;
    for (const ComparedPoint& p : job.points)
      kept[job.name][p.method + ", " + p.setting] = {
          {"time_ratio", p.figures.at(time->second) / usual->figures.at(time->second)},
          {"error", p.figures.at(job.charts.back().y)}};
  }
  return kept;
}

/// @return how many became worse
int compare_with_kept(const json& kept, const json& now) {
  constexpr double kSlower = 2, kLessAccurate = 1.05, kLeastError = 1e-4;
  int worse = 0;
  for (const auto& [job, points] : kept.items())
    for (const auto& [name, was] : points.items()) {
      if (!now.contains(job) || !now[job].contains(name)) {
        fmt::print("{}: {}: was not measured\n", job, name);
        continue;
      }
      const json& is = now[job][name];
      const double ratio = is["time_ratio"].get<double>() / was["time_ratio"].get<double>();
      const double error = is["error"], was_error = was["error"];
      if (ratio > kSlower) {
        fmt::print("{}: {}: slower, {:.2f}x what it was beside the default\n", job, name, ratio);
        ++worse;
      }
      if (error > kLessAccurate * was_error + kLeastError) {
        fmt::print("{}: {}: less accurate, {:.4g} in place of {:.4g}\n", job, name, error,
                   was_error);
        ++worse;
      }
    }
  if (worse == 0) fmt::print("nothing became slower or less accurate\n");
  return worse;
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
  const ComparedRun all = measure(options, *dem, std::filesystem::canonical(argv[0]).parent_path());
  if (!options.output.empty()) {
    std::filesystem::create_directories(std::filesystem::path(options.output).parent_path());
    write_comparison(all, options.output, Existing::kReplace);
    fmt::print("{}/compare.html\n", options.output);
  }
  const nlohmann::json kept = kept_of(all);
  const std::string kept_file = SCARP_SOURCE_DIR "/tests/bench/kept.json";
  if (options.keep) std::ofstream(kept_file) << kept.dump(1) << '\n';
  if (options.check)
    return compare_with_kept(nlohmann::json::parse(std::ifstream(kept_file)), kept) > 0 ? 1 : 0;
} catch (const std::exception& failure) {
  fmt::print(stderr, "all_bench: {}\n", failure.what());
  return 1;
}
