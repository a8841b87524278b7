#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class FlyCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    std::ofstream file(folder_->path("hills.asc"));
    file << "ncols 40\nnrows 40\nxllcorner 5000\nyllcorner 0\ncellsize 100\n";
    for (int r = 0; r < 40; ++r, file << '\n')
      for (int c = 0; c < 40; ++c)
        file << std::round(400 + 250 * std::sin(0.5 * c + 0.2 * r) + 60 * std::cos(0.7 * r)) << ' ';
    file.close();
    scene_ = folder_->path("hills.scene");
    const RunResult built = run_scarp(
        "$SCARP build " + folder_->path("hills.asc") + " -o " + scene_ +
        " --max-error 5 --group-triangles 24 --min-group-triangles 6 --fans 32 --horizon both");
    ASSERT_EQ(built.exit_code, 0) << built.errors;
  }
  static void TearDownTestSuite() { delete folder_; }

  static inline test::TempFolder* folder_ = nullptr;
  static inline std::string scene_;
};

TEST_F(FlyCommand, MethodsThatClaimItShowNoWrongPixelAndLeaveSomethingOut) {
  for (const char* route : {"walk", "helicopter"}) {
    const RunResult run = run_scarp("$SCARP fly " + scene_ + " -o " + folder_->path(route) +
                                    " --route " + route + " --frames 12 --width 160 --json");
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const json result = json::parse(run.output);
    std::set<std::string> methods;
    double all = 0;
    for (const json& method : result["methods"]) {
      const std::string name = method["method"];
      methods.insert(name);
      if (name == "frustum") all = method["drawn"];
      // So few hills are less than the estimate of depths of hom and the margin of masks want.
      const bool is_coarse = name == "hom" || name.starts_with("mask");
      if (name != "frustum" && !is_coarse) {
        EXPECT_LT(method["drawn"], all) << name;
      }
      if (!method["claims_no_wrong_pixel"].get<bool>()) continue;
      EXPECT_EQ(method["wrong_px"], json::array({0, 0})) << name;
      EXPECT_EQ(method["judged_wrong_px"], json::array({0, 0})) << name;
      EXPECT_EQ(method["missed_groups"], 0) << name;
    }
    EXPECT_EQ(methods,
              (std::set<std::string>{"frustum", "thesis", "certified", "swept", "cells", "law-tan",
                                     "hzb", "mask", "mask-plain", "hom", "hom-0.7", "hybrid",
                                     "volume-scan", "lod-query", "multi-frame", "stop-and-wait"}));
  }
}

TEST_F(FlyCommand, AnswersAreDrawnRefinedAndWithinABudget) {
  const std::string fly = "$SCARP fly " + scene_ + " --overwrite -o " + folder_->path("levels") +
                          " --route walk --frames 8 --width 160 --json --refine 1 "
                          "--methods frustum,certified --budget ";
  const auto methods_within = [&](int budget) {
    const RunResult run = run_scarp(fly + std::to_string(budget));
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return json::parse(run.output)["methods"];
  };
  const auto finest = [](const json& method) {
    const json& px = method["budget"]["level_px"];
    return px[0].get<double>() / (px[0].get<double>() + px[1].get<double>() + px[2].get<double>());
  };
  const json free = methods_within(1'000'000);
  for (const json& method : free) {
    EXPECT_EQ(finest(method), 1);
    EXPECT_EQ(method["refined"]["other_px"], 0);
    EXPECT_LT(method["refined"]["drawn"], method["refined"]["without_culling"].get<double>() / 2);
  }
  const json &everything = free[0]["refined"], &certified = free[1]["refined"];
  EXPECT_EQ(everything["by_groups"], everything["without_culling"]);
  EXPECT_LT(certified["by_groups"], everything["by_groups"]);
  EXPECT_LE(certified["drawn"], certified["by_groups"]);

  // Three quarters of what is not culled: those nearest come first.
  const int budget = static_cast<int>(0.75 * free[1]["budget"]["drawn"].get<double>());
  const json tight = methods_within(budget);
  for (const json& method : tight) EXPECT_LE(method["budget"]["drawn"], budget);
  EXPECT_LT(finest(tight[0]), 1);
  EXPECT_GT(finest(tight[1]), finest(tight[0]))
      << "what is culled leaves triangles to what is seen";

  const RunResult refused = run_scarp("$SCARP fly " + scene_ + " -o " + folder_->path("refused") +
                                      " --refine 1 --changes 4");
  EXPECT_EQ(refused.exit_code, 2);
}

TEST_F(FlyCommand, MoversAreLeftOutOnlyWhereTheyAreHidden) {
  const RunResult run =
      run_scarp("$SCARP fly " + scene_ + " -o " + folder_->path("movers") +
                " --route walk --seed 2 --frames 12 --width 160 --movers 60 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json result = json::parse(run.output);
  EXPECT_GT(result["movers_visible"], 20);
  EXPECT_LT(result["movers_visible"], result["movers_in_view"]);
  for (const json& method : result["methods"]) {
    const std::string name = method["method"];
    EXPECT_LE(method["movers"], result["movers_in_view"]) << name;
    if (name == "hzb" || name == "stop-and-wait") {
      EXPECT_LT(method["movers"], result["movers_in_view"]) << name;
    }
    if (!method["claims_no_wrong_pixel"].get<bool>()) continue;
    EXPECT_EQ(method["wrong_px"], json::array({0, 0})) << name;
    EXPECT_EQ(method["missed_movers"], 0) << name;
  }
}

TEST_F(FlyCommand, MethodsThatFollowStayRightInASceneThatChanges) {
  const std::string fly = "$SCARP fly " + scene_ + " --overwrite -o " + folder_->path("changes") +
                          " --route helicopter --frames 42 --width 160 --changes 6 --json";
  const RunResult run = run_scarp(fly);
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  std::set<std::string> methods;
  const json result = json::parse(run.output);
  for (const json& method : result["methods"]) {
    const std::string name = method["method"];
    methods.insert(name);
    if (name != "frustum" && name != "hzb") continue;
    EXPECT_EQ(method["wrong_px"], json::array({0, 0})) << name;
    EXPECT_EQ(method["missed_groups"], 0) << name;
  }
  EXPECT_TRUE(methods.count("mask") && methods.count("lod-query"));
  EXPECT_FALSE(methods.count("certified"));
  const RunResult refused = run_scarp(fly + " --methods certified");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.errors.find("--changes"), std::string::npos) << refused.errors;
}

TEST_F(FlyCommand, WritesAPathThatRepeatsTheFlight) {
  const std::string first = folder_->path("first"), again = folder_->path("again");
  ASSERT_EQ(run_scarp("$SCARP fly " + scene_ + " -o " + first +
                      " --frames 5 --seed 3 --width 64 --methods certified")
                .exit_code,
            0);
  ASSERT_EQ(run_scarp("$SCARP fly " + scene_ + " -o " + again + " --path " + first +
                      "/path.csv --width 64 --methods certified")
                .exit_code,
            0);
  EXPECT_EQ(read_text(first + "/path.csv"), read_text(again + "/path.csv"));
  const std::string page = read_text(first + "/flight.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_EQ(page.find("http://"), page.find("http://www.w3.org/2000/svg")) << "no network";
  EXPECT_TRUE(std::filesystem::exists(first + "/frame-0-certified.png"));
  EXPECT_TRUE(std::filesystem::exists(first + "/frames.csv"));
}

TEST_F(FlyCommand, RefusesInOneLineAndLeavesNothing) {
  std::ofstream(folder_->path("bad.csv")) << "x,y,height_m,azimuth_deg,pitch_deg\n1,2,3,4\n";
  std::ofstream(folder_->path("empty.csv")) << "x,y,height_m,azimuth_deg,pitch_deg\n";
  std::ofstream(folder_->path("other.csv")) << "a,b\n1,2\n";
  const struct {
    std::string options, found;
  } cases[] = {{"--path " + folder_->path("bad.csv"), "line 2: '1,2,3,4'"},
               {"--path " + folder_->path("empty.csv"), "no frame"},
               {"--path " + folder_->path("other.csv"), "begins with 'a,b'"},
               {"--path " + folder_->path("none.csv"), "cannot be read"}};
  for (const auto& c : cases) {
    const RunResult run =
        run_scarp("$SCARP fly " + scene_ + " -o " + folder_->path("never") + " " + c.options);
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.errors.find(c.found), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_->folder()))
    EXPECT_EQ(entry.path().filename().string().find("never"), std::string::npos) << entry.path();
}

TEST_F(FlyCommand, ReplacesAnEarlierFlightAndNothingElse) {
  const std::string out = folder_->path("replaced");
  const std::string fly = "$SCARP fly " + scene_ + " -o " + out +
                          " --frames 2 --width 64 --methods frustum --overwrite";
  ASSERT_EQ(run_scarp(fly).exit_code, 0);
  EXPECT_EQ(run_scarp(fly).exit_code, 0);
  const std::string work = folder_->path("work");
  std::filesystem::create_directory(work);
  std::ofstream(work + "/thesis.txt") << "years of work";
  const RunResult run = run_scarp("$SCARP fly " + scene_ + " -o " + work + " --overwrite");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.errors.find("earlier results"), std::string::npos) << run.errors;
  EXPECT_EQ(read_text(work + "/thesis.txt"), "years of work");
}

}  // namespace
}  // namespace scarp
