#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

/// Horizons of all points: the whole command `scarp horizon` with and without bounds, nanoseconds
/// a cell and direction, and its share for looking alone, on Big Tujunga refined to SIDE x SIDE
/// samples; against `r.horizon` where GRASS is installed (the module alone, on sides up to 2048).
/// Usage: horizons_bench [REPEATS (3) [SIDE ...  (1024 2048 4096 8192)]]
namespace scarp {
namespace {

constexpr int kAzimuths = 6;
constexpr int kGrassAzimuths = 3;
constexpr int kLargestForGrass = 2048;

/// Big Tujunga, cut and refined by cubic resampling.
std::string refined(const std::string& dem, int side, const test::TempFolder& folder) {
  const std::string plain = folder.path("plain.tif"),
                    path = folder.path(fmt::format("u{}.tif", side));
  const std::string commands = fmt::format(
      "gdal_translate -q -a_nodata none -ot Float32 '{}' '{}' && gdalwarp -q -overwrite -te "
      "384653.655454263 3788687.828 403853.655454263 3807887.828 -ts {} {} -r cubic -ot Float32 "
      "'{}' '{}'",
      dem, plain, side, side, plain, path);
  if (std::system(commands.c_str()) != 0) std::exit(1);
  return path;
}

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) std::exit(1);
  char buffer[4096];
  while (const std::size_t count = fread(buffer, 1, sizeof(buffer), pipe))
    text.append(buffer, count);
  if (pclose(pipe) != 0) text.clear();
  return text;
}

double children_seconds() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Wall time of one r.horizon in a project of its own, seconds; 0 where it failed.
double grass_seconds(const std::string& file) {
  const std::string inside = fmt::format(
      "r.in.gdal -o input=\"{}\" output=dem --quiet && g.region raster=dem && b=$(date +%s%N) && "
      "r.horizon elevation=dem start=10 step={} output=h --quiet >/dev/null && "
      "echo nanoseconds $(($(date +%s%N) - b))",
      file, 360.0 / kGrassAzimuths);
  const std::string text = output_of(
      fmt::format("grass --tmp-location '{}' --exec sh -c '{}' 2>/dev/null", file, inside));
  const std::size_t at = text.rfind("nanoseconds ");
  return at == std::string::npos ? 0 : 1e-9 * std::atof(text.c_str() + at + 12);
}

void measure(const std::string& scarp, const std::string& dem, int side, int repeats) {
  const test::TempFolder folder;
  const std::string file = refined(dem, side, folder);
  const double cells = static_cast<double>(side) * side;
  for (const auto& [name, options] :
       {std::pair("with bounds", "--earth flat"),
        std::pair("estimate", "--earth flat --estimate-only"),
        std::pair("ellipsoid", "--earth ellipsoid --estimate-only")}) {
    const std::string line =
        fmt::format("'{}' horizon '{}' -o '{}' --azimuths {} {} --overwrite --json", scarp, file,
                    folder.path("h.tif"), kAzimuths, options);
    std::vector<double> whole_s, look_s, cpu_s;
    double peak_bytes = 0;
    for (int i = 0; i < repeats; ++i) {
      const double cpu_before = children_seconds();
      const auto start = std::chrono::steady_clock::now();
      const std::string text = output_of(line);
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
      if (text.empty()) {
        fmt::print("{:>5} x {:<5} scarp {:<12} was refused\n", side, side, name);
        return;
      }
      whole_s.push_back(time.count());
      cpu_s.push_back(children_seconds() - cpu_before);
      const nlohmann::json report = nlohmann::json::parse(text);
      for (const auto& stage : report["stages"]) {
        if (stage["name"] == "look") {
          look_s.push_back(stage["seconds"]);
          peak_bytes = stage["peak_bytes"];
        }
      }
    }
    const double scale = 1e9 / cells / kAzimuths;
    fmt::print(
        "{:>5} x {:<5} scarp {:<12} {:7.1f} ns a cell and direction, {:7.1f} looking, {:7.1f} of "
        "processors; {:5.1f} bytes a cell while looking\n",
        side, side, name, median(whole_s) * scale, median(look_s) * scale, median(cpu_s) * scale,
        peak_bytes / cells);
  }
  if (side > kLargestForGrass || std::system("command -v grass >/dev/null") != 0) return;
  const double grass_s = grass_seconds(file);
  if (grass_s > 0)
    fmt::print("{:>5} x {:<5} r.horizon          {:7.1f} ns a cell and direction\n", side, side,
               1e9 * grass_s / cells / kGrassAzimuths);
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  const auto dem = scarp::test::shared_data("projected/bigtujunga_srtm30m_utm11.tif");
  if (!dem) {
    fmt::print(stderr, "horizons_bench: the shared data are not there\n");
    return 1;
  }
  const std::string program =
      (std::filesystem::canonical(argv[0]).parent_path().parent_path() / "scarp").string();
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 3;
  std::vector<int> sides = {1024, 2048, 4096, 8192};
  if (argc > 2) {
    sides.clear();
    for (int i = 2; i < argc; ++i) sides.push_back(std::atoi(argv[i]));
  }
  for (const int side : sides) scarp::measure(program, *dem, side, repeats);
}
