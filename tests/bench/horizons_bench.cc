#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/refined_dem.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

/// Horizons of all points: the whole command `scarp horizon` with and without bounds, nanoseconds
/// a cell and direction, wall time and time of processors, and its share for looking alone, on Big
/// Tujunga refined to SIDE x SIDE samples; against `r.horizon` where GRASS is installed (the module
/// alone, on sides up to 2048), which runs right before and right after.
/// Usage: horizons_bench [REPEATS (3) [SIDE ...  (1024 2048 4096 8192)]]
namespace scarp {
namespace {

constexpr int kLargestForGrass = 2048;

/// The command's own default; fewer where the output would be many gigabytes.
int azimuths_of(int side) {
  return side <= 4096 ? 16 : 6;
}
/// One takes minutes there.
int grass_azimuths_of(int side) {
  return side <= 2048 ? 3 : 1;
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

/// What r.horizon takes in a project of its own, seconds a direction; 0 where it failed.
struct GrassCost {
  double wall = 0, processors = 0;
};
GrassCost grass_cost(const std::string& file, int azimuths, const test::TempFolder& folder) {
  const std::string script = folder.path("grass.sh");
  std::ofstream(script) << fmt::format(
      "set -e\nr.in.gdal -o input='{}' output=dem --quiet\ng.region raster=dem\n"
      "TIMEFORMAT='seconds %R %U'\n"
      "time r.horizon elevation=dem start=10 step={} output=h --quiet >/dev/null 2>&1\n",
      file, 360.0 / azimuths);
  const std::string text =
      output_of(fmt::format("grass --tmp-location '{}' --exec bash '{}' 2>&1", file, script));
  const std::size_t at = text.rfind("seconds ");
  if (at == std::string::npos) return {};
  GrassCost cost;
  std::istringstream(text.substr(at + 8)) >> cost.wall >> cost.processors;
  return {cost.wall / azimuths, cost.processors / azimuths};
}

/// Medians of whole runs, seconds a direction.
struct Cost {
  double wall = 0, look = 0, processors = 0;
  double peak_bytes = 0;
};

std::optional<Cost> cost_of(const std::string& line, const std::string& output, int azimuths,
                            int repeats) {
  std::vector<double> wall_s, look_s, cpu_s;
  Cost cost;
  for (int i = 0; i < repeats; ++i) {
    std::filesystem::remove(output);
    const double cpu_before = children_seconds();
    const auto start = std::chrono::steady_clock::now();
    const std::string text = output_of(line);
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    if (text.empty()) return {};
    wall_s.push_back(time.count() / azimuths);
    cpu_s.push_back((children_seconds() - cpu_before) / azimuths);
    const nlohmann::json report = nlohmann::json::parse(text);
    for (const auto& stage : report["stages"]) {
      if (stage["name"] != "look") continue;
      look_s.push_back(stage["seconds"].get<double>() / azimuths);
      cost.peak_bytes = stage["peak_bytes"];
    }
  }
  cost.wall = median(wall_s);
  cost.look = median(look_s);
  cost.processors = median(cpu_s);
  return cost;
}

void measure(const std::string& scarp, const std::string& dem, int side, int repeats) {
  const test::TempFolder folder;
  const std::string file = test::refined_dem(dem, side, folder), output = folder.path("h.tif");
  const double cells = static_cast<double>(side) * side, scale = 1e9 / cells;
  const int azimuths = azimuths_of(side);
  const bool has_grass =
      side <= kLargestForGrass && std::system("command -v grass >/dev/null") == 0;
  const int grass_azimuths = grass_azimuths_of(side);
  GrassCost grass = has_grass ? grass_cost(file, grass_azimuths, folder) : GrassCost{};
  std::vector<std::pair<std::string, Cost>> costs;
  for (const auto& [name, options] : {std::pair("with bounds", "--earth flat"),
                                      std::pair("estimate", "--earth flat --estimate-only"),
                                      std::pair("ellipsoid", "--earth ellipsoid")}) {
    const std::string line = fmt::format("'{}' horizon '{}' -o '{}' --azimuths {} {} --json", scarp,
                                         file, output, azimuths, options);
    if (const auto cost = cost_of(line, output, azimuths, repeats)) costs.push_back({name, *cost});
  }
  if (grass.wall > 0) {
    const GrassCost after = grass_cost(file, grass_azimuths, folder);
    grass = {(grass.wall + after.wall) / 2, (grass.processors + after.processors) / 2};
    fmt::print(
        "{:>5} x {:<5} r.horizon          {:7.1f} ns a cell and direction, {:26.1f} of "
        "processors\n",
        side, side, grass.wall * scale, grass.processors * scale);
  }
  for (const auto& [name, cost] : costs) {
    fmt::print(
        "{:>5} x {:<5} scarp {:<12} {:7.1f} ns a cell and direction, {:7.1f} looking, {:7.1f} of "
        "processors; {:5.1f} bytes a cell",
        side, side, name, cost.wall * scale, cost.look * scale, cost.processors * scale,
        cost.peak_bytes / cells);
    if (grass.wall > 0)
      fmt::print("; r.horizon takes {:.0f} times as long, {:.0f} times as much of processors",
                 grass.wall / cost.wall, grass.processors / cost.processors);
    fmt::print("\n");
  }
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
