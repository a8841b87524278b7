#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

/// Whole commands on the same files, one after the other and again, medians and ratios, over Big
/// Tujunga refined to SIDE x SIDE samples. Wall time, and the processors' time (user and system),
/// which other work on the machine disturbs less.
///   viewshed_bench [REPEATS (5) [SIDE ... (1024 2048 4096 8192)]]
///     an eye 2 m over the middle: `scarp viewshed` on the flat earth and on the ellipsoid against
///     `gdal_viewshed` and, alone in its time without reading the file, GRASS's `r.viewshed` (flat;
///     once, and only up to 4096, because it takes many minutes beyond)
///   viewshed_bench eyes [COUNT (500) [SIDE (4096) [REPEATS (3)]]]
///     COUNT eyes drawn at random, `--mode ground` within 30 km as one run, by the eye, against
///     `gdal_viewshed -om GROUND` of one of them
namespace scarp {
namespace {

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

struct Cost {
  double wall_s = 0, cpu_s = 0;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Command {
  const char* name;
  std::string line;
  std::vector<double> wall_s, cpu_s;

  void add(const Cost& cost) {
    wall_s.push_back(cost.wall_s);
    cpu_s.push_back(cost.cpu_s);
  }
  Cost middle() const { return {median(wall_s), median(cpu_s)}; }
};

/// What all commands so far have taken of the processors.
double cpu_so_far_s() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

Cost cost_of(const std::string& line) {
  const double cpu_before_s = cpu_so_far_s();
  const auto start = std::chrono::steady_clock::now();
  if (std::system((line + " > /dev/null").c_str()) != 0) std::exit(1);
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          cpu_so_far_s() - cpu_before_s};
}

/// What r.viewshed takes on a file, without reading it; nothing without GRASS.
std::optional<Cost> grass_cost(const std::string& file, const test::TempFolder& folder) {
  if (std::system("command -v grass > /dev/null") != 0) return {};
  const std::string script = folder.path("grass.sh"), time = folder.path("grass.time");
  std::ofstream(script) << "set -e\nr.in.gdal -o --quiet input='" << file
                        << "' output=dem\ng.region raster=dem\nstart=$(date +%s.%N)\n"
                           "TIMEFORMAT='%U %S'\n"
                           "used=$( { time r.viewshed -b --quiet input=dem output=seen "
                           "coordinates=394253,3798287 observer_elevation=2 memory=8000 "
                           "> /dev/null 2>&1; } 2>&1 )\n"
                           "echo $start $(date +%s.%N) $used > '"
                        << time << "'\n";
  const std::string line =
      fmt::format("grass --tmp-location '{}' --exec bash '{}' > /dev/null 2>&1", file, script);
  if (std::system(line.c_str()) != 0) return {};
  double start = 0, end = 0, user_s = 0, system_s = 0;
  std::ifstream(time) >> start >> end >> user_s >> system_s;
  return Cost{end - start, user_s + system_s};
}

void compare(const std::string& scarp, const std::string& dem, int side, int repeats) {
  const test::TempFolder folder;
  const std::string file = refined(dem, side, folder);
  const std::string ours =
      fmt::format("'{}' viewshed '{}' --observer 394253,3798287,2 -o '{}' --overwrite --earth",
                  scarp, file, folder.path("scarp.tif"));
  std::vector<Command> commands = {
      {"gdal_viewshed",
       fmt::format("gdal_viewshed -q -ox 394253 -oy 3798287 -oz 2 -md 0 -cc 0 '{}' '{}'", file,
                   folder.path("gdal.tif")),
       {},
       {}},
      {"scarp flat", ours + " flat", {}, {}},
      {"scarp ellipsoid", ours + " ellipsoid", {}, {}}};
  for (int i = 0; i <= repeats; ++i) {
    for (Command& command : commands) {
      const Cost cost = cost_of(command.line);
      if (i > 0) command.add(cost);  // the first round warms the caches
    }
  }
  constexpr int kGreatestForGrass = 4096;
  if (side <= kGreatestForGrass)
    if (const auto cost = grass_cost(file, folder))
      commands.push_back({"r.viewshed", "", {cost->wall_s}, {cost->cpu_s}});
  const Cost gdal = commands[0].middle(), flat = commands[1].middle(),
             ellipsoid = commands[2].middle();
  for (const Command& command : commands) {
    const Cost cost = command.middle();
    fmt::print(
        "{:>5} x {:<5} {:<16} wall {:7.3f} s, {:6.2f} of gdal_viewshed   processors {:7.3f} s, "
        "{:6.2f} of it   {:6.1f} ns a cell\n",
        side, side, command.name, cost.wall_s, cost.wall_s / gdal.wall_s, cost.cpu_s,
        cost.cpu_s / gdal.cpu_s, 1e9 * cost.wall_s / side / side);
  }
  fmt::print("{:>5} x {:<5} ellipsoid {:.2f} of flat (processors {:.2f})\n", side, side,
             ellipsoid.wall_s / flat.wall_s, ellipsoid.cpu_s / flat.cpu_s);
  std::fflush(stdout);
}

void compare_eyes(const std::string& scarp, const std::string& dem, int count, int side,
                  int repeats) {
  const test::TempFolder folder;
  const std::string file = refined(dem, side, folder), eyes = folder.path("eyes.csv");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(384'700, 403'800), y(3'788'700, 3'807'800);
  std::ofstream out(eyes);
  out << "x,y,height\n";
  std::string first;
  for (int i = 0; i < count; ++i) {
    const double at_x = x(random), at_y = y(random);
    out << fmt::format("{:.3f},{:.3f},2\n", at_x, at_y);
    if (i == 0) first = fmt::format("-ox {:.3f} -oy {:.3f}", at_x, at_y);
  }
  out.close();
  Command one{"gdal_viewshed",
              fmt::format("gdal_viewshed -q -om GROUND -md 30000 {} -oz 2 -cc 0 '{}' '{}'", first,
                          file, folder.path("gdal.tif")),
              {},
              {}};
  Command all{"scarp",
              fmt::format("'{}' viewshed '{}' --observers '{}' --mode ground --max-distance 30000 "
                          "-o '{}' --overwrite",
                          scarp, file, eyes, folder.path("scarp.tif")),
              {},
              {}};
  cost_of(one.line);
  for (int i = 0; i < repeats; ++i) {
    one.add(cost_of(one.line));
    const Cost cost = cost_of(all.line);
    all.add({cost.wall_s / count, cost.cpu_s / count});
    one.add(cost_of(one.line));
  }
  const Cost ours = all.middle(), theirs = one.middle();
  fmt::print(
      "{} x {}, {} eyes: scarp {:.3f} s an eye (processors {:.3f}), gdal_viewshed -om GROUND "
      "{:.3f} s for one ({:.3f}): {:.2f} of it ({:.2f})\n",
      side, side, count, ours.wall_s, ours.cpu_s, theirs.wall_s, theirs.cpu_s,
      ours.wall_s / theirs.wall_s, ours.cpu_s / theirs.cpu_s);
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  const auto dem = scarp::test::shared_data("projected/bigtujunga_srtm30m_utm11.tif");
  if (!dem) {
    fmt::print(stderr, "viewshed_bench: the shared data are not there\n");
    return 1;
  }
  const std::string program =
      (std::filesystem::canonical(argv[0]).parent_path().parent_path() / "scarp").string();
  if (argc > 1 && std::string(argv[1]) == "eyes") {
    const auto number = [&](int at, int otherwise) {
      return argc > at ? std::max(1, std::atoi(argv[at])) : otherwise;
    };
    scarp::compare_eyes(program, *dem, number(2, 500), number(3, 4096), number(4, 3));
    return 0;
  }
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  std::vector<int> sides = {1024, 2048, 4096, 8192};
  if (argc > 2) {
    sides.clear();
    for (int i = 2; i < argc; ++i) sides.push_back(std::atoi(argv[i]));
  }
  for (const int side : sides) scarp::compare(program, *dem, side, repeats);
}
