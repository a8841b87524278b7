// Terrain larger than memory: time, memory and bytes of builds by the size of the DEM, and what one
// question to a finished scene costs.
//   scripts/bench scale [--samples 4,16,100] [--memory 2GiB] [--max-error 30] [--fans 64]
//                       [--tile-samples 1024] [--dem FILE] [--folder DIR] [--json FILE]
// Makes its own terrain (tests/support/fractal_ground.h), millions of samples each; --dem takes a
// file instead. Each build runs the program itself, so that the kernel counts its memory alone.
#include <fcntl.h>
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/fractal_ground.h"
#include "tests/support/temp_folder.h"

extern char** environ;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kBlock = 512;

/// A GeoTIFF of 30 m in UTM, tiled and packed, written by rows of its tiles.
void write_fractal_dem(const std::string& path, int columns, int rows, std::uint64_t seed) {
  GDALAllRegister();
  const char* const options[] = {
      "TILED=YES", "BLOCKXSIZE=512", "BLOCKYSIZE=512", "COMPRESS=DEFLATE",
      "ZLEVEL=1",  "PREDICTOR=2",    nullptr};
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), columns, rows, 1, GDT_Int16, const_cast<char**>(options)));
  if (!dataset) throw std::runtime_error("cannot write " + path);
  double transform[6] = {400'000, 30, 0, 5'200'000, 0, -30};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:32632");
  dataset->SetSpatialRef(&crs);
  const scarp::test::FractalGround ground(seed);
  std::vector<std::int16_t> heights(static_cast<std::size_t>(columns) * kBlock);
  for (int row = 0; row < rows; row += kBlock) {
    const int count = std::min(kBlock, rows - row);
    for (int r = 0; r < count; ++r)
      ground.row(0, row + r,
                 std::span(heights).subspan(
                     static_cast<std::size_t>(r) * static_cast<std::size_t>(columns),
                     static_cast<std::size_t>(columns)));
    if (dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, row, columns, count, heights.data(),
                                            columns, count, GDT_Int16, 0, 0) != CE_None)
      throw std::runtime_error("cannot write " + path);
  }
}

struct Ran {
  double wall_s = 0, cpu_s = 0;
  double peak_mib = 0;  // as the kernel counts it, mapped pages included
  std::string output;
};

Ran run_program(const std::vector<std::string>& arguments, const std::string& output_file) {
  std::vector<char*> argv = {const_cast<char*>(SCARP_PROGRAM)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, output_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  const auto begun = std::chrono::steady_clock::now();
  pid_t child = 0;
  if (posix_spawn(&child, SCARP_PROGRAM, &actions, nullptr, argv.data(), environ) != 0)
    throw std::runtime_error("cannot run " SCARP_PROGRAM);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("scarp " + arguments[0] + " failed");
  Ran ran;
  ran.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  ran.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  ran.peak_mib = static_cast<double>(usage.ru_maxrss) / 1024;
  std::ostringstream text;
  text << std::ifstream(output_file).rdbuf();
  ran.output = text.str();
  return ran;
}

struct Options {
  std::vector<double> millions = {4, 16, 100};
  std::string memory = "2GiB", max_error = "30", fans = "64", tile_samples = "1024", dem, folder;
  std::string json_file;  // besides the table
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--samples") {
      options.millions.clear();
      std::istringstream list(value);
      for (std::string part; std::getline(list, part, ',');)
        options.millions.push_back(std::stod(part));
    } else if (name == "--memory") {
      options.memory = value;
    } else if (name == "--max-error") {
      options.max_error = value;
    } else if (name == "--fans") {
      options.fans = value;
    } else if (name == "--tile-samples") {
      options.tile_samples = value;
    } else if (name == "--dem") {
      options.dem = value;
    } else if (name == "--json") {
      options.json_file = value;
    } else if (name == "--folder") {
      options.folder = value;
    } else {
      throw std::runtime_error("unknown option " + name);
    }
  }
  return options;
}

std::uint64_t bytes_of_folder(const std::string& path) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

/// One size: a row of the table.
void measure(const Options& options, const std::string& dem, const std::string& folder,
             json& rows) {
  const std::string scene = folder + "/bench.scene", out = folder + "/out";
  const Ran build = run_program({"build", dem, "-o", scene, "--overwrite", "--json", "--memory",
                                 options.memory, "--max-error", options.max_error, "--fans",
                                 options.fans, "--tile-samples", options.tile_samples},
                                out);
  const json report = json::parse(build.output);
  const double samples =
      report["raster"]["columns"].get<double>() * report["raster"]["rows"].get<double>();
  const json raster = report["raster"];
  const json description = json::parse(std::ifstream(scene + "/scene.json"));
  const auto& g = description["raster"]["geotransform"];
  const std::string camera = fmt::format(
      "{},{},200", g[0].get<double>() + g[1].get<double>() * raster["columns"].get<double>() / 2,
      g[3].get<double>() + g[5].get<double>() * raster["rows"].get<double>() / 2);
  const Ran cull =
      run_program({"cull", scene, "--camera=" + camera, "--max-distance", "10000", "--json"}, out);
  const json answer = json::parse(cull.output);
  fmt::print("{:8.1f} {:9} {:9.1f} {:9.2f} {:9.2f} {:9.0f} {:9.2f} {:9.1f} {:5}/{:<5} {:8.1f}\n",
             samples / 1e6, report["mesh"]["triangles"].get<std::uint64_t>(), build.wall_s,
             1e6 * build.wall_s / samples, 1e6 * build.cpu_s / samples, build.peak_mib,
             static_cast<double>(bytes_of_folder(scene)) / samples,
             1e3 * answer["open_s"].get<double>(), answer["tiles_read"].get<int>(),
             answer["tiles"].get<int>(), 1e3 * answer["answer_s"].get<double>());
  rows.push_back({{"samples", samples},
                  {"seconds", build.wall_s},
                  {"cpu_seconds", build.cpu_s},
                  {"peak_mib", build.peak_mib},
                  {"bytes_a_sample", static_cast<double>(bytes_of_folder(scene)) / samples}});
  if (!options.json_file.empty()) std::ofstream(options.json_file) << rows.dump(1) << '\n';
  for (const json& stage : report["stages"])
    fmt::print("  {:<10} {:9.1f} s {:7.0f} MiB\n", stage["name"].get<std::string>(),
               stage["seconds"].get<double>(), stage["peak_memory_bytes"].get<double>() / 0x1p20);
  fmt::print(
      "  refinement saves {:.1f} % of the mesh, {:.1f} % of the ground that tiles see; {:.0f} "
      "MiB read, {:.0f} MiB written\n",
      100 * report["refinement"]["saved_of_mesh"].get<double>(),
      100 * report["refinement"].value("saved_of_seen_ground", 0.0),
      report["bytes_read"].get<double>() / 0x1p20, report["bytes_written"].get<double>() / 0x1p20);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  const Options options = parse(argc, argv);
  const scarp::test::TempFolder temporary;
  const std::string folder = options.folder.empty() ? temporary.folder().string() : options.folder;
  fs::create_directories(folder);
  fmt::print("--memory {} --max-error {} --fans {} --tile-samples {}\n", options.memory,
             options.max_error, options.fans, options.tile_samples);
  fmt::print("{:>8} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>11} {:>8}\n", "samples",
             "triangles", "build, s", "us/sample", "cpu us/s", "peak MiB", "B/sample", "open, ms",
             "tiles read", "cull, ms");
  json rows = json::array();
  if (!options.dem.empty()) {
    measure(options, options.dem, folder, rows);
    return 0;
  }
  for (const double millions : options.millions) {
    const int side = static_cast<int>(std::lround(std::sqrt(millions * 1e6)));
    const std::string dem = fmt::format("{}/fractal-{}.tif", folder, side);
    if (!fs::exists(dem)) write_fractal_dem(dem, side, side, 1);
    measure(options, dem, folder, rows);
  }
} catch (const std::exception& failure) {
  fmt::print(stderr, "{}\n", failure.what());
  return 1;
}
