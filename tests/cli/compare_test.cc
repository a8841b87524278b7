#include <cpl_minixml.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cli/compare_picture.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

/// Ridges and valleys without a CRS.
void write_hills(const std::string& path) {
  std::ofstream file(path);
  file << "ncols 24\nnrows 24\nxllcorner 0\nyllcorner 0\ncellsize 100\n";
  for (int r = 0; r < 24; ++r, file << '\n')
    for (int c = 0; c < 24; ++c)
      file << std::round(200 + 150 * std::sin(0.9 * c + 0.2 * r) + 40 * std::cos(0.7 * r)) << ' ';
}

std::string read_text(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class CompareCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    write_hills(folder_->path("hills.asc"));
    scene_ = folder_->path("hills.scene");
    const RunResult built =
        run_scarp("$SCARP build " + folder_->path("hills.asc") + " -o " + scene_ +
                  " --vertices 200 --group-triangles 16 --min-group-triangles 4 --fans 8");
    ASSERT_EQ(built.exit_code, 0) << built.errors;
  }
  static void TearDownTestSuite() { delete folder_; }

  static inline test::TempFolder* folder_ = nullptr;
  static inline std::string scene_;
};

TEST_F(CompareCommand, ChartsBothMethodsWithTheirDefaultsAndCertifiedIsNeverWrong) {
  const std::string out = folder_->path("compared");
  const RunResult run =
      run_scarp("$SCARP compare " + scene_ + " -o " + out + " --eyes 2 --heights 2,300 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json result = json::parse(run.output);
  std::set<std::string> defaults;
  for (const json& setting : result["settings"]) {
    if (setting["default"]) defaults.insert(setting["method"]);
    EXPECT_GT(setting["seconds"], 0);
    EXPECT_GT(setting["bytes_per_triangle"], 0);
    ASSERT_EQ(setting["heights"].size(), 2U);
    for (const json& c : setting["heights"]) {
      EXPECT_EQ(c["triangles"], 2 * result["triangles"].get<int>());
      EXPECT_EQ(c["hidden"],
                result["settings"][0]["heights"][c["eye_height_m"] == 2 ? 0 : 1]["hidden"]);
      if (setting["method"] == "certified") {
        EXPECT_EQ(c["falsely_culled"], 0);
        EXPECT_LE(c["culled"], c["in_hidden_groups"]);
      }
    }
  }
  EXPECT_EQ(defaults, (std::set<std::string>{"certified", "thesis"}));
  EXPECT_GE(result["settings"].size(), 10U);
  EXPECT_TRUE(result["left_out"].empty());

  const std::string csv = read_text(out + "/compare.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'),
            static_cast<std::ptrdiff_t>(1 + 2 * result["settings"].size()));
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    // Labels are quoted and hold at most one comma more.
    const auto commas = std::count(line.begin(), line.end(), ',');
    EXPECT_TRUE(commas == 18 || (commas == 19 && line.find("fans, ") != std::string::npos)) << line;
  }
  CPLXMLNode* svg = CPLParseXMLString(read_text(out + "/compare.svg").c_str());
  ASSERT_NE(svg, nullptr);
  EXPECT_STREQ(svg->pszValue, "svg");
  CPLDestroyXMLNode(svg);
}

TEST_F(CompareCommand, LeavesOutWhatDoesNotFitIntoTheTimeAndSaysSo) {
  const std::string out = folder_->path("hasty");
  const RunResult run = run_scarp("$SCARP compare " + scene_ + " -o " + out +
                                  " --eyes 1 --heights 2 --time 0.05s --json");
  if (run.exit_code == 0) {
    EXPECT_FALSE(json::parse(run.output)["left_out"].empty());
  } else {
    EXPECT_NE(run.errors.find("no setting fits"), std::string::npos) << run.errors;
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST_F(CompareCommand, RefusalsAreOneLineAndLeaveNothingBehind) {
  const std::string taken = folder_->path("taken");
  std::filesystem::create_directory(taken);
  std::ofstream(taken + "/compare.csv") << "mine";
  struct Refusal {
    std::string arguments;
    int exit_code;
    std::string says;
  };
  const Refusal refusals[] = {
      {scene_ + " -o " + taken, 1, "exists already"},
      {scene_ + " -o " + folder_->path("none/deep"), 1, "beside existing ones"},
      {scene_ + " -o " + folder_->path("hills.asc"), 1, "not a folder"},
      {folder_->path("missing") + " -o " + folder_->path("x"), 1, "missing"},
      {scene_ + " -o " + folder_->path("x") + " --time soon", 2, "90s or 5min"},
      {scene_ + " -o " + folder_->path("x") + " --eyes 0", 2, "--eyes"},
  };
  for (const Refusal& refusal : refusals) {
    const RunResult run = run_scarp("$SCARP compare " + refusal.arguments);
    EXPECT_EQ(run.exit_code, refusal.exit_code) << refusal.arguments << '\n' << run.errors;
    EXPECT_NE(run.errors.find(refusal.says), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
    EXPECT_FALSE(std::filesystem::exists(folder_->path("x")));
  }
  EXPECT_EQ(read_text(taken + "/compare.csv"), "mine");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(taken), {}), 1);
}

TEST(ComparePicture, DrawsOnePointAndEscapesWords) {
  PictureComparison picture;
  picture.title = "a < b & c";
  picture.methods.push_back({"one", true, {{1, 16, 0.5, "alpha", "omega", true, false}}});
  const std::string svg = draw_comparison(picture);
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  for (const char* label : {"alpha", "omega"})
    EXPECT_EQ(svg.find(label), svg.rfind(label)) << label;  // each in its own chart only
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace scarp
