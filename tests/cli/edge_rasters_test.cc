// Rasters at the edge of what a raster can be, and of the Earth, through the commands: built,
// judged, or refused in one line.

#include <fmt/format.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

struct EdgeRaster {
  int columns, rows;
  std::string crs;
  double x, y, cell_x, cell_y;
  std::function<double(int column, int row)> height_m;
};

constexpr double kVoid = -9999;

std::string write_raster(const std::string& path, const EdgeRaster& raster) {
  GDALAllRegister();
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), raster.columns, raster.rows, 1, GDT_Float32, nullptr);
  double transform[6] = {raster.x, raster.cell_x, 0, raster.y, 0, -raster.cell_y};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput(raster.crs.c_str());
  dataset->SetSpatialRef(&crs);
  dataset->GetRasterBand(1)->SetNoDataValue(kVoid);
  for (int row = 0; row < raster.rows; ++row)
    for (int column = 0; column < raster.columns; ++column) {
      double height_m = raster.height_m(column, row);
      EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, column, row, 1, 1, &height_m, 1, 1,
                                                    GDT_Float64, 0, 0),
                CE_None);
    }
  GDALClose(dataset);
  return path;
}

double ridges_m(int column, int row) {
  return 200.0 * (column % 9 == 4) + (column * 7 + row * 3) % 5;
}

class EdgeRasters : public testing::Test {
 protected:
  RunResult build(const EdgeRaster& raster) {
    return run_scarp("$SCARP build " + write_raster(folder_.path("a.tif"), raster) + " -o " +
                     scene_ +
                     " --horizon certified --sectors 16 --max-error 1 "
                     "--group-triangles 16 --min-group-triangles 4 --overwrite");
  }

  /// That certified culls nothing that is visible.
  /// @return triangles that it culls
  std::uint64_t verify() {
    const RunResult run = run_scarp("$SCARP verify " + scene_ + " --eyes 2 --heights 2,200 --json");
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    std::uint64_t culled = 0, rows = 0;
    for (const json& row : json::parse(run.output)) {
      if (row["method"] != "certified") continue;
      ++rows;
      EXPECT_EQ(row["falsely_culled"], 0);
      culled += row["culled"].get<std::uint64_t>();
    }
    EXPECT_EQ(rows, 2U);
    return culled;
  }

  test::TempFolder folder_;
  const std::string scene_ = folder_.path("a.scene");
};

TEST_F(EdgeRasters, OneCellIsAScene) {
  const RunResult run =
      build({2, 2, "EPSG:32633", 500'000, 5'000'000, 30, 30, [](int c, int r) { return c + r; }});
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_EQ(verify(), 0U);
}

TEST_F(EdgeRasters, OneRowAndNothingButVoidAreRefusedInOneLine) {
  const auto refusal = [&](int rows, double height_m) {
    const RunResult run = build(
        {5, rows, "EPSG:32633", 500'000, 5'000'000, 30, 30, [&](int, int) { return height_m; }});
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
    EXPECT_FALSE(std::filesystem::exists(scene_));
    return run.errors;
  };
  EXPECT_NE(refusal(1, 7).find("a.tif"), std::string::npos);
  EXPECT_NE(refusal(4, kVoid).find("a.tif"), std::string::npos);
}

TEST_F(EdgeRasters, OverTheAntimeridianInDegrees) {
  constexpr double kCell = 3 / 3600.0;
  const RunResult run = build({20, 16, "OGC:CRS84", 180 - 10 * kCell, -16, kCell, kCell, ridges_m});
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_GT(verify(), 0U);
}

TEST_F(EdgeRasters, AroundThePole) {
  const RunResult run = build({20, 16, "EPSG:3031", -900, 720, 90, 90, ridges_m});
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_GT(verify(), 0U);
}

}  // namespace
}  // namespace scarp
