// What an export costs: a scene of about a million triangles to every format, seconds, memory and
// bytes a triangle.
//   scripts/bench export [--samples 760] [--folder DIR]
// Makes its own terrain (tests/support/fractal_ground.h) and builds it with the coarsest certified
// regions first: what they hide does not change what an export costs. --folder keeps the scene for
// a second run.
#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/fractal_ground.h"
#include "tests/support/temp_folder.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void write_dem(const std::string& path, int side) {
  GDALAllRegister();
  GDALDatasetUniquePtr dataset(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), side, side, 1, GDT_Int16, nullptr));
  if (!dataset) throw std::runtime_error("cannot write " + path);
  double transform[6] = {400'000, 30, 0, 5'200'000, 0, -30};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:32632");
  dataset->SetSpatialRef(&crs);
  std::vector<std::int16_t> heights(static_cast<std::size_t>(side));
  for (int row = 0; row < side; ++row) {
    scarp::test::FractalGround(1).row(0, row, heights);
    if (dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, row, side, 1, heights.data(), side, 1,
                                            GDT_Int16, 0, 0) != CE_None)
      throw std::runtime_error("cannot write " + path);
  }
}

struct Ran {
  double wall_s = 0, cpu_s = 0;
};

double cpu_of_children_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Ran run(const std::string& arguments, const std::string& output) {
  const double cpu_s = cpu_of_children_s();
  const auto begun = std::chrono::steady_clock::now();
  const std::string command = "'" SCARP_PROGRAM "' " + arguments + " --json >'" + output + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + " failed");
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count(),
          cpu_of_children_s() - cpu_s};
}

std::uint64_t bytes_below(const std::string& folder) {
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

std::uint64_t triangles_of(const std::string& scene) {
  const json report = json::parse(std::ifstream(scene + "/report.json"));
  return report["mesh"]["triangles"].get<std::uint64_t>();
}

void print_export(const std::string& scene, const std::string& folder, const std::string& name,
                  const std::string& options) {
  const std::string out = folder + "/" + name;
  fs::remove_all(out);
  const Ran ran = run("export '" + scene + "' -o '" + out + "' " + options, folder + "/out.json");
  const json result = json::parse(std::ifstream(folder + "/out.json"));
  std::uint64_t most = 0;
  for (const json& stage : result["stages"])
    most = std::max(most, stage["peak_bytes"].get<std::uint64_t>());
  const std::uint64_t bytes = bytes_below(out);
  fmt::print("| `{}` | {:.1f} | {:.1f} | {} | {:.1f} | {:.1f} |\n", options, ran.wall_s, ran.cpu_s,
             most >> 20, static_cast<double>(bytes) / 1e6,
             static_cast<double>(bytes) / static_cast<double>(triangles_of(scene)));
  fs::remove_all(out);
}

}  // namespace

int main(int argc, char** argv) {
  int side = 760;
  std::string folder;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--samples") side = std::atoi(argv[i + 1]);
    if (std::string(argv[i]) == "--folder") folder = argv[i + 1];
  }
  std::optional<scarp::test::TempFolder> own;
  if (folder.empty()) folder = own.emplace().folder().string();
  fs::create_directories(folder);
  for (const char* tiles : {"one", "tiled"}) {
    const std::string scene = fmt::format("{}/{}-{}.scene", folder, tiles, side);
    if (!fs::exists(scene)) {
      const std::string dem = folder + "/dem.tif";
      write_dem(dem, side);
      const Ran built = run(fmt::format("build '{}' -o '{}' --max-error 0.1 --fans 8 --sectors 64 "
                                        "--patch 64 --tile-samples {}",
                                        dem, scene, std::string(tiles) == "one" ? 1024 : 256),
                            folder + "/out.json");
      fmt::print("built in {:.0f} s\n", built.wall_s);
    }
    fmt::print("\n{}: {} triangles of the finest level\n\n",
               std::string(tiles) == "one" ? "One tile" : "Tiles of 256 cells",
               triangles_of(scene));
    fmt::print("| export | seconds | CPU seconds | MiB | MB written | bytes a triangle |\n");
    fmt::print("|---|---:|---:|---:|---:|---:|\n");
    for (const char* options :
         {"--to 3dtiles", "--to 3dtiles --compress", "--to gpkg", "--to ugrid"})
      print_export(scene, folder, tiles, options);
  }
}
