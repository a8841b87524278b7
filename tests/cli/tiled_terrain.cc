#include "tests/cli/tiled_terrain.h"

#include <cstdint>
#include <vector>

#include "tests/cli/written_dem.h"
#include "tests/support/fractal_ground.h"
#include "tiles/store/checksum.h"

namespace scarp::test {
namespace {

namespace fs = std::filesystem;

std::string write_mountains(const std::string& path) {
  const FractalGround ground(3);
  std::vector<std::int16_t> all;
  for (int row = 0; row < kTiledRows; ++row) {
    std::vector<std::int16_t> heights(kTiledColumns);
    ground.row(700, 900 + row, heights);
    for (int column = 0; column < kTiledColumns; ++column)
      if ((column - 80) * (column - 80) + (row - 70) * (row - 70) < 120)
        heights[static_cast<std::size_t>(column)] = -1;
    all.insert(all.end(), heights.begin(), heights.end());
  }
  return write_dem(path,
                   {.columns = kTiledColumns,
                    .rows = kTiledRows,
                    .left = 400'000,
                    .top = 5'200'000,
                    .cell_m = 30,
                    .nodata = -1},
                   std::move(all));
}

constexpr char kQuick[] =
    " --max-error 6 --fans 32 --patch 2 --group-triangles 40 --min-group-triangles 10 "
    "--tile-samples 64 --observer=401900,5198200,40 ";

}  // namespace

std::map<std::string, std::string> files_of(const std::string& scene) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(scene)) {
    const std::string name = entry.path().lexically_relative(scene).generic_string();
    if (entry.is_regular_file() && name != "report.json" && name != "scene.json")
      files[name] = to_hex(digest_of_file(entry.path().string()).checksum);
  }
  return files;
}

std::map<std::string, fs::file_time_type> records_of(const std::string& scene) {
  std::map<std::string, fs::file_time_type> records;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(scene + ".part/work/steps", none))
    if (entry.path().extension() == ".json")
      records[entry.path().filename().string()] = fs::last_write_time(entry.path(), none);
  return records;
}

void TiledTerrain::SetUpTestSuite() {
  folder_ = new TempFolder;
  dem_ = write_mountains(folder_->path("dem.tif"));
  scene_ = folder_->path("tiled.scene");
  built_ = run_scarp(build(scene_) + "--json");
}

void TiledTerrain::TearDownTestSuite() {
  delete folder_;
}

std::string TiledTerrain::build_of(const std::string& dem, const std::string& scene) {
  return "$SCARP build " + dem + " -o " + scene + kQuick;
}

}  // namespace scarp::test
