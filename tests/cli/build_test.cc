#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogrsf_frmts.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/build/budget.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using nlohmann::json;
using test::run_scarp;
using test::RunResult;

json read_json(const std::string& path) {
  return json::parse(std::ifstream(path));
}

std::set<std::string> listing(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

/// What the scenes of these tests are built with: both methods, as coarsely as they can be.
constexpr char kQuick[] = " --max-error 40 --horizon both --fans 8 --patch 2 ";

/// One scene of the Jacksboro fault for all tests that only read it.
class BuiltScene : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    GDALAllRegister();
    folder_ = new test::TempFolder;
    dem_ = test::jacksboro_vrt(folder_->folder().string());
    if (dem_.empty()) return;
    scene_ = folder_->path("a.scene");
    built_ = run_scarp("$SCARP build " + dem_ + " -o " + scene_ + kQuick + "--json");
  }
  static void TearDownTestSuite() { delete folder_; }

  void SetUp() override {
    if (dem_.empty()) GTEST_SKIP() << "left out, python-matplotlib-data is not installed";
    ASSERT_EQ(built_.exit_code, 0) << built_.errors;
  }

  static inline test::TempFolder* folder_ = nullptr;
  static inline std::string dem_, scene_;
  static inline RunResult built_;
};

TEST_F(BuiltScene, ReportTellsWhatWasDone) {
  const json report = read_json(scene_ + "/report.json");
  EXPECT_EQ(report, json::parse(built_.output));
  EXPECT_EQ(report["inputs"][0]["name"], "jacksboro.vrt");
  EXPECT_EQ(report["raster"]["known_samples"], 403 * 344);
  EXPECT_GT(report["mesh"]["vertices"], 1000);
  EXPECT_LE(report["mesh"]["error_over_surface_m"], 40);
  EXPECT_GT(report["groups"]["groups"], 10);
  std::set<std::string> stages;
  for (const json& stage : report["stages"]) {
    stages.insert(stage["name"]);
    EXPECT_GE(stage["seconds"], 0);
    EXPECT_GT(stage["peak_memory_bytes"], 1 << 20);
  }
  EXPECT_EQ(stages, (std::set<std::string>{"read", "mesh", "horizons", "groups", "certify",
                                           "verify", "layers", "preview"}));
  EXPECT_EQ(report["certified"]["fans"], 8);
  EXPECT_LE(report["certified"]["bytes"], 16 * report["mesh"]["triangles"].get<double>());
  ASSERT_EQ(report["verify"].size(), 4U);  // two methods, two heights
  for (const json& row : report["verify"]) {
    EXPECT_GT(row["hidden"], 0);
    EXPECT_LE(row["triangles"], 3 * report["mesh"]["triangles"].get<double>());
    if (row["method"] == "certified") {
      EXPECT_EQ(row["falsely_culled"], 0);
    }
  }
  EXPECT_TRUE(report["versions"].contains("gdal"));
}

TEST_F(BuiltScene, LayersOpenInGdalAndAgreeWithEachOther) {
  GDALDataset* groups = GDALDataset::Open((scene_ + "/layers/groups.tif").c_str());
  ASSERT_NE(groups, nullptr);
  EXPECT_STREQ(groups->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  EXPECT_EQ(groups->GetRasterBand(1)->GetRasterDataType(), GDT_Int32);
  EXPECT_STREQ(groups->GetSpatialRef()->GetAuthorityCode(nullptr), "4326");
  double transform[6];
  groups->GetGeoTransform(transform);
  EXPECT_DOUBLE_EQ(transform[0], -84.41375);
  std::vector<std::int32_t> values(403 * 344);
  ASSERT_EQ(groups->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 403, 344, values.data(), 403, 344,
                                               GDT_Int32, 0, 0),
            CE_None);
  GDALClose(groups);
  const json report = read_json(scene_ + "/report.json");
  const std::int32_t count = report["groups"]["groups"];
  std::map<std::int32_t, int> samples_of;
  for (const std::int32_t value : values) {
    ASSERT_GE(value, -1);  // no void in this DEM: every sample has a triangle
    ASSERT_LT(value, count);
    ++samples_of[value];
  }

  GDALDataset* polygons =
      GDALDataset::Open((scene_ + "/layers/groups.gpkg").c_str(), GDAL_OF_VECTOR);
  ASSERT_NE(polygons, nullptr);
  OGRLayer* layer = polygons->GetLayerByName("groups");
  EXPECT_EQ(layer->GetFeatureCount(), count);
  std::int64_t triangles = 0;
  int inside = 0, outside = 0;
  for (auto& feature : layer) {
    triangles += feature->GetFieldAsInteger64("triangles");
    EXPECT_LT(feature->GetFieldAsDouble("height_min_m"), feature->GetFieldAsDouble("height_max_m"));
    ASSERT_TRUE(feature->GetGeometryRef()->IsValid());
    // A sample that the raster gives to this group lies in the polygon, but for borders.
    const auto group = static_cast<std::int32_t>(feature->GetFieldAsInteger64("group"));
    for (std::size_t i = 0; i < values.size(); i += 997) {
      if (values[i] != group) continue;
      OGRPoint at(transform[0] + (static_cast<double>(i % 403) + 0.5) * transform[1],
                  transform[3] + (static_cast<double>(i / 403) + 0.5) * transform[5]);
      ++(feature->GetGeometryRef()->Distance(&at) < 0.05 * transform[1] ? inside : outside);
    }
  }
  GDALClose(polygons);
  EXPECT_GT(inside, 50);
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(triangles + report["groups"]["orphans"].get<std::int64_t>(),
            report["mesh"]["triangles"].get<std::int64_t>());
}

TEST_F(BuiltScene, ViewshedOfTheHighestPointSeesItself) {
  GDALDataset* viewshed = GDALDataset::Open((scene_ + "/layers/viewshed.tif").c_str());
  ASSERT_NE(viewshed, nullptr);
  std::vector<std::uint8_t> values(403 * 344);
  ASSERT_EQ(viewshed->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 403, 344, values.data(), 403, 344,
                                                 GDT_Byte, 0, 0),
            CE_None);
  const std::string observer = viewshed->GetMetadataItem("OBSERVER");
  double transform[6];
  viewshed->GetGeoTransform(transform);
  GDALClose(viewshed);
  const double x = std::stod(observer), y = std::stod(observer.substr(observer.find(',') + 1));
  const auto column = static_cast<std::size_t>((x - transform[0]) / transform[1]);
  const auto row = static_cast<std::size_t>((y - transform[3]) / transform[5]);
  EXPECT_EQ(values[row * 403 + column], 1);
  const auto visible = std::count(values.begin(), values.end(), 1);
  EXPECT_GT(visible, 1000);
  EXPECT_GT(std::count(values.begin(), values.end(), 0), visible);
}

TEST_F(BuiltScene, SameBitsForAnyThreadCount) {
  const json once = read_json(scene_ + "/scene.json");
  for (const char* threads : {"1", "5"}) {
    const std::string other = folder_->path(std::string("threads") + threads);
    ASSERT_EQ(run_scarp("$SCARP build " + dem_ + " -o " + other + kQuick + "--threads " + threads)
                  .exit_code,
              0);
    const json again = read_json(other + "/scene.json");
    EXPECT_EQ(again["tiles"], once["tiles"]);
    for (const json& layer : again["layers"])
      if (layer["name"] != "report.json") {
        EXPECT_NE(std::find(once["layers"].begin(), once["layers"].end(), layer),
                  once["layers"].end())
            << layer["name"];
      }
  }
}

TEST_F(BuiltScene, VerifyCountsAddUp) {
  const RunResult run =
      run_scarp("$SCARP verify " + scene_ + " --eyes 2 --heights 2,1000 --seed 7 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json counts = json::parse(run.output);
  const std::uint64_t triangles = read_json(scene_ + "/report.json")["mesh"]["triangles"];
  ASSERT_EQ(counts.size(), 4U);
  for (const json& c : counts) {
    EXPECT_EQ(c["method"], &c - &counts[0] < 2 ? "thesis" : "certified");
    if (c["method"] == "certified") {
      EXPECT_EQ(c["falsely_culled"], 0);
      EXPECT_LE(c["culled"], c["in_hidden_groups"]);
      EXPECT_LE(c["bytes_per_triangle"], 16);
      EXPECT_EQ(c["orphans"], 0);
    }
    EXPECT_EQ(c["eyes"], 2);
    EXPECT_EQ(c["triangles"], 2 * triangles);
    EXPECT_LE(c["in_hidden_groups"], c["hidden"]);
    EXPECT_LE(c["falsely_culled"], c["culled"]);
    EXPECT_LE(c["culled"].get<std::uint64_t>(),
              c["in_hidden_groups"].get<std::uint64_t>() +
                  // a group with one false triangle may hold many that are hidden
                  (c["falsely_culled"] == 0 ? 0 : c["hidden"].get<std::uint64_t>()));
    EXPECT_GT(c["hidden"], 0);
  }
  EXPECT_GT(counts[0]["hidden"], counts[1]["hidden"]);  // from higher up more is seen
  EXPECT_EQ(
      run_scarp("$SCARP verify " + scene_ + " --eyes 2 --heights 2,1000 --seed 7 --json").output,
      run.output);
}

TEST_F(BuiltScene, CullAnswersInBothCrsSpellingsAndWithAView) {
  const std::string at = " --camera=-84.2,36.6,50";
  const json all = json::parse(run_scarp("$SCARP cull " + scene_ + at + " --json").output);
  const json named =
      json::parse(run_scarp("$SCARP cull " + scene_ + at + " --crs OGC:CRS84 --json").output);
  EXPECT_EQ(all["visible_groups"], named["visible_groups"]);
  EXPECT_EQ(all["drawn"].get<int>() + all["culled"].get<int>(), all["triangles"].get<int>());
  const json narrow = json::parse(
      run_scarp("$SCARP cull " + scene_ + at + " --azimuth 350 --field-of-view 40 --json").output);
  EXPECT_LT(narrow["visible_groups"].size(), all["visible_groups"].size());
  EXPECT_GT(narrow["visible_groups"].size(), 0U);
  const std::set<int> every = all["visible_groups"].get<std::set<int>>();
  for (const int group : narrow["visible_groups"]) EXPECT_TRUE(every.count(group));
}

TEST_F(BuiltScene, CullTakesCertifiedWhereTheSceneHasItAndRefusesWhatItHasNot) {
  const std::string at = " --camera=-84.2,36.6,2 --json";
  const auto cull = [&](const std::string& scene, const std::string& method) {
    const RunResult run = run_scarp("$SCARP cull " + scene + at + method);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    json answer = run.exit_code == 0 ? json::parse(run.output) : json();
    for (const char* time : {"open_s", "answer_s"}) answer.erase(time);
    return answer;
  };
  EXPECT_EQ(cull(scene_, "")["method"], "certified");
  EXPECT_EQ(cull(scene_, ""), cull(scene_, " --method certified"));
  const json thesis = cull(scene_, " --method thesis");
  EXPECT_EQ(thesis["method"], "thesis");
  EXPECT_NE(thesis["visible_groups"], cull(scene_, "")["visible_groups"]);

  const std::string certified = folder_->path("certified"), stewart = folder_->path("stewart");
  const std::string build = "$SCARP build " + dem_ + " --max-error 200 -o ";
  ASSERT_EQ(run_scarp(build + certified + " --fans 8 --patch 4").exit_code, 0);
  ASSERT_EQ(run_scarp(build + stewart + " --horizon stewart").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(certified + "/tiles/0/0/0.horizon"));
  for (const std::string& scene : {certified, stewart})
    EXPECT_EQ(run_scarp("$SCARP check " + scene).exit_code, 0);
  EXPECT_EQ(cull(certified, "")["method"], "certified");
  EXPECT_EQ(cull(stewart, "")["method"], "thesis");
  for (const auto& [scene, method] :
       {std::pair{certified, "thesis"}, std::pair{stewart, "certified"}}) {
    const RunResult run = run_scarp("$SCARP cull " + scene + at + " --method " + method);
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.errors.find("build it with --horizon both"), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1);
    const json judged =
        json::parse(run_scarp("$SCARP verify " + scene + " --eyes 1 --heights 2 --json").output);
    ASSERT_EQ(judged.size(), 1U);
    EXPECT_NE(judged[0]["method"], method);
  }
}

TEST_F(BuiltScene, WhatABudgetChoosesIsRepeatedByExplicitFlags) {
  const std::string chosen = folder_->path("chosen"), repeated = folder_->path("repeated");
  const std::string build = "$SCARP build " + dem_ + " --max-error 150 --json -o ";
  const RunResult run = run_scarp(build + chosen + " --budget 1s --budget 4B/triangle");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json report = json::parse(run.output), scene = read_json(chosen + "/scene.json");
  EXPECT_LE(report["certified"]["bytes"], 4 * report["mesh"]["triangles"].get<double>());
  EXPECT_EQ(report["certified"]["budget"]["seconds"], 1);
  EXPECT_GT(report["certified"]["budget"]["predicted_s"], 0);
  EXPECT_EQ(report["certified"]["fans"], scene["parameters"]["fans"]);
  const auto flag = [&](const std::string& name) {
    return " --" + name + " " + scene["parameters"][name].dump();
  };
  ASSERT_EQ(run_scarp(build + repeated + flag("fans") + flag("sectors") + flag("patch")).exit_code,
            0);
  const json again = read_json(repeated + "/scene.json");
  EXPECT_EQ(again["tiles"], scene["tiles"]);
  EXPECT_EQ(again["parameters"], scene["parameters"]);
}

TEST_F(BuiltScene, AccuracyIsRecordedChoosesTheSettingsAndNeverLoosensCulling) {
  std::map<std::string, json> scenes;
  for (const std::string accuracy : {"exact", "fast"}) {
    const std::string path = folder_->path("at-" + accuracy);
    const RunResult run = run_scarp("$SCARP build " + dem_ + " -o " + path + " --accuracy " +
                                    accuracy + (accuracy == "exact" ? " --max-error 150" : ""));
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    scenes[accuracy] = read_json(path + "/scene.json")["parameters"];
    EXPECT_EQ(scenes[accuracy]["accuracy"], accuracy);
    EXPECT_EQ(read_json(path + "/report.json")["parameters"]["accuracy"], accuracy);
  }
  EXPECT_EQ(scenes["exact"]["max_error_m"], 150);
  EXPECT_GT(scenes["exact"]["fans"], scenes["fast"]["fans"]);
  const RunResult judged =
      run_scarp("$SCARP verify " + folder_->path("at-fast") + " --eyes 2 --heights 2,300 --json");
  ASSERT_EQ(judged.exit_code, 0) << judged.errors;
  for (const json& counts : json::parse(judged.output)) EXPECT_EQ(counts["falsely_culled"], 0);
}

TEST(Budget, IsKeptToByTheMostFansThatFit) {
  const CertifyCost cost{1, 0.1, 0.5};  // base, each fan, measuring
  for (const double seconds : {7.0, 10.0, 60.0}) {
    const int fans = fans_within(seconds, cost);
    EXPECT_EQ(fans % 8, 0);
    EXPECT_LE(cost.measured_s + cost.at(fans), seconds);
    EXPECT_GT(cost.measured_s + cost.at(fans + 8), kPlannedShare * seconds);
  }
  EXPECT_EQ(fans_within(0.1, cost), kFewestFans);
  EXPECT_EQ(fans_within(1e9, cost), kMostFansOfBudget);
  EXPECT_EQ(fans_within(1, CertifyCost{}), kMostFansOfBudget);
}

TEST_F(BuiltScene, PreviewDrawsPicturesOfTheAskedWidth) {
  for (const std::string option : {"", "--3d", "--observer=-84.2,36.6,300",
                                   "--camera=-84.2,36.4,4000asl --target=-84.2,36.6"}) {
    const std::string picture = folder_->path("p.png");
    const RunResult run = run_scarp("$SCARP preview " + scene_ + " -o " + picture +
                                    " --width 300 --overwrite " + option);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    GDALDataset* image = GDALDataset::Open(picture.c_str());
    ASSERT_NE(image, nullptr) << option;
    EXPECT_EQ(std::max(image->GetRasterXSize(), image->GetRasterYSize()), 300);
    EXPECT_EQ(image->GetRasterCount(), 3);
    GDALClose(image);
  }
}

TEST_F(BuiltScene, CheckFindsAFlippedBitInAnyFile) {
  EXPECT_EQ(run_scarp("$SCARP check " + scene_).exit_code, 0);
  const std::string copy = folder_->path("damaged");
  for (const char* file : {"tiles/0/0/0.tin", "tiles/0/0/0.horizon", "tiles/0/0/0.groups",
                           "layers/groups.tif", "layers/viewshed.tif", "layers/groups.gpkg",
                           "preview.png", "preview-3d.png", "report.json", "scene.json"}) {
    std::filesystem::remove_all(copy);
    std::filesystem::copy(scene_, copy, std::filesystem::copy_options::recursive);
    const std::string path = copy + "/" + file;
    std::fstream stream(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto middle = static_cast<std::streamoff>(std::filesystem::file_size(path) / 2);
    stream.seekg(middle);
    const int byte = stream.get();
    stream.seekp(middle);
    stream.put(static_cast<char>(byte ^ 1));
    stream.close();
    const RunResult run = run_scarp("$SCARP check " + copy);
    EXPECT_EQ(run.exit_code, 1) << file;
    EXPECT_NE(run.output.find(std::filesystem::path(file).filename()), std::string::npos)
        << run.output;
  }
}

TEST_F(BuiltScene, RefusalsAreOneLineAndLeaveNothingBehind) {
  std::ofstream(folder_->path("notes.txt")) << "hello";
  std::filesystem::create_directories(folder_->path("plain folder"));
  std::ofstream(folder_->path("plain folder") + "/keep.txt") << "mine";
  const std::string dem = dem_, f = folder_->folder().string();
  struct Refusal {
    std::string arguments;
    int exit_code;
    std::string says;
  };
  const Refusal refusals[] = {
      {"build " + f + "/missing.tif -o " + f + "/x", 1, "no such file"},
      {"build " + f + "/notes.txt -o " + f + "/x", 1, "a raster that GDAL reads was expected"},
      {"build " + dem + " -o " + scene_, 1, "--overwrite"},
      {"build " + dem + " -o '" + f + "/plain folder' --overwrite", 1, "plain folder"},
      {"build " + dem + " -o " + f + "/nowhere/x", 1, "nowhere"},
      {"build " + dem + " -o " + f + "/x --earth flat", 1, "is in degrees"},
      {"build " + dem + " -o " + f + "/x --refraction 2", 1, "outside [0, 1]"},
      {"build " + dem + " -o " + f + "/x --height-unit fm", 1, "--height-unit fm"},
      {"build " + dem + " -o " + f + "/x --geoid " + f + "/none.gtx", 1, "no such file"},
      {"build " + dem + " -o " + f + "/x --observer 0,0", 1, "no ground is known there"},
      {"build " + dem + " -o " + f + "/x --observer nowhere", 2, "not understood"},
      {"build " + dem + " -o " + f + "/x --memory 1M", 1, "--memory"},
      {"build " + dem + " -o " + f + "/x --memory lots", 2, "not understood"},
      {"build " + dem + " -o " + f + "/x --max-error 1 --vertices 9", 2, "excludes"},
      {"build " + dem + " -o " + f + "/x --max-error -1", 2, "--max-error"},
      {"build " + dem + " -o " + f + "/x --sectors 3", 2, "--sectors"},
      {"build " + dem + " -o " + f + "/x --sectors 12", 2, "give 16"},
      {"build " + dem + " -o " + f + "/x --fans 12", 2, "--fans"},
      {"build " + dem + " -o " + f + "/x --fans 16 --horizon stewart", 2, "--horizon certified"},
      {"build " + dem + " -o " + f + "/x --patch 2 --horizon stewart", 2, "--horizon certified"},
      {"build " + dem + " -o " + f + "/x --subsectors 2", 2, "--horizon stewart"},
      {"build " + dem + " -o " + f + "/x --budget 10", 2, "10s"},
      {"build " + dem + " -o " + f + "/x --budget -1s", 2, "10s"},
      {"build " + dem + " -o " + f + "/x --budget 4B", 2, "4B/triangle"},
      {"build " + dem + " -o " + f + "/x --budget 9s --fans 8", 2, "--fans"},
      {"build " + dem + " -o " + f + "/x --budget 9B/triangle --sectors 8", 2, "--sectors"},
      {"build " + dem + " -o " + f + "/x --budget 9s --horizon stewart", 2, "--budget"},
      {"build " + dem + " -o " + f + "/x --budget 0.1B/triangle --max-error 99", 2,
       "the fewest sectors take"},
      {"build " + dem + " -o " + f + "/x --growth fast", 2, "--growth"},
      {"build " + dem + " -o " + f + "/x --growth breadth-first", 2, "--horizon stewart"},
      {"build " + dem + " -o " + f + "/x --seeds 100", 2, "--growth breadth-first"},
      {"build " + dem + " -o " + f + "/x --max-groups 200", 2, "--growth breadth-first"},
      {"build", 2, "--help"},
      {"frobnicate", 2, "--help"},
      {"cull " + f + "/missing --camera 0,0", 1, "missing"},
      {"cull " + scene_ + " --camera 0,0", 1, "no ground is known there"},
      {"cull " + scene_ + " --camera 0,0,2 --crs EPSG:1", 1, "EPSG:1"},
      {"verify " + dem, 1, "jacksboro.vrt"},
      {"preview " + scene_ + " -o " + f + "/nowhere/p.png", 1, "nowhere"},
  };
  const std::set<std::string> before = listing(folder_->folder());
  for (const Refusal& refusal : refusals) {
    const RunResult run = run_scarp("$SCARP " + refusal.arguments);
    EXPECT_EQ(run.exit_code, refusal.exit_code) << refusal.arguments << "\n" << run.errors;
    EXPECT_NE(run.errors.find(refusal.says), std::string::npos) << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
    EXPECT_EQ(run.output, "") << refusal.arguments;
    EXPECT_EQ(listing(folder_->folder()), before) << refusal.arguments;
  }
}

TEST_F(BuiltScene, FullDiskIsOneLineAndLeavesNothingBehind) {
  // A limit on file sizes fails writes as a full disk does.
  const std::set<std::string> before = listing(folder_->folder());
  const RunResult run = run_scarp("trap '' XFSZ; ulimit -f 40; $SCARP build " + dem_ + " -o " +
                                  folder_->path("x") + kQuick);
  EXPECT_EQ(run.exit_code, 1) << run.errors;
  EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
  EXPECT_EQ(listing(folder_->folder()), before);
}

TEST_F(BuiltScene, GrowthIsRecordedAndGroupsLeaveNoOrphansUnlessPublished) {
  EXPECT_EQ(read_json(scene_ + "/report.json")["groups"]["orphans"], 0);
  EXPECT_EQ(read_json(scene_ + "/scene.json")["parameters"]["growth"], "hidden-together");
  const std::string other = folder_->path("breadth.scene");
  const RunResult run =
      run_scarp("$SCARP build " + dem_ + " -o " + other +
                " --max-error 25 --growth breadth-first --seeds 40 --horizon stewart "
                "--json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_GT(json::parse(run.output)["groups"]["orphans"], 0);
  const json parameters = read_json(other + "/scene.json")["parameters"];
  EXPECT_EQ(parameters["growth"], "breadth-first");
  EXPECT_EQ(parameters["seeds"], 40);
}

TEST_F(BuiltScene, OverwriteReplacesTheScene) {
  const std::string other = folder_->path("b.scene");
  ASSERT_EQ(
      run_scarp("$SCARP build " + dem_ + " -o " + other + " --max-error 200 --fans 8").exit_code,
      0);
  ASSERT_EQ(
      run_scarp("$SCARP build " + dem_ + " -o " + other + " --vertices 500 --fans 8 --overwrite")
          .exit_code,
      0);
  EXPECT_EQ(read_json(other + "/report.json")["mesh"]["vertices"], 500);
  EXPECT_EQ(run_scarp("$SCARP check " + other).exit_code, 0);
}

TEST(CommandLine, HelpAndVersion) {
  EXPECT_EQ(run_scarp("$SCARP --version").output, "scarp " SCARP_VERSION "\n");
  for (const char* command :
       {"build", "cull", "verify", "compare", "preview", "sight", "horizon", "check"}) {
    const RunResult help = run_scarp(std::string("$SCARP ") + command + " --help");
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_NE(help.output.find("Example"), std::string::npos) << command;
    EXPECT_NE(help.output.find("--threads"), std::string::npos) << command;
  }
}

}  // namespace
}  // namespace scarp
