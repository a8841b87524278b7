#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

/// Whole commands on the same files, one after the other and again, medians and ratios:
/// `scarp viewshed` on the flat earth and on the ellipsoid against `gdal_viewshed` (flat), an eye
/// 2 m over the middle of Big Tujunga refined to SIDE x SIDE samples.
/// Usage: viewshed_bench [REPEATS (5) [SIDE ...  (1024 2048 4096)]]
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
      const auto start = std::chrono::steady_clock::now();
      if (std::system((command.line + " > /dev/null").c_str()) != 0) std::exit(1);
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
      if (i > 0) command.seconds.push_back(time.count());  // the first round warms the caches
    }
  }
  for (const Command& command : commands)
    fmt::print("{:>5} x {:<5} {:<16} {:7.3f} s   {:5.2f} of gdal_viewshed   {:6.1f} ns a cell\n",
               side, side, command.name, command.median(), command.median() / commands[0].median(),
               1e9 * command.median() / side / side);
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
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  std::vector<int> sides = {1024, 2048, 4096};
  if (argc > 2) {
    sides.clear();
    for (int i = 2; i < argc; ++i) sides.push_back(std::atoi(argv[i]));
  }
  for (const int side : sides) scarp::compare(program, *dem, side, repeats);
}
