#include "tests/cli/tiled_terrain.h"

#include <gdal_priv.h>

#include <cstdint>
#include <vector>

#include "tests/support/fractal_ground.h"
#include "tiles/store/checksum.h"

namespace scarp::test {
namespace {

namespace fs = std::filesystem;

std::string write_dem(const std::string& path) {
  GDALAllRegister();
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), kTiledColumns, kTiledRows, 1, GDT_Int16, nullptr);
  double transform[6] = {400'000, 30, 0, 5'200'000, 0, -30};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:32632");
  dataset->SetSpatialRef(&crs);
  dataset->GetRasterBand(1)->SetNoDataValue(-1);
  const FractalGround ground(3);
  for (int row = 0; row < kTiledRows; ++row) {
    std::vector<std::int16_t> heights(kTiledColumns);
    ground.row(700, 900 + row, heights);
    for (int column = 0; column < kTiledColumns; ++column)
      if ((column - 80) * (column - 80) + (row - 70) * (row - 70) < 120)
        heights[static_cast<std::size_t>(column)] = -1;
    EXPECT_EQ(
        dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, row, kTiledColumns, 1, heights.data(),
                                            kTiledColumns, 1, GDT_Int16, 0, 0),
        CE_None);
  }
  GDALClose(dataset);
  return path;
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
  dem_ = write_dem(folder_->path("dem.tif"));
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
