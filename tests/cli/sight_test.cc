#include <cpl_minixml.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

/// A DEM without a CRS, cells of 100 m, the middle of the lower left one at 50,50: heights 0, but
/// for one column, and one void sample where that is asked for.
std::string write_wall(const std::string& path, int columns, int rows, int wall_column,
                       int height_m, int void_column = -1) {
  std::ofstream file(path);
  file << "ncols " << columns << "\nnrows " << rows
       << "\nxllcorner 0\nyllcorner 0\ncellsize 100\nNODATA_value -9999\n";
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c)
      file << (c == void_column ? -9999 : c == wall_column ? height_m : 0) << ' ';
    file << '\n';
  }
  return path;
}

json run_json(const std::string& arguments) {
  const RunResult run = run_scarp("$SCARP " + arguments + " --json");
  EXPECT_EQ(run.exit_code, 0) << arguments << '\n' << run.errors;
  return run.exit_code == 0 ? json::parse(run.output) : json();
}

std::vector<std::vector<std::string>> read_csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

class SightCommand : public testing::Test {
 protected:
  test::TempFolder folder_;
  std::string wall_ = write_wall(folder_.path("wall.asc"), 11, 3, 5, 40);
};

TEST_F(SightCommand, WallHalfwayBlocksAndTellsHowHighToGo) {
  const json r = run_json("sight " + wall_ + " --from 50,150 --to 1050,150 --frequency 5.8GHz");
  EXPECT_EQ(r["surface"], "grid");
  EXPECT_EQ(r["earth"], "flat");
  EXPECT_EQ(r["sight"], "hidden");
  EXPECT_EQ(r["distance_m"], 1000);
  EXPECT_EQ(r["azimuth_deg"], 90);
  EXPECT_EQ(r["first_blocker"]["x"], 550);
  EXPECT_EQ(r["first_blocker"]["y"], 150);
  EXPECT_EQ(r["first_blocker"]["height_m"], 40);
  EXPECT_EQ(r["first_blocker"]["distance_m"], 500);
  EXPECT_EQ(r["first_blocker"]["above_line_m"], 38);
  EXPECT_EQ(r["from"]["least_above_ground_m"], 78);
  EXPECT_EQ(r["to"]["least_above_ground_m"], 78);
  EXPECT_EQ(r["profile"].size(), 9U);
  const double radius_m = std::sqrt(299'792'458 / 5.8e9 * 500 * 500 / 1000);
  EXPECT_NEAR(r["fresnel"]["least_ratio"], -38 / radius_m, 1e-9);
  EXPECT_EQ(run_json("sight " + wall_ + " --from 50,150,78 --to 1050,150")["sight"], "visible");
  EXPECT_EQ(run_json("sight " + wall_ + " --from 50,150,77.999 --to 1050,150")["sight"], "hidden");
}

TEST_F(SightCommand, VoidIsUnknownAndEndsOutsideNeedNoGround) {
  const std::string dem = write_wall(folder_.path("void.asc"), 11, 3, 5, 40, 8);
  const json r = run_json("sight " + dem + " --from=-500,150,300asl --to 1050,150");
  EXPECT_EQ(r["sight"], "unknown");
  EXPECT_TRUE(r["from"]["above_ground_m"].is_null());
  EXPECT_TRUE(r["from"]["least_above_ground_m"].is_null());
  EXPECT_EQ(r["first_blocker"], nullptr);
  EXPECT_EQ(run_json("sight " + dem + " --from 50,150 --to 1050,150")["sight"], "hidden");
}

TEST_F(SightCommand, GeographicLineIsTheSameFromBothEnds) {
  const std::string dem = test::jacksboro_vrt(folder_.folder().string());
  if (dem.empty()) GTEST_SKIP() << "left out, python-matplotlib-data is not installed";
  const std::string a = "-84.3,36.6,20", b = "-84.15,36.5,40";
  const json there = run_json("sight " + dem + " --refraction 0.25 --from=" + a + " --to=" + b);
  const json back = run_json("sight " + dem + " --refraction 0.25 --from=" + b + " --to=" + a);
  EXPECT_EQ(there["earth"], "ellipsoid");
  EXPECT_EQ(there["sight"], back["sight"]);
  EXPECT_NEAR(there["distance_m"], back["distance_m"], 0.01);
  EXPECT_NEAR(there["distance_m"], 17'417, 60);
  EXPECT_EQ(there["from"]["least_above_ground_m"], back["to"]["least_above_ground_m"]);
  ASSERT_EQ(there["profile"].size(), back["profile"].size());
  EXPECT_GT(there["profile"].size(), 250U);
  EXPECT_NEAR(there["least_clearance"]["clearance_m"], back["least_clearance"]["clearance_m"],
              1e-6);
  const double least_m = there["from"]["least_above_ground_m"];
  const auto sight_at = [&](double height_m) {
    return run_json(fmt::format("sight {} --refraction 0.25 --from=-84.3,36.6,{:.6f} --to={}", dem,
                                height_m, b))["sight"];
  };
  ASSERT_GT(least_m, 0);
  EXPECT_EQ(sight_at(least_m + 0.001), "visible");
  EXPECT_EQ(sight_at(least_m - 0.001), "hidden");
}

TEST_F(SightCommand, DrawsASoundPictureAndWritesTheSameJson) {
  const std::string line = "sight " + wall_ + " --from 50,150 --to 1050,150 --frequency 868MHz";
  const std::string svg = folder_.path("p.svg"), data = folder_.path("p.json");
  const json printed = run_json(line + " -o " + data);
  EXPECT_EQ(json::parse(std::ifstream(data)), printed);
  ASSERT_EQ(run_scarp("$SCARP " + line + " -o " + svg).exit_code, 0);
  CPLXMLNode* root = CPLParseXMLFile(svg.c_str());
  ASSERT_NE(root, nullptr);
  EXPECT_STREQ(root->pszValue, "svg");
  CPLDestroyXMLNode(root);
  std::ostringstream text;
  text << std::ifstream(svg).rdbuf();
  EXPECT_NE(text.str().find("ground 38.00 m above the line, 500 m away"), std::string::npos);
  EXPECT_NE(text.str().find("height, m"), std::string::npos);
  EXPECT_NE(text.str().find("distance along the ground, m"), std::string::npos);
}

TEST_F(SightCommand, SceneIsJudgedOnItsTin) {
  const std::string dem = write_wall(folder_.path("scene.asc"), 21, 21, 10, 40);
  const std::string scene = folder_.path("a.scene");
  const RunResult built = run_scarp("$SCARP build " + dem + " -o " + scene + " --max-error 0.01");
  ASSERT_EQ(built.exit_code, 0) << built.errors;
  const json r = run_json("sight " + scene + " --from 550,1050 --to 1550,1050");
  EXPECT_EQ(r["surface"], "tin");
  EXPECT_EQ(r["sight"], "hidden");
  // The tin's wall rises from 0 at 950 to 40 at 1050: the line at 2 m enters it at 955.
  EXPECT_GE(r["first_blocker"]["x"], 950);
  EXPECT_LE(r["first_blocker"]["x"], 1050);
  EXPECT_NEAR(r["from"]["least_above_ground_m"], 78, 0.05);
  const RunResult csv = run_scarp("$SCARP horizon " + scene + " --at 550,1050 --azimuths 4");
  const auto rows = read_csv(csv.output);
  ASSERT_EQ(rows.size(), 5U) << csv.errors;
  EXPECT_NEAR(std::stod(rows[2][1]), std::atan2(38, 500) * 180 / M_PI, 1e-3);
  const RunResult refused =
      run_scarp("$SCARP sight " + scene + " --from 550,1050 --to 1550,1050 --refraction 0.1");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.errors.find("leave --earth"), std::string::npos) << refused.errors;
}

TEST_F(SightCommand, HorizonOfAWallAsCsvAndJson) {
  const std::string dem = write_wall(folder_.path("far.asc"), 101, 3, 60, 1000);
  const std::string at = "horizon " + dem + " --at 1050,150,0 --azimuths 4";
  const auto rows = read_csv(run_scarp("$SCARP " + at).output);
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[0], (std::vector<std::string>{"azimuth_deg", "elevation_deg", "distance_m", "x",
                                               "y", "over_void"}));
  EXPECT_EQ(rows[2][0], "90");
  EXPECT_NEAR(std::stod(rows[2][1]), std::atan(0.2) * 180 / M_PI, 1e-6);
  EXPECT_NEAR(std::stod(rows[2][2]), 5000, 0.01);
  EXPECT_NEAR(std::stod(rows[2][3]), 6050, 0.01);
  const json r = run_json(at);
  EXPECT_EQ(r["north"], "grid");
  EXPECT_NEAR(r["horizon"][1]["elevation_deg"], std::stod(rows[2][1]), 1e-6);
  // From above, the edge of flat ground is under the level; nothing lies beyond the data.
  const json above = run_json("horizon " + dem + " --at 50,50,100 --azimuths 4");
  EXPECT_NEAR(above["horizon"][0]["elevation_deg"], -std::atan2(100, 200) * 180 / M_PI, 1e-6);
  EXPECT_EQ(above["horizon"][2]["elevation_deg"], nullptr);
}

TEST_F(SightCommand, HorizonOnTheEllipsoidCountsFromTrueNorth) {
  const std::string dem = test::jacksboro_vrt(folder_.folder().string());
  if (dem.empty()) GTEST_SKIP() << "left out, python-matplotlib-data is not installed";
  const json r = run_json("horizon " + dem + " --at=-84.25,36.6 --azimuths 8");
  EXPECT_EQ(r["north"], "true");
  ASSERT_EQ(r["horizon"].size(), 8U);
  EXPECT_NEAR(r["horizon"][0]["longitude_deg"], -84.25, 1e-4);
  EXPECT_GT(r["horizon"][0]["latitude_deg"], 36.6);
  EXPECT_GT(r["horizon"][2]["longitude_deg"], -84.25);
  EXPECT_NEAR(r["horizon"][2]["latitude_deg"], 36.6, 2e-3);
  // What is on the horizon is seen from there, a little above the ground.
  for (const json& h : r["horizon"]) {
    const json sight =
        run_json(fmt::format("sight {} --from=-84.25,36.6 --to={:.9f},{:.9f},1", dem,
                             h["longitude_deg"].get<double>(), h["latitude_deg"].get<double>()));
    EXPECT_EQ(sight["sight"], "visible") << h;
    EXPECT_NEAR(sight["distance_m"], h["distance_m"], 0.05);
    EXPECT_NEAR(
        std::remainder(sight["azimuth_deg"].get<double>() - h["azimuth_deg"].get<double>(), 360), 0,
        0.01);
  }
}

TEST_F(SightCommand, RefusalsAreOneLine) {
  const std::string s = "sight " + wall_, h = "horizon " + wall_,
                    ends = " --from 50,50 --to 950,50";
  std::ofstream(folder_.path("there.svg")) << "mine";
  struct Refusal {
    std::string arguments;
    int exit_code;
    std::string says;
  };
  const Refusal refusals[] = {
      {s + " --from 50,50", 2, "--to"},
      {s + " --from 50,50 --to 50,50,9", 1, "same place"},
      {s + " --from 50,50 --to 5000,50", 1, "outside the data"},
      {s + ends + " --frequency fast", 2, "--frequency fast"},
      {s + ends + " -o " + folder_.path("p.png"), 2, ".svg or .json"},
      {s + ends + " -o " + folder_.path("there.svg"), 1, "--overwrite"},
      {s + ends + " --crs OGC:CRS84", 1, "no coordinate system"},
      {h, 2, "--at"},
      {h + " --at 50,50 -o " + folder_.path("one.tif"), 2, ".csv or .json"},
      {h + " --at 50,50 --azimuths 0", 2, "--azimuths"},
  };
  for (const Refusal& refusal : refusals) {
    const RunResult run = run_scarp("$SCARP " + refusal.arguments);
    EXPECT_EQ(run.exit_code, refusal.exit_code) << refusal.arguments << '\n' << run.errors;
    EXPECT_NE(run.errors.find(refusal.says), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
    EXPECT_EQ(run.output, "");
  }
  for (const char* name : {"p.png", "one.tif"})
    EXPECT_FALSE(std::filesystem::exists(folder_.path(name)));
}

}  // namespace
}  // namespace scarp
