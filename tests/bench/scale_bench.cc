// Terrain larger than memory: time, memory and bytes of builds by the size of the DEM, and what one
// question to a finished scene costs.
//   scripts/bench scale [--samples 4,16,100] [--memory 2GiB] [--max-error 30] [--fans 64]
//                       [--tile-samples 1024] [--dem FILE] [--folder DIR] [--json FILE]
// Makes its own terrain (tests/support/fractal_ground.h), millions of samples each; --dem takes a
// file instead. Each build runs the program itself; memory is what the kernel counts for it, mapped
// pages included (VmHWM, which the build's report has: it sets it back, so that rusage knows less).
// --max-error default, --fans default and --tile-samples default leave a choice to the program.
// Ends in the table of docs/scale.md.
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
#include <map>
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

/// The options of a build that are not left to the program.
std::vector<std::string> chosen(const Options& options) {
  std::vector<std::string> arguments = {"--memory", options.memory};
  const auto add = [&](const char* name, const std::string& value) {
    if (value != "default") arguments.insert(arguments.end(), {name, value});
  };
  add("--max-error", options.max_error);
  add("--fans", options.fans);
  add("--tile-samples", options.tile_samples);
  return arguments;
}

/// Bytes of a scene's files by their endings: tin, groups, range, tif, png, json.
std::map<std::string, std::uint64_t> bytes_by_kind(const std::string& path) {
  std::map<std::string, std::uint64_t> bytes;
  for (const auto& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) bytes[entry.path().extension().string()] += entry.file_size();
  return bytes;
}

double sum_of(const std::map<std::string, std::uint64_t>& bytes) {
  double sum = 0;
  for (const auto& [kind, count] : bytes) sum += static_cast<double>(count);
  return sum;
}

/// One question to a finished scene, 10 km around its middle, as JSON.
struct Asked {
  Ran ran;
  json answer;
};

Asked ask(std::vector<std::string> question, const std::string& out) {
  question.insert(question.end(), {"--max-distance", "10000", "--json"});
  Asked asked;
  asked.ran = run_program(question, out);
  asked.answer = json::parse(asked.ran.output);
  return asked;
}

void print_build(const json& report, const Ran& build) {
  for (const json& stage : report["stages"])
    fmt::print("  {:<10} {:9.1f} s {:7.0f} MiB\n", stage["name"].get<std::string>(),
               stage["seconds"].get<double>(), stage["peak_memory_bytes"].get<double>() / 0x1p20);
  fmt::print(
      "  refinement saves {:.1f} % of the mesh, {:.1f} % of the ground that tiles see; {:.0f} "
      "MiB read, {:.0f} MiB written\n",
      100 * report["refinement"]["saved_of_mesh"].get<double>(),
      100 * report["refinement"].value("saved_of_seen_ground", 0.0),
      report["bytes_read"].get<double>() / 0x1p20, report["bytes_written"].get<double>() / 0x1p20);
  for (const json& row : report["verify"])
    fmt::print("  of groups hidden from {:g} m, {:.2f} are culled; {} of {} falsely\n",
               row["eye_height_m"].get<double>(), row["of_hidden"].get<double>(),
               row["falsely_culled"].get<std::uint64_t>(), row["triangles"].get<std::uint64_t>());
  fmt::print("  {:.0f} s, {:.2f} us a sample by the clock\n", build.wall_s,
             1e6 * build.wall_s / report["raster"]["known_samples"].get<double>());
}

/// One size: a row of the table.
json measure(const Options& options, const std::string& dem, const std::string& folder) {
  const std::string scene = folder + "/bench.scene", out = folder + "/out";
  std::vector<std::string> command = {"build", dem, "-o", scene, "--overwrite", "--json"};
  const std::vector<std::string> choice = chosen(options);
  command.insert(command.end(), choice.begin(), choice.end());
  const Ran build = run_program(command, out);
  const json report = json::parse(build.output);
  const json raster = report["raster"];
  const double columns = raster["columns"].get<double>(), rows = raster["rows"].get<double>();
  const double samples = columns * rows;
  fmt::print("{:.1f} million samples, {} x {}\n", samples / 1e6, columns, rows);
  print_build(report, build);

  const std::map<std::string, std::uint64_t> bytes = bytes_by_kind(scene);
  fmt::print("  bytes a sample:");
  for (const auto& [kind, count] : bytes)
    fmt::print(" {} {:.3f}", kind, static_cast<double>(count) / samples);
  fmt::print("\n");
  std::fflush(stdout);

  const json description = json::parse(std::ifstream(scene + "/scene.json"));
  const auto& g = description["raster"]["geotransform"];
  const std::string eye =
      fmt::format("={},{},200", g[0].get<double>() + g[1].get<double>() * columns / 2,
                  g[3].get<double>() + g[5].get<double>() * rows / 2);
  const Asked cull = ask({"cull", scene, "--camera" + eye}, out);
  const Asked viewshed =
      ask({"viewshed", scene, "--observer" + eye, "-o", folder + "/seen.tif", "--overwrite"}, out);
  fmt::print("  viewshed of 10 km: {} of {} tiles, {:.2f} s of processor in all;",
             viewshed.answer["tiles_read"].get<int>(), viewshed.answer["tiles"].get<int>(),
             viewshed.ran.cpu_s);
  for (const json& stage : viewshed.answer["stages"])
    fmt::print(" {} {:.3f} s", stage["name"].get<std::string>(), stage["seconds"].get<double>());
  const json& decided = viewshed.answer["decided"];
  fmt::print("; judged whole {} of {} samples\n", decided["judged_whole"].get<std::uint64_t>(),
             decided["targets"].get<std::uint64_t>());
  // What it takes to see, without the start of the program and what is read.
  std::vector<std::string> many = {"viewshed", scene, "-o", folder + "/seen.tif", "--overwrite"};
  constexpr int kMoreEyes = 20;
  many.insert(many.end(), kMoreEyes + 1, "--observer" + eye);
  fmt::print("  a viewshed of 10 km more: {:.3f} s of processor\n",
             (ask(many, out).ran.cpu_s - viewshed.ran.cpu_s) / kMoreEyes);
  std::fflush(stdout);
  return {{"samples", samples},
          {"columns", columns},
          {"rows", rows},
          {"triangles", report["mesh"]["triangles"]},
          {"seconds", build.wall_s},
          {"cpu_seconds", build.cpu_s},
          {"peak_mib", report["peak_memory_bytes"].get<double>() / 0x1p20},
          {"bytes_a_sample", sum_of(bytes) / samples},
          {"png_bytes_a_sample", static_cast<double>(bytes.at(".png")) / samples},
          {"tiles", cull.answer["tiles"]},
          {"tiles_read", cull.answer["tiles_read"]},
          {"open_ms", 1e3 * cull.answer["open_s"].get<double>()},
          {"answer_ms", 1e3 * cull.answer["answer_s"].get<double>()}};
}

/// As in docs/scale.md.
void print_table(const json& rows) {
  fmt::print(
      "\n| samples | triangles | processor, us/sample | peak memory, MiB | scene, bytes/sample "
      "| of that pictures | tiles read by a cull of 10 km | open, ms | answer, ms |\n");
  fmt::print("|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const json& row : rows) {
    const double samples = row["samples"].get<double>();
    fmt::print(
        "| {:.1f} million ({} x {}) | {} | {:.2f} | {:.0f} | {:.2f} | {:.2f} | {} of {} | "
        "{:.0f} | {:.0f} |\n",
        samples / 1e6, row["columns"].get<int>(), row["rows"].get<int>(),
        row["triangles"].get<std::uint64_t>(), 1e6 * row["cpu_seconds"].get<double>() / samples,
        row["peak_mib"].get<double>(), row["bytes_a_sample"].get<double>(),
        row["png_bytes_a_sample"].get<double>(), row["tiles_read"].get<int>(),
        row["tiles"].get<int>(), row["open_ms"].get<double>(), row["answer_ms"].get<double>());
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const Options options = parse(argc, argv);
  const scarp::test::TempFolder temporary;
  const std::string folder = options.folder.empty() ? temporary.folder().string() : options.folder;
  fs::create_directories(folder);
  fmt::print("--memory {} --max-error {} --fans {} --tile-samples {}\n", options.memory,
             options.max_error, options.fans, options.tile_samples);
  json rows = json::array();
  const auto add = [&](const std::string& dem) {
    rows.push_back(measure(options, dem, folder));
    if (!options.json_file.empty()) std::ofstream(options.json_file) << rows.dump(1) << '\n';
  };
  if (!options.dem.empty()) {
    add(options.dem);
  } else {
    for (const double millions : options.millions) {
      const int side = static_cast<int>(std::lround(std::sqrt(millions * 1e6)));
      const std::string dem = fmt::format("{}/fractal-{}.tif", folder, side);
      if (!fs::exists(dem)) write_fractal_dem(dem, side, side, 1);
      add(dem);
    }
  }
  print_table(rows);
} catch (const std::exception& failure) {
  fmt::print(stderr, "{}\n", failure.what());
  return 1;
}
