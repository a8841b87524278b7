#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
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

/// A plain of 100 m cells with a wall of 40 m and, in its last row, void.
class ViewshedCommand : public testing::Test {
 protected:
  static constexpr int kColumns = 12, kRows = 6;

  void SetUp() override {
    GDALAllRegister();
    dem_ = write_dem("dem.tif", kColumns, 0);
  }

  /// @param more_m  on the samples of the ninth column, a hedge
  std::string write_dem(const std::string& name, int columns, float more_m,
                        const char* crs_name = "EPSG:32611") {
    std::vector<float> heights(static_cast<std::size_t>(columns * kRows), 10);
    for (int r = 0; r < kRows; ++r) heights[static_cast<std::size_t>(r * columns + 5)] = 50;
    for (int r = 0; r < kRows; ++r) heights[static_cast<std::size_t>(r * columns + 8)] += more_m;
    for (int c = 0; c < columns; ++c) heights[static_cast<std::size_t>(5 * columns + c)] = -99;
    return test::write_dem(folder_.path(name),
                           {.columns = columns,
                            .rows = kRows,
                            .left = 500'000,
                            .top = 4'000'000,
                            .cell_m = 100,
                            .crs = crs_name,
                            .nodata = -99},
                           std::move(heights));
  }

  RunResult view(const std::string& options, const std::string& output = "out.tif") {
    return run_scarp("$SCARP viewshed " + dem_ + " -o " + folder_.path(output) + " " + options);
  }
  std::vector<double> read(const std::string& output = "out.tif") {
    const GDALDatasetUniquePtr dataset(
        GDALDataset::Open(folder_.path(output).c_str(), GDAL_OF_RASTER));
    std::vector<double> values(kColumns * kRows);
    EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, kColumns, kRows, values.data(),
                                                  kColumns, kRows, GDT_Float64, 0, 0),
              CE_None);
    return values;
  }

  const test::TempFolder folder_;
  std::string dem_;
};

/// Centre of the second cell of the second row, 2 m over ground.
constexpr char kEye[] = "--observer 500150,3999850";

TEST_F(ViewshedCommand, WritesWhatIsSeenAndSaysHow) {
  const RunResult result = view(std::string(kEye) + " --json");
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const json report = json::parse(result.output);
  EXPECT_EQ(report["visible_samples"], 30);
  EXPECT_EQ(report["hidden_samples"], 30);
  EXPECT_EQ(report["unknown_samples"], 12);
  const std::vector<double> values = read();
  EXPECT_EQ(values[0], 1);
  EXPECT_EQ(values[5], 1);
  EXPECT_EQ(values[6], 0);
  EXPECT_EQ(values[kColumns * 5], 255);
  const GDALDatasetUniquePtr out(
      GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
  EXPECT_STREQ(out->GetMetadataItem("SURFACE"), "grid");
  EXPECT_STREQ(out->GetMetadataItem("EARTH"), "ellipsoid");
  EXPECT_STREQ(out->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  EXPECT_NE(out->GetRasterBand(1)->GetColorTable(), nullptr);
}

TEST_F(ViewshedCommand, EachAccuracyIsMarkedAndSeesNearlyTheSame) {
  for (const std::string accuracy : {"exact", "high", "fast"}) {
    const RunResult result = view(std::string(kEye) + " --json --overwrite --accuracy " + accuracy);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    const json report = json::parse(result.output);
    EXPECT_EQ(report["accuracy"], accuracy);
    EXPECT_EQ(report["visible_samples"], 30) << accuracy;
    const GDALDatasetUniquePtr out(
        GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
    EXPECT_STREQ(out->GetMetadataItem("ACCURACY"), accuracy.c_str());
  }
  EXPECT_EQ(view(std::string(kEye) + " --accuracy best").exit_code, 2);
}

TEST_F(ViewshedCommand, ModesOfSeveralEyes) {
  const std::string eyes = std::string(kEye) + " --observer 501150,3999850,3";
  ASSERT_EQ(view(eyes + " --mode count").exit_code, 0);
  EXPECT_EQ(read()[0], 1);
  EXPECT_EQ(read()[5], 2);
  EXPECT_EQ(read()[kColumns * 5], 4294967295.0);
  ASSERT_EQ(view(eyes + " --mode visible --overwrite").exit_code, 0);
  EXPECT_EQ(read()[11], 1);
  ASSERT_EQ(view(std::string(kEye) + " --mode ground --earth flat --overwrite").exit_code, 0);
  // The line over the wall rises by 38 m in 400 m: after another 100 m it is at 47.5 m.
  EXPECT_NEAR(read()[kColumns + 6], 49.5, 0.01);
  EXPECT_EQ(read()[0], 0);
  EXPECT_TRUE(std::isnan(read()[kColumns * 5]));
  ASSERT_EQ(view(std::string(kEye) + " --mode dem --earth flat --overwrite").exit_code, 0);
  EXPECT_NEAR(read()[kColumns + 6], 59.5, 0.01);
  ASSERT_EQ(view(std::string(kEye) + " --gdal-values --overwrite").exit_code, 0);
  EXPECT_EQ(read()[0], 255);
}

TEST_F(ViewshedCommand, EyesFromAFile) {
  std::ofstream(folder_.path("eyes.csv"))
      << "name,x,y,height,radius\nwest,500150,3999850,2,\neast/1,501150,3999850,2,250\n";
  std::filesystem::create_directory(folder_.path("each"));
  const RunResult result = view("--observers " + folder_.path("eyes.csv") +
                                " --mode count --each " + folder_.path("each"));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(read()[5], 1);  // 600 m from the eastern eye
  EXPECT_EQ(read()[10], 1);
  EXPECT_TRUE(std::filesystem::exists(folder_.path("each/west.tif")));
  EXPECT_EQ(read("each/east_1.tif")[10], 1);
  EXPECT_EQ(read("each/east_1.tif")[5], 0);
}

TEST_F(ViewshedCommand, EyesOfOneNameHaveARasterEach) {
  std::ofstream(folder_.path("eyes.csv")) << "name,x,y\nmast,500150,3999850\nmast,501150,3999850\n";
  std::filesystem::create_directory(folder_.path("each"));
  const std::string options =
      "--observers " + folder_.path("eyes.csv") + " --each " + folder_.path("each");
  ASSERT_EQ(view(options).exit_code, 0);
  EXPECT_EQ(read("each/mast.tif")[11], 0);
  EXPECT_EQ(read("each/mast_2.tif")[11], 1);
  // What is there already shows before the work.
  std::filesystem::remove(folder_.path("out.tif"));
  EXPECT_NE(view(options).errors.find("mast.tif': exists"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("out.tif")));
}

TEST_F(ViewshedCommand, ObstaclesHideTheGroundUnderAndBehindThem) {
  const std::string hedged = write_dem("dsm.tif", kColumns, 10);
  const std::string eye = "--observer 501150,3999850";
  ASSERT_EQ(view(eye).exit_code, 0);
  EXPECT_EQ(read()[kColumns + 8], 1);
  EXPECT_EQ(read()[kColumns + 6], 1);
  ASSERT_EQ(view(eye + " --obstacles " + hedged + " --overwrite").exit_code, 0);
  EXPECT_EQ(read()[kColumns + 9], 1);
  EXPECT_EQ(read()[kColumns + 6], 0);
  EXPECT_EQ(read()[kColumns + 5], 1);  // the wall behind is higher
  const GDALDatasetUniquePtr out(
      GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
  EXPECT_STREQ(out->GetMetadataItem("OBSTACLES"), "dsm.tif");
}

TEST_F(ViewshedCommand, PolygonsHoldTheVisibleCells) {
  const std::string outlines = folder_.path("seen.gpkg");
  ASSERT_EQ(view(std::string(kEye) + " --polygons " + outlines).exit_code, 0);
  const GDALDatasetUniquePtr file(GDALDataset::Open(outlines.c_str(), GDAL_OF_VECTOR));
  ASSERT_NE(file, nullptr);
  OGRLayer* layer = file->GetLayerByName("areas");
  ASSERT_NE(layer, nullptr);
  EXPECT_NE(layer->GetSpatialRef(), nullptr);
  double area_m2 = 0;
  for (auto& feature : layer) {
    EXPECT_EQ(feature->GetFieldAsInteger64("visible"), 1);
    ASSERT_TRUE(feature->GetGeometryRef()->IsValid());
    area_m2 += feature->GetGeometryRef()->toPolygon()->get_Area();
  }
  const std::vector<double> values = read();
  EXPECT_NEAR(area_m2, 1e4 * static_cast<double>(std::count(values.begin(), values.end(), 1)), 1);
}

TEST_F(ViewshedCommand, TotalIsTheAreaThatEachSampleSees) {
  ASSERT_EQ(view("--total --earth flat --json").exit_code, 0);
  const std::vector<double> values = read();
  EXPECT_TRUE(std::isnan(values[kColumns * 5]));
  // West of the wall 5 columns and the wall's own are seen, in 5 rows of a hectare each.
  EXPECT_NEAR(values[kColumns + 1], 0.30, 0.001);
  EXPECT_NEAR(values[kColumns + 8], 0.35, 0.001);
  const GDALDatasetUniquePtr out(
      GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
  EXPECT_EQ(std::string(out->GetMetadataItem("ACCURACY")).substr(0, 5), "exact");
  ASSERT_EQ(view("--total --samples 20 --overwrite").exit_code, 0);
  const GDALDatasetUniquePtr drawn(
      GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
  EXPECT_EQ(std::string(drawn->GetMetadataItem("ACCURACY")).substr(0, 21), "estimated from 20 of ");
}

TEST_F(ViewshedCommand, SceneIsSeenAsItsLayerIs) {
  const std::string scene = folder_.path("a.scene");
  ASSERT_EQ(run_scarp("$SCARP build " + dem_ + " -o " + scene).exit_code, 0);
  const GDALDatasetUniquePtr layer(
      GDALDataset::Open((scene + "/layers/viewshed.tif").c_str(), GDAL_OF_RASTER));
  ASSERT_NE(layer, nullptr);
  const std::string observer = layer->GetMetadataItem("OBSERVER");
  const RunResult result = run_scarp("$SCARP viewshed " + scene + " --observer " + observer +
                                     " -o " + folder_.path("out.tif"));
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  std::vector<double> expected(kColumns * kRows);
  ASSERT_EQ(layer->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, kColumns, kRows, expected.data(),
                                              kColumns, kRows, GDT_Float64, 0, 0),
            CE_None);
  EXPECT_EQ(read(), expected);
  const GDALDatasetUniquePtr out(
      GDALDataset::Open(folder_.path("out.tif").c_str(), GDAL_OF_RASTER));
  EXPECT_STREQ(out->GetMetadataItem("SURFACE"), "tin");
  EXPECT_EQ(run_scarp("$SCARP viewshed " + scene + " --refraction 0.1 --observer " + observer +
                      " -o " + folder_.path("no.tif"))
                .exit_code,
            2);
  EXPECT_EQ(run_scarp("$SCARP viewshed " + scene + " --mode ground --observer " + observer +
                      " -o " + folder_.path("out.tif") + " --overwrite")
                .exit_code,
            0);
}

/// Where memory is short the arrays are on the disk: the same raster, and the bound holds.
TEST_F(ViewshedCommand, KeepsToItsMemory) {
  constexpr int kSide = 3600;
  constexpr std::uint64_t kAllowed = 180ULL << 20;
  const std::string dem = folder_.path("large.tif");
  {
    const GDALDatasetUniquePtr file(GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        dem.c_str(), kSide, kSide, 1, GDT_Int16, nullptr));
    std::vector<std::int16_t> heights(kSide);
    for (int r = 0; r < kSide; ++r) {
      for (int c = 0; c < kSide; ++c)
        heights[static_cast<std::size_t>(c)] =
            static_cast<std::int16_t>(200 * std::sin(c * 0.01) * std::cos(r * 0.013) + c % 7);
      ASSERT_EQ(file->GetRasterBand(1)->RasterIO(GF_Write, 0, r, kSide, 1, heights.data(), kSide, 1,
                                                 GDT_Int16, 0, 0),
                CE_None);
    }
  }
  const auto run = [&](const std::string& options, const std::string& output) {
    return run_scarp("$SCARP viewshed " + dem + " --observer 1800.5,1799.5,30 --json -o " +
                     folder_.path(output) + " " + options);
  };
  const auto pixels = [&](const std::string& output) {
    const GDALDatasetUniquePtr file(
        GDALDataset::Open(folder_.path(output).c_str(), GDAL_OF_RASTER));
    std::vector<std::uint32_t> values(static_cast<std::size_t>(kSide) * kSide);
    EXPECT_NE(file, nullptr);
    EXPECT_STREQ(file->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
    EXPECT_EQ(file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, kSide, kSide, values.data(), kSide,
                                               kSide, GDT_UInt32, 0, 0),
              CE_None);
    return values;
  };
  for (const std::string mode : {"visible", "count"}) {
    const std::string plain = mode + ".tif", short_of_memory = mode + "_short.tif";
    const RunResult all = run("--mode " + mode, plain);
    ASSERT_EQ(all.exit_code, 0) << all.errors;
    const RunResult few = run("--memory 180M --mode " + mode, short_of_memory);
    ASSERT_EQ(few.exit_code, 0) << few.errors;
    const json stages = json::parse(few.output)["stages"];
    for (const json& stage : stages)
      EXPECT_LE(stage["peak_bytes"].get<std::uint64_t>(), kAllowed) << stage["name"];
    EXPECT_EQ(pixels(short_of_memory), pixels(plain));
  }
  // Not enough for blocks either.
  const RunResult none = run("--memory 40M", "none.tif");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.errors.find("--memory"), std::string::npos) << none.errors;
  EXPECT_FALSE(std::filesystem::exists(folder_.path("none.tif")));
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path("")))
    EXPECT_EQ(entry.path().filename().string().find("scratch"), std::string::npos);
}

TEST_F(ViewshedCommand, RefusesInOneLineAndLeavesNothing) {
  const auto refused = [&](const std::string& options, int code, const std::string& words) {
    const RunResult result = view(options);
    EXPECT_EQ(result.exit_code, code) << options;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(folder_.path("out.tif")));
  };
  refused("", 2, "--observer");
  refused("--observer 1,2", 1, "outside the data");
  refused("--observer 500150,3999450", 1, "void");
  refused(std::string(kEye) + " --refraction 2", 1, "refraction");
  refused(std::string(kEye) + " --pitch 5,3", 2, "lowest");
  refused(std::string(kEye) + " --azimuth 5", 2, "--azimuth");
  refused(std::string(kEye) + " --min-distance 50 --max-distance 20", 2, "--min-distance");
  refused(std::string(kEye) + " --each " + folder_.path("nowhere"), 1, "folder");
  refused(std::string(kEye) + " --overwrite --polygons " + folder_.path("out.tif"), 2, "twice");
  refused(std::string(kEye) + " --overwrite --polygons " + dem_, 2, "twice");
  EXPECT_TRUE(std::filesystem::exists(dem_));
  refused("--observer 500150,3999450,1000asl --crs EPSG:0", 1, "EPSG:0");
  refused("--total " + std::string(kEye), 2, "--observer does not go with --total");
  refused("--total --azimuth 1,2", 2, "--azimuth");
  // 72 samples of 12 bytes, of 15 where eyes are counted.
  refused(std::string(kEye) + " --mode count --memory 1000", 1, "--memory");
  refused(std::string(kEye) + " --mode dem --polygons " + folder_.path("a.gpkg"), 2, "--polygons");
  refused(std::string(kEye) + " --obstacles " + write_dem("other.tif", 11, 0), 1, "11 x 6 cells");
  refused(std::string(kEye) + " --obstacles " + write_dem("zone12.tif", kColumns, 0, "EPSG:32612"),
          1, "another coordinate system");
  EXPECT_EQ(view("--observer 500150,3999450,1000asl").exit_code, 0);
  EXPECT_EQ(view(kEye).exit_code, 1);
  EXPECT_EQ(view(std::string(kEye) + " --overwrite").exit_code, 0);
}

}  // namespace
}  // namespace scarp
