#include <fmt/format.h>

#include <algorithm>
#include <chrono>
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
/// Tujunga refined to SIDE x SIDE samples.
///   viewshed_bench [REPEATS (5) [SIDE ... (1024 2048 4096 8192)]]
///     an eye 2 m over the middle: `scarp viewshed` on the flat earth and on the ellipsoid against
///     `gdal_viewshed` and, alone in its time without reading the file, GRASS's `r.viewshed` (flat;
///     once, and only up to 2048, because it takes minutes beyond)
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

struct Command {
  const char* name;
  std::string line;
  std::vector<double> seconds;

  double median() const {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
};

double seconds_of(const std::string& line) {
  const auto start = std::chrono::steady_clock::now();
  if (std::system((line + " > /dev/null").c_str()) != 0) std::exit(1);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Seconds that r.viewshed takes on a file, without reading it; nothing without GRASS.
std::optional<double> grass_seconds(const std::string& file, const test::TempFolder& folder) {
  if (std::system("command -v grass > /dev/null") != 0) return {};
  const std::string script = folder.path("grass.sh"), time = folder.path("grass.time");
  std::ofstream(script) << "set -e\nr.in.gdal -o --quiet input='" << file
                        << "' output=dem\ng.region raster=dem\nstart=$(date +%s.%N)\n"
                           "r.viewshed -b --quiet input=dem output=seen "
                           "coordinates=394253,3798287 observer_elevation=2 memory=8000\n"
                           "echo $start $(date +%s.%N) > '"
                        << time << "'\n";
  const std::string line =
      fmt::format("grass --tmp-location '{}' --exec bash '{}' > /dev/null 2>&1", file, script);
  if (std::system(line.c_str()) != 0) return {};
  double start = 0, end = 0;
  std::ifstream(time) >> start >> end;
  return end - start;
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
       {}},
      {"scarp flat", ours + " flat", {}},
      {"scarp ellipsoid", ours + " ellipsoid", {}}};
  for (int i = 0; i <= repeats; ++i) {
    for (Command& command : commands) {
      const double seconds = seconds_of(command.line);
      if (i > 0) command.seconds.push_back(seconds);  // the first round warms the caches
    }
  }
  constexpr int kGreatestForGrass = 2048;
  if (side <= kGreatestForGrass)
    if (const auto seconds = grass_seconds(file, folder))
      commands.push_back({"r.viewshed", "", {*seconds}});
  for (const Command& command : commands)
    fmt::print("{:>5} x {:<5} {:<16} {:7.3f} s   {:5.2f} of gdal_viewshed   {:6.1f} ns a cell\n",
               side, side, command.name, command.median(), command.median() / commands[0].median(),
               1e9 * command.median() / side / side);
  fmt::print("{:>5} x {:<5} ellipsoid {:.2f} of flat\n", side, side,
             commands[2].median() / commands[1].median());
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
              {}};
  Command all{"scarp",
              fmt::format("'{}' viewshed '{}' --observers '{}' --mode ground --max-distance 30000 "
                          "-o '{}' --overwrite",
                          scarp, file, eyes, folder.path("scarp.tif")),
              {}};
  seconds_of(one.line);
  for (int i = 0; i < repeats; ++i) {
    one.seconds.push_back(seconds_of(one.line));
    all.seconds.push_back(seconds_of(all.line) / count);
    one.seconds.push_back(seconds_of(one.line));
  }
  fmt::print(
      "{} x {}, {} eyes: scarp {:.3f} s an eye, gdal_viewshed -om GROUND {:.3f} s for one, {:.2f} "
      "of it\n",
      side, side, count, all.median(), one.median(), all.median() / one.median());
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
