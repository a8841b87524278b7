#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cli/written_dem.h"
#include "tests/support/fractal_ground.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"
#include "tiles/cells/sets_file.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::run_scarp;
using test::RunResult;

constexpr int kSide = 150;
constexpr double kLeft = 400'000, kTop = 5'200'000, kCellM = 30;

std::string place(double column, double row, const std::string& height = "2") {
  return std::to_string(kLeft + column * kCellM) + "," + std::to_string(kTop - row * kCellM) + "," +
         height;
}

/// Mountains as a scene of 3 x 3 tiles and as one of one tile, built once.
class ExportCulling : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    const test::FractalGround ground(3);
    std::vector<std::int16_t> all;
    for (int row = 0; row < kSide; ++row) {
      std::vector<std::int16_t> heights(kSide);
      ground.row(700, 900 + row, heights);
      all.insert(all.end(), heights.begin(), heights.end());
    }
    const std::string dem = test::write_dem(
        folder_->path("dem.tif"),
        {.columns = kSide, .rows = kSide, .left = kLeft, .top = kTop, .cell_m = kCellM},
        std::move(all));
    for (const char* name : {"tiled", "whole"})
      ASSERT_EQ(run_scarp("$SCARP build '" + dem + "' -o '" + scene(name) +
                          "' --max-error 3 --fans 24 --group-triangles 40 "
                          "--min-group-triangles 10 --refraction 0.13 --tile-samples " +
                          (std::string(name) == "tiled" ? "64" : "256"))
                    .exit_code,
                0);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string scene(const std::string& name) { return folder_->path(name + ".scene"); }

  static test::TempFolder* folder_;
};
test::TempFolder* ExportCulling::folder_ = nullptr;

/// The header and `scarp cull` answer for the same places: what the header adds to what is hidden
/// is next to nothing (cells' borders), and what it misses little.
TEST_F(ExportCulling, TheHeaderHidesWhatCullHides) {
  for (const char* name : {"tiled", "whole"}) {
    const std::string out = folder_->path(std::string(name) + "-groups");
    const RunResult exported =
        run_scarp("$SCARP export '" + scene(name) + "' --to groups -o '" + out + "' --json");
    ASSERT_EQ(exported.exit_code, 0) << exported.errors;
    runtime::Culling culling;
    ASSERT_EQ(culling.open((out + "/groups.scarp").c_str()), runtime::Status::kOk);
    EXPECT_EQ(json::parse(exported.output)["groups"], culling.groups());
    std::size_t by_cull = 0, by_header = 0, more = 0;
    for (const auto& [column, row] : {std::pair(30, 30), {75, 75}, {100, 60}, {20, 130}}) {
      const RunResult told = run_scarp("$SCARP cull '" + scene(name) + "' --camera " +
                                       place(column + 0.5, row + 0.5) + " --json");
      ASSERT_EQ(told.exit_code, 0) << told.errors;
      const json answer = json::parse(told.output);
      const auto list = answer["visible_groups"].get<std::vector<std::uint32_t>>();
      const std::set<std::uint32_t> visible(list.begin(), list.end());
      // The camera again, in ECEF, by GDAL.
      OGRSpatialReference from, to;
      from.SetFromUserInput("EPSG:32632");
      to.SetFromUserInput("EPSG:4978");
      from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      to.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      OGRSpatialReference geographic;
      geographic.SetFromUserInput("EPSG:4979");
      geographic.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      double x = answer["camera"]["x"], y = answer["camera"]["y"], z = 0;
      const std::unique_ptr<OGRCoordinateTransformation> flat(
          OGRCreateCoordinateTransformation(&from, &geographic));
      ASSERT_TRUE(flat && flat->Transform(1, &x, &y, &z));
      z = answer["camera"]["height_m"];
      const std::unique_ptr<OGRCoordinateTransformation> round(
          OGRCreateCoordinateTransformation(&geographic, &to));
      ASSERT_TRUE(round && round->Transform(1, &x, &y, &z));
      const auto camera = culling.camera(x, y, z);
      ASSERT_TRUE(camera.is_valid);
      std::vector<std::uint32_t> shown(culling.groups());
      shown.resize(culling.visible(camera, nullptr, shown.data()));
      const std::set<std::uint32_t> shows(shown.begin(), shown.end());
      ASSERT_EQ(shows.size(), shown.size());
      by_cull += culling.groups() - visible.size();
      by_header += culling.groups() - shows.size();
      for (const std::uint32_t group : visible) more += shows.count(group) == 0;
    }
    EXPECT_GT(by_cull, 0U);
    EXPECT_GE(by_header + 1, by_cull);
    EXPECT_LE(more, 1U);
  }
}

TEST_F(ExportCulling, TablesSayWhatTheFileSays) {
  const std::string out = folder_->path("tables");
  ASSERT_EQ(
      run_scarp("$SCARP export '" + scene("tiled") + "' --to groups -o '" + out + "'").exit_code,
      0);
  runtime::Culling culling;
  ASSERT_EQ(culling.open((out + "/groups.scarp").c_str()), runtime::Status::kOk);
  const GDALDatasetUniquePtr tables(
      GDALDataset::Open((out + "/groups.gpkg").c_str(), GDAL_OF_VECTOR));
  ASSERT_TRUE(tables);
  EXPECT_EQ(tables->GetLayerByName("groups")->GetFeatureCount(), culling.groups());
  EXPECT_EQ(tables->GetLayerByName("tiles")->GetFeatureCount(), culling.tiles());
  EXPECT_EQ(tables->GetLayerByName("frame")->GetFeatureCount(), 1);
  const OGRFeatureUniquePtr row(tables->GetLayerByName("groups")->GetFeature(3));
  const auto record = culling.record(2);
  EXPECT_EQ(row->GetFieldAsInteger64("group"), culling.id(2));
  EXPECT_DOUBLE_EQ(row->GetFieldAsDouble("centre_x_m"), record.x * culling.unit_m());
  int bytes = 0;
  const GByte* steps = row->GetFieldAsBinary(row->GetFieldIndex("steps"), &bytes);
  ASSERT_EQ(bytes, static_cast<int>(record.sectors * 16));
  EXPECT_EQ(std::memcmp(steps, record.steps, static_cast<std::size_t>(bytes)), 0);
}

TEST_F(ExportCulling, ViewCellsAndAnObserversAirspaceAreWritten) {
  const std::string cells = folder_->path("cells"), seen = folder_->path("seen");
  const RunResult made = run_scarp("$SCARP export '" + scene("tiled") + "' --to vdb -o '" + cells +
                                   "' --cell 300 --altitudes 10,100 --json");
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_GT(json::parse(made.output)["hidden_share"], 0.01);
  const HiddenSets sets =
      read_sets(SectionFile::open(cells + "/hidden_sets.bin", Verify::kEverything));
  EXPECT_EQ(json::parse(made.output)["sets"], sets.size());
  const RunResult airspace = run_scarp("$SCARP export '" + scene("tiled") + "' --to vdb -o '" +
                                       seen + "' --observer " + place(75.5, 75.5) + " --json");
  ASSERT_EQ(airspace.exit_code, 0) << airspace.errors;
  EXPECT_GT(json::parse(airspace.output)["visible_cells"], 1000);
  EXPECT_TRUE(fs::exists(seen + "/cells.vdb"));
}

TEST_F(ExportCulling, WhatCannotBeExportedIsRefusedInOneLine) {
  const std::string out = folder_->path("nothing");
  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const RunResult result = run_scarp("$SCARP export " + arguments + " -o '" + out + "'");
    EXPECT_NE(result.exit_code, 0) << arguments;
    EXPECT_NE(result.errors.find(why), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1);
    EXPECT_FALSE(fs::exists(out));
  };
  refused("'" + scene("tiled") + "' --to vdb --altitudes 100,10", "rising ones");
  refused("'" + scene("tiled") + "' --to vdb --cell 0.2", "give a larger one");
  refused("'" + scene("tiled") + "' --to nothing", "not a format");
  refused("'" + scene("tiled") + "' --to groups --cell 30", "is for --to vdb");
  refused("'" + scene("none") + "' --to groups", "none.scene");
}

/// An entity behind the ridge sleeps, and one beside the camera does not; whoever sleeps for all
/// places of a cell sleeps for each of them.
TEST_F(ExportCulling, EntitiesThatNobodyCanSeeSleep) {
  const std::string file = folder_->path("entities.csv");
  {
    std::ofstream out(file);
    out << "name,x,y,height,radius\n";
    for (int i = 0; i < 400; ++i)
      out << "e" << i << ',' << kLeft + (5.3 + (i % 20) * 7) * kCellM << ','
          << kTop - (5.7 + (i / 20) * 7) * kCellM << ",3,2\n";
    out << "\"a, b\"," << kLeft + 76 * kCellM << ',' << kTop - 75.5 * kCellM << ",1000,1\n";
    out << "away," << kLeft - 1e5 << ',' << kTop << ",3,2\n";
  }
  const auto ask = [&](const std::string& more) {
    return run_scarp("$SCARP cull '" + scene("tiled") + "' --camera " + place(75.5, 75.5) +
                     " --entities '" + file + "' " + more);
  };
  const RunResult told = ask("--json");
  ASSERT_EQ(told.exit_code, 0) << told.errors;
  const json answer = json::parse(told.output);
  EXPECT_EQ(answer["entities"], 402);
  EXPECT_GT(answer["hidden"], 40);
  EXPECT_TRUE(answer["answers"][400]["may_be_seen"]);
  EXPECT_TRUE(answer["answers"][401]["may_be_seen"]);
  const json around = json::parse(ask("--json --within 40").output);
  EXPECT_GT(around["hidden"], 10);
  for (std::size_t i = 0; i < 402; ++i)
    EXPECT_LE(answer["answers"][i]["may_be_seen"], around["answers"][i]["may_be_seen"]);
  // Every one that sleeps is judged: nothing at its top's middle is seen.
  int judged = 0;
  for (std::size_t i = 0; i < 400 && judged < 15; i += 3) {
    const json& entity = answer["answers"][i];
    if (entity["may_be_seen"]) continue;
    ++judged;
    const RunResult line =
        run_scarp("$SCARP sight '" + scene("tiled") + "' --from " + place(75.5, 75.5) + " --to " +
                  std::to_string(entity["x"].get<double>()) + "," +
                  std::to_string(entity["y"].get<double>()) + ",3 --json");
    ASSERT_EQ(line.exit_code, 0) << line.errors;
    EXPECT_EQ(json::parse(line.output)["sight"], "hidden") << line.output;
  }
  const RunResult table = ask("");
  EXPECT_EQ(table.output.rfind("name,x,y,may_be_seen\n", 0), 0U);
  EXPECT_NE(table.output.find("\"a, b\","), std::string::npos);
  EXPECT_EQ(std::count(table.output.begin(), table.output.end(), '\n'), 403);
}

}  // namespace
}  // namespace scarp
