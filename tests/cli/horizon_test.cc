#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/cli/written_dem.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

/// A plain of 100 m cells with a wall of 50 m and, in its last row, void.
class HorizonCommand : public testing::Test {
 protected:
  static constexpr int kColumns = 12, kRows = 6;

  void SetUp() override {
    std::vector<float> heights(kColumns * kRows, 10);
    for (int r = 0; r < kRows; ++r) heights[static_cast<std::size_t>(r * kColumns + 5)] = 60;
    for (int c = 0; c < kColumns; ++c) heights[static_cast<std::size_t>(5 * kColumns + c)] = -99;
    dem_ = test::write_dem(folder_.path("dem.tif"),
                           {.columns = kColumns,
                            .rows = kRows,
                            .left = 500'000,
                            .top = 4'000'000,
                            .cell_m = 100,
                            .crs = "EPSG:32611",
                            .nodata = -99},
                           std::move(heights));
  }

  RunResult horizon(const std::string& options) {
    return run_scarp("$SCARP horizon " + dem_ + " " + options);
  }
  /// The same samples in degrees, but nothing says so.
  std::string degrees() const {
    const std::string path = folder_.path("degrees.tif");
    const GDALDatasetUniquePtr from(GDALDataset::Open(dem_.c_str(), GDAL_OF_RASTER));
    GDALDataset* to = GetGDALDriverManager()->GetDriverByName("GTiff")->CreateCopy(
        path.c_str(), from.get(), FALSE, nullptr, nullptr, nullptr);
    double transform[6] = {10, 0.001, 0, 46, 0, -0.001};
    to->SetGeoTransform(transform);
    to->SetSpatialRef(nullptr);
    GDALClose(to);
    return path;
  }
  std::string out(const std::string& name = "out.tif") const { return folder_.path(name); }
  std::vector<double> read(int band, const std::string& name = "out.tif") const {
    const GDALDatasetUniquePtr dataset(GDALDataset::Open(out(name).c_str(), GDAL_OF_RASTER));
    std::vector<double> values(kColumns * kRows);
    EXPECT_EQ(dataset->GetRasterBand(band)->RasterIO(GF_Read, 0, 0, kColumns, kRows, values.data(),
                                                     kColumns, kRows, GDT_Float64, 0, 0),
              CE_None);
    return values;
  }

  const test::TempFolder folder_;
  std::string dem_;
};

TEST_F(HorizonCommand, WritesThreeBandsAnAzimuthAndSaysHow) {
  const RunResult result = horizon("-o " + out() + " --azimuths 4 --earth flat --json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(json::parse(result.output)["azimuths"], 4);
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(out().c_str(), GDAL_OF_RASTER));
  ASSERT_EQ(dataset->GetRasterCount(), 12);
  EXPECT_STREQ(dataset->GetRasterBand(4)->GetDescription(), "azimuth 90 estimate");
  EXPECT_STREQ(dataset->GetRasterBand(5)->GetDescription(), "azimuth 90 lower");
  EXPECT_STREQ(dataset->GetRasterBand(6)->GetDescription(), "azimuth 90 upper");
  EXPECT_EQ(dataset->GetRasterBand(4)->GetRasterDataType(), GDT_Int16);
  EXPECT_EQ(dataset->GetRasterBand(4)->GetScale(), 0.01);
  EXPECT_EQ(dataset->GetRasterBand(4)->GetNoDataValue(), -32768);
  EXPECT_STREQ(dataset->GetMetadataItem("SURFACE"), "grid");
  EXPECT_STREQ(dataset->GetMetadataItem("EARTH"), "flat");
  EXPECT_STREQ(dataset->GetMetadataItem("INTERLEAVE", "IMAGE_STRUCTURE"), "BAND");
  const double at_wall = std::atan(50.0 / 400) * 18'000 / M_PI;
  EXPECT_NEAR(read(4)[kColumns + 1], at_wall, 1);
  EXPECT_LE(read(5)[kColumns + 1], at_wall);
  EXPECT_GE(read(6)[kColumns + 1], at_wall);
  EXPECT_EQ(read(4)[kColumns + 11], -9000);
  EXPECT_EQ(read(4)[5 * kColumns], -32768);
}

TEST_F(HorizonCommand, AccuracyChoosesTheToleranceUnlessItIsGiven) {
  struct Case {
    const char *flags, *tolerance, *accuracy;
    int bands;
  };
  for (const Case& c : {Case{"", "0.3", "exact", 12}, Case{" --accuracy high", "1", "high", 12},
                        Case{" --accuracy fast", "3", "fast", 4},
                        Case{" --accuracy high --tolerance 0.5", "0.5", "high", 12}}) {
    const RunResult result =
        horizon("-o " + out() + " --azimuths 4 --earth flat --overwrite" + c.flags);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const GDALDatasetUniquePtr dataset(GDALDataset::Open(out().c_str(), GDAL_OF_RASTER));
    EXPECT_STREQ(dataset->GetMetadataItem("TOLERANCE_DEG"), c.tolerance);
    EXPECT_STREQ(dataset->GetMetadataItem("ACCURACY"), c.accuracy);
    EXPECT_EQ(dataset->GetRasterCount(), c.bands);
  }
}

TEST_F(HorizonCommand, AgreesWithTheHorizonOfAPlace) {
  ASSERT_EQ(horizon("-o " + out() + " --azimuths 8 --distance " + out("far.tif")).exit_code, 0);
  // Centre of the second cell of the second row.
  const RunResult place = horizon("--at 500150,3999850,0 --azimuths 8 --json");
  ASSERT_EQ(place.exit_code, 0) << place.errors;
  const json points = json::parse(place.output)["horizon"];
  for (int i = 0; i < 8; ++i) {
    const json& point = points[static_cast<std::size_t>(i)];
    if (point["elevation_deg"].is_null()) continue;
    const double steps = point["elevation_deg"].get<double>() * 100;
    EXPECT_LE(read(3 * i + 2)[kColumns + 1], steps) << i;
    EXPECT_GE(read(3 * i + 3)[kColumns + 1], steps) << i;
  }
  EXPECT_NEAR(read(3, "far.tif")[kColumns + 1], points[2]["distance_m"].get<double>(), 1);
}

TEST_F(HorizonCommand, SkyViewOpennessAndShadow) {
  ASSERT_EQ(horizon("--azimuths 10 --sky-view " + out("sky.tif") + " --openness " + out("open.tif"))
                .exit_code,
            0);
  EXPECT_FALSE(std::filesystem::exists(out()));
  EXPECT_LT(read(1, "sky.tif")[4], 0.98);
  EXPECT_GT(read(1, "sky.tif")[0], 0.99);
  EXPECT_LT(read(1, "open.tif")[4], 85);
  EXPECT_GT(read(1, "open.tif")[5], 90);
  // From the wall down its side; from its foot the plain is lower than the wall.
  ASSERT_EQ(horizon("--azimuths 10 --negative-openness " + out("down.tif")).exit_code, 0);
  EXPECT_LT(read(1, "down.tif")[5], 85);
  EXPECT_NEAR(read(1, "down.tif")[4], 90, 0.05);
  EXPECT_TRUE(std::isnan(read(1, "down.tif")[5 * kColumns]));
  // In the morning the wall's shadow falls to the west: at this time over the whole plain there.
  ASSERT_EQ(horizon("-o " + out() + " --sun 2026-06-21T13:00Z --json").exit_code, 0);
  EXPECT_EQ(read(1)[2 * kColumns + 4], 0);
  EXPECT_EQ(read(1)[2 * kColumns + 8], 1);
  EXPECT_EQ(read(1)[5 * kColumns], 255);
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(out().c_str(), GDAL_OF_RASTER));
  EXPECT_NEAR(std::atof(dataset->GetMetadataItem("SUN_ELEVATION_DEG")), 3.2, 1.5);
}

/// From a corner of the sea, away from where levels are those of the frame: what is seen lowest is
/// the farthest water, half the angle to it below the level plane.
TEST_F(HorizonCommand, OpennessOfTheSea) {
  constexpr int kSide = 60;
  constexpr double kCell = 0.02;
  const std::string sea = folder_.path("sea.tif");
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      sea.c_str(), kSide, kSide, 1, GDT_Float32, nullptr);
  double transform[6] = {10, kCell, 0, 1, 0, -kCell};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:4326");
  dataset->SetSpatialRef(&crs);
  dataset->GetRasterBand(1)->Fill(0);
  GDALClose(dataset);
  ASSERT_EQ(run_scarp("$SCARP horizon " + sea + " --azimuths 4 --openness " + out("up.tif") +
                      " --negative-openness " + out("down.tif"))
                .exit_code,
            0);
  const auto at_corner = [&](const std::string& name) {
    const GDALDatasetUniquePtr written(GDALDataset::Open(out(name).c_str(), GDAL_OF_RASTER));
    float value = 0;
    EXPECT_EQ(
        written->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 1, 1, &value, 1, 1, GDT_Float32, 0, 0),
        CE_None);
    return value;
  };
  // East and south, 59 cells each; near the equator a degree is nearly a degree.
  EXPECT_NEAR(at_corner("down.tif"), 90 - 59 * kCell / 2, 0.02);
  EXPECT_NEAR(at_corner("up.tif"), 90 + kCell / 2, 0.02);
}

/// Bands go to the disk as they are found: memory does not depend on how many there are.
TEST_F(HorizonCommand, ManyAzimuthsTakeNoMoreMemory) {
  const std::string options = " --azimuths 300 --overwrite --threads ";
  ASSERT_EQ(horizon("-o " + out() + options + "2").exit_code, 0);
  const RunResult small = horizon("-o " + out("small.tif") + options + "1 --memory 900");
  ASSERT_EQ(small.exit_code, 0) << small.errors;
  EXPECT_EQ(run_scarp("cmp " + out() + " " + out("small.tif")).exit_code, 0);
  EXPECT_EQ(std::filesystem::file_size(out()), std::filesystem::file_size(out("small.tif")));
}

TEST_F(HorizonCommand, RefusesInOneLineAndLeavesNothing) {
  const auto refused = [&](const std::string& options, int code, const std::string& words) {
    const RunResult result = horizon(options);
    EXPECT_EQ(result.exit_code, code) << options;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(out()));
  };
  const std::string to = "-o " + out();
  refused("", 2, "--at");
  refused("-o " + out("out.csv"), 2, ".tif");
  refused(to + " --azimuths 0", 2, "--azimuths");
  refused(to + " --sun noon", 2, "--sun noon");
  refused(to + " --sun 2026-02-30T12:00Z", 2, "2026-02-30");
  refused(to + " --sun 2026-06-21T12:00Z --azimuths 4", 2, "--sun");
  refused(to + " --sun 2026-06-21T12:00Z --earth flat", 1, "ellipsoid");
  refused(to + " --sky-view " + out(), 2, "twice");
  refused(to + " --crs OGC:CRS84", 2, "--crs");
  refused(to + " --refraction 2", 1, "refraction");
  refused(to + " --azimuths 100000", 2, "--azimuths");
  refused(to + " --memory 700", 1, "--memory");
  EXPECT_NE(run_scarp("$SCARP horizon " + degrees() + " " + to).errors.find("CRS"),
            std::string::npos);
  refused("--at 500150,3999850 --sky-view " + out(), 2, "--sky-view");
  ASSERT_EQ(horizon(to).exit_code, 0);
  EXPECT_EQ(horizon(to).exit_code, 1);
  EXPECT_EQ(horizon(to + " --overwrite").exit_code, 0);
}

}  // namespace
}  // namespace scarp
