#include <fmt/format.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "cli/camera_culling.h"
#include "cli/loaded_scene.h"
#include "cli/scene_culling.h"
#include "cli/sight_line.h"
#include "cli/view_source.h"
#include "tests/cli/tiled_terrain.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::files_of;
using test::run_scarp;
using test::RunResult;

json read_json(const std::string& path) {
  return json::parse(std::ifstream(path));
}

/// Values of a raster, as a type of GDAL's, by the map place of its samples.
template <class Value>
std::map<std::pair<long, long>, Value> values_as(const std::string& path, GDALDataType type) {
  GDALDataset* raster = GDALDataset::Open(path.c_str());
  const int columns = raster->GetRasterXSize(), rows = raster->GetRasterYSize();
  double transform[6];
  raster->GetGeoTransform(transform);
  std::vector<Value> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  EXPECT_EQ(raster->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, values.data(), columns,
                                               rows, type, 0, 0),
            CE_None);
  GDALClose(raster);
  std::map<std::pair<long, long>, Value> by_place;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      by_place[{std::lround(transform[0] + (c + 0.5) * transform[1]),
                std::lround(transform[3] + (r + 0.5) * transform[5])}] =
          values[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(c)];
  return by_place;
}

std::map<std::pair<long, long>, int> values_by_place(const std::string& path) {
  return values_as<int>(path, GDT_Int32);
}

/// Of a raster of floats, to the last bit; NaN has one.
std::map<std::pair<long, long>, std::uint32_t> bits_by_place(const std::string& path) {
  std::map<std::pair<long, long>, std::uint32_t> bits;
  for (const auto& [place, value] : values_as<float>(path, GDT_Float32))
    bits[place] = std::isnan(value) ? ~0U : std::bit_cast<std::uint32_t>(value);
  return bits;
}

class TiledBuild : public test::TiledTerrain {};

TEST_F(TiledBuild, ReportTellsTilesLevelsAndWhatRefinementSaved) {
  const json report = json::parse(built_.output);
  EXPECT_EQ(report["tiles"]["finest"], 6);
  EXPECT_EQ(report["tiles"]["levels"], 3);
  EXPECT_EQ(report["raster"]["known_samples"], report["inputs"][0]["samples"]);
  EXPECT_LE(report["mesh"]["error_over_surface_m"], 6);
  ASSERT_EQ(report["levels"].size(), 2U);
  for (const json& level : report["levels"]) {
    EXPECT_GT(level["triangles"], 0);
    EXPECT_GT(level["above_finest_m"], 0);
  }
  EXPECT_GT(report["refinement"]["saved_of_mesh"], 0.5);
  EXPECT_GT(report["refinement"]["saved_of_seen_ground"], 0);
  EXPECT_GT(report["bytes_read"], 0);
  EXPECT_GT(report["bytes_written"], 0);
  EXPECT_GT(report["peak_memory_bytes"], 1 << 20);
  const json scene = read_json(scene_ + "/scene.json");
  EXPECT_EQ(scene["tiles"].size(), 6U + 2 + 1);
  EXPECT_FALSE(fs::exists(scene_ + "/work"));
}

TEST_F(TiledBuild, ReportJudgesBlocksOfTiles) {
  const json report = json::parse(built_.output);
  EXPECT_GE(report["verified_tiles"], 3 * 4);
  EXPECT_LE(report["verified_tiles"], 3 * 9);
  ASSERT_EQ(report["verify"].size(), 2U);
  for (const json& row : report["verify"]) {
    EXPECT_EQ(row["eyes"], 3);
    EXPECT_GT(row["triangles"], 1000);
    EXPECT_GE(row["in_hidden_groups"], row["culled"]);
    EXPECT_EQ(row["falsely_culled"], 0);
  }
}

TEST_F(TiledBuild, AnObserverWithoutGroundIsSaidBeforeTheLongWork) {
  const RunResult run = run_scarp("$SCARP build " + dem_ + " -o " + folder_->path("void.scene") +
                                  " --tile-samples 64 --fans 32 --observer=402415,5197885,5000asl");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.errors.find("no ground is known there"), std::string::npos) << run.errors;
  EXPECT_FALSE(fs::exists(folder_->path("void.scene")));
}

TEST_F(TiledBuild, CullsNothingThatIsSeen) {
  const RunResult run =
      run_scarp("$SCARP verify " + scene_ + " --eyes 3 --heights 2 --seed 5 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  for (const json& row : json::parse(run.output)) {
    EXPECT_EQ(row["falsely_culled"], 0);
    EXPECT_GT(row["culled"], 0);
    EXPECT_GT(row["hidden"], row["culled"]);
  }
}

TEST_F(TiledBuild, GroupsLayerIsTheGroupsOfTheScene) {
  GDALDataset* groups = GDALDataset::Open((scene_ + "/layers/groups.tif").c_str());
  ASSERT_NE(groups, nullptr);
  EXPECT_STREQ(groups->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  std::vector<std::int32_t> values(static_cast<std::size_t>(test::kTiledColumns) *
                                   test::kTiledRows);
  ASSERT_EQ(groups->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, test::kTiledColumns, test::kTiledRows,
                                               values.data(), test::kTiledColumns, test::kTiledRows,
                                               GDT_Int32, 0, 0),
            CE_None);
  GDALClose(groups);
  const json report = read_json(scene_ + "/report.json");
  std::map<std::int32_t, int> samples_of;
  for (const std::int32_t value : values) ++samples_of[value];
  EXPECT_EQ(samples_of[-9999], test::kTiledColumns * test::kTiledRows -
                                   report["raster"]["known_samples"].get<int>() +
                                   report["mesh"]["lost_samples"].get<int>());
  EXPECT_GT(samples_of.rbegin()->first, report["groups"]["groups"].get<std::int32_t>() * 9 / 10);
  EXPECT_LT(samples_of.rbegin()->first, report["groups"]["groups"].get<std::int32_t>());
}

/// Makes the C library leave out what this machine's processor has beyond the oldest one. Scarp's
/// own kernels by instruction set are compared where they are tested.
constexpr char kOldProcessor[] =
    "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX512F,-AVX2,-AVX,-FMA,-FMA4,-SSE4_1 ";

TEST_F(TiledBuild, SameBitsForAnyThreadCountMemoryAndProcessor) {
  const std::string other = folder_->path("other.scene");
  for (const auto& [before, after] : {std::pair{"", "--threads 1 --memory 250M"},
                                      std::pair{kOldProcessor, "--threads 5 --memory 3GiB"}}) {
    ASSERT_EQ(run_scarp(before + build(other) + after + " --overwrite").exit_code, 0) << after;
    EXPECT_EQ(files_of(other), files_of(scene_)) << before << after;
  }
}

TEST_F(TiledBuild, ViewshedsOfTheGridDependOnTheGridOnly) {
  const auto seen_by = [&](const std::string& before, const std::string& dem,
                           const std::string& options) {
    const std::string file = folder_->path("grid.tif");
    const RunResult run =
        run_scarp(before + "$SCARP viewshed " + dem +
                  " --observer=401900,5198200,40 --overwrite -o " + file + options);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return values_by_place(file);
  };
  const auto first = seen_by("", dem_, "");
  EXPECT_GT(std::ranges::count_if(first, [](const auto& at) { return at.second == 1; }), 500);
  EXPECT_EQ(seen_by("", dem_, " --threads 1"), first);
  EXPECT_EQ(seen_by("", dem_, " --threads 7 --memory 300K"), first);
  EXPECT_EQ(seen_by(kOldProcessor, dem_, ""), first);
  const std::string tiled = folder_->path("tiled.tif");
  ASSERT_EQ(run_scarp("gdal_translate -q -co TILED=YES -co BLOCKXSIZE=32 -co BLOCKYSIZE=32 " +
                      dem_ + " " + tiled)
                .exit_code,
            0);
  EXPECT_EQ(seen_by("", tiled, ""), first);
}

TEST_F(TiledBuild, CullReadsTheTilesThatItNeeds) {
  const std::string ask = "$SCARP cull " + scene_ + " --camera=401900,5198200,40 --json";
  const json all = json::parse(run_scarp(ask).output);
  EXPECT_EQ(all["tiles"], 6);
  EXPECT_EQ(all["tiles_read"].get<int>() + all["tiles_hidden"].get<int>(), 6);
  // scene.json, the tree, the meshes around the camera, and the groups of each tile.
  EXPECT_GE(all["files_read"].get<int>(), 3 + all["tiles_read"].get<int>());
  EXPECT_LE(all["files_read"].get<int>(), 6 + all["tiles_read"].get<int>());
  const json near = json::parse(run_scarp(ask + " --max-distance 500").output);
  EXPECT_LE(near["tiles_read"], 4);
  const json east = json::parse(run_scarp(ask + " --azimuth 90 --field-of-view 60").output);
  EXPECT_LT(east["tiles_read"], 6);
  const auto groups = all["visible_groups"].get<std::set<int>>();
  for (const json* part : {&near, &east}) {
    EXPECT_GT((*part)["visible_groups"].size(), 0U);
    EXPECT_LT((*part)["visible_groups"].size(), groups.size());
    for (const int group : (*part)["visible_groups"]) EXPECT_TRUE(groups.contains(group));
  }
}

TEST_F(TiledBuild, TilesThatTheTreeHidesChangeNoAnswer) {
  const LoadedScene whole(scene_, {});
  const auto culling = culling_method(whole, "certified");
  ASSERT_NE(whole.scene.find("0/0/0", "tree"), nullptr);
  std::mt19937_64 random(11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Bounds bounds = bounds_of(whole.tin.vertices);
  std::uint64_t hidden = 0, read = 0;
  constexpr int kCameras = 60;
  for (int i = 0; i < kCameras; ++i) {
    Camera camera{{uniform(bounds.low.x_m - 1000, bounds.high.x_m + 1000),
                   uniform(bounds.low.y_m - 1000, bounds.high.y_m + 1000), 0},
                  {}};
    const double ground_m =
        whole.index.ground_height_m(camera.eye.x_m, camera.eye.y_m).value_or(bounds.low.z_m);
    camera.eye.z_m = ground_m + (i % 2 == 0 ? 2 : uniform(-400, 200));
    SceneTiles tiles(scene_);
    const CullCounts counts = cull_scene(tiles, camera, "", HUGE_VAL);
    const CullingAnswer answer = culling->visible(camera);
    ASSERT_EQ(counts.visible_groups, answer.visible_groups) << i;
    EXPECT_EQ(counts.method, "certified");
    EXPECT_EQ(counts.groups, whole.groups.leaf_count);
    EXPECT_EQ(counts.triangles, whole.tin.triangles.size());
    EXPECT_EQ(tiles.tiles_read() + counts.tiles_hidden, tiles.size());
    EXPECT_EQ(tiles.files_read(), 2 + tiles.tiles_read());
    hidden += counts.tiles_hidden;
    read += tiles.tiles_read();
  }
  EXPECT_GT(hidden, 10U);
  EXPECT_GT(read, 60U);
}

TEST_F(TiledBuild, ViewshedReadsTheTilesThatItReaches) {
  const std::string ask = "$SCARP viewshed " + scene_ + " --observer=401900,5198200,40 --json";
  const std::string near_file = folder_->path("near.tif"), all_file = folder_->path("all.tif");
  const RunResult near_run = run_scarp(ask + " --max-distance 600 -o " + near_file);
  ASSERT_EQ(near_run.exit_code, 0) << near_run.errors;
  const json near = json::parse(near_run.output);
  const json all = json::parse(run_scarp(ask + " -o " + all_file).output);
  EXPECT_EQ(all["tiles_read"], 6);
  EXPECT_LE(near["tiles_read"], 4);
  EXPECT_LT(near["columns"], test::kTiledColumns);
  const auto whole = values_by_place(all_file);
  std::size_t unlike = 0;
  for (const auto& [place, value] : values_by_place(scene_ + "/layers/viewshed.tif"))
    unlike += value != whole.at(place);
  EXPECT_EQ(unlike, 0U);
  int visible = 0;
  for (const auto& [place, value] : values_by_place(near_file)) {
    const double dx = static_cast<double>(place.first - 401'900);
    const double dy = static_cast<double>(place.second - 5'198'200);
    if (std::hypot(dx, dy) > 590) continue;  // beyond the distance nothing is seen
    EXPECT_EQ(value, whole.at(place)) << place.first << " " << place.second;
    visible += value;
  }
  EXPECT_GT(visible, 100);
}

TEST_F(TiledBuild, SamplesOfAPartLieWhereTheyLieInTheWhole) {
  const TypedPosition eye = parse_position("404060,5198300,40");
  const ViewSource whole({scene_}, {}, {}, {});
  const ViewSource part({scene_}, {}, {}, {}, ViewReach{{eye}, "", 150});
  ASSERT_LT(part.tiles_read(), whole.tiles_read());
  const auto offset = [&](std::size_t i) {
    return static_cast<std::int32_t>(
        std::lround((part.dem().geotransform[i] - whole.dem().geotransform[i]) /
                    whole.dem().geotransform[i == 0 ? 1 : 5]));
  };
  const std::int32_t left = offset(0), above = offset(3);
  ASSERT_GT(left, 0);
  const Position at = part.place(eye, "").position;
  EXPECT_EQ(at, whole.place(eye, "").position);
  int compared = 0;
  for (std::int32_t row = 0; row < part.samples().rows(); ++row) {
    for (std::int32_t column = 0; column < part.samples().columns(); ++column) {
      const Position expected = whole.samples().at(left + column, above + row);
      if (std::hypot(expected.x_m - at.x_m, expected.y_m - at.y_m) > 150) continue;
      ASSERT_EQ(part.samples().at(column, row), expected) << column << " " << row;
      ++compared;
    }
  }
  EXPECT_GT(compared, 50);
}

TEST_F(TiledBuild, ViewshedOfAPartIsTheCropOfTheWhole) {
  const std::string eyes = folder_->path("eyes.csv");
  std::ofstream(eyes) << "x,y,height\n403000,5197300,40\n";
  for (const std::string mode : {"visible", "ground"}) {
    const std::string part = folder_->path("part.tif"), whole = folder_->path("whole.tif");
    const std::string ask =
        "$SCARP viewshed " + scene_ + " --overwrite --max-distance 700 --json --mode " + mode;
    const RunResult run = run_scarp(ask + " --observer=403000,5197300,40 -o " + part);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_LT(json::parse(run.output)["tiles_read"], 6);
    // Eyes from a file take the whole raster.
    const RunResult all = run_scarp(ask + " --observers " + eyes + " -o " + whole);
    ASSERT_EQ(all.exit_code, 0) << all.errors;
    EXPECT_EQ(json::parse(all.output)["tiles_read"], 6);
    const auto expected = bits_by_place(whole);
    std::set<std::uint32_t> values;
    for (const auto& [place, bits] : bits_by_place(part)) {
      ASSERT_EQ(bits, expected.at(place)) << mode << " " << place.first << " " << place.second;
      values.insert(bits);
    }
    EXPECT_GT(values.size(), mode == "ground" ? 100U : 1U);
  }
}

TEST_F(TiledBuild, VoidThatTilesCutIsAsUnknownAsInTheWhole) {
  // Over the lake, which goes on beyond the only tile with ground that the eye reaches.
  const std::string eye = "402415,5198155,1500asl", eyes = folder_->path("over.csv");
  std::ofstream(eyes) << "x,y,elevation\n402415,5198155,1500\n";
  for (const std::string mode : {"visible", "ground"}) {
    const std::string part = folder_->path("cut.tif"), whole = folder_->path("uncut.tif");
    const std::string ask =
        "$SCARP viewshed " + scene_ + " --overwrite --max-distance 75 --mode " + mode;
    const RunResult run = run_scarp(ask + " --observer=" + eye + " -o " + part);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const RunResult all = run_scarp(ask + " --observers " + eyes + " -o " + whole);
    ASSERT_EQ(all.exit_code, 0) << all.errors;
    const auto expected = bits_by_place(whole), answer = bits_by_place(part);
    EXPECT_LT(answer.size(), expected.size());
    for (const auto& [place, bits] : answer)
      ASSERT_EQ(bits, expected.at(place)) << mode << " " << place.first << " " << place.second;
    // Ground within reach, all of it unknown.
    if (mode == "visible") {
      EXPECT_EQ(answer.at({402'415, 5'198'215}), std::bit_cast<std::uint32_t>(255.0F));
    }
  }
  const TypedLine line{parse_position(eye), parse_position("402415,5198185,1500asl"), ""};
  for (const auto& surface : {open_surface({scene_}, {}, {}, line), open_surface({scene_}, {}, {})})
    EXPECT_EQ(surface->judge(surface->place(line.from, "").position,
                             surface->place(line.to, "").position),
              Sight::kUnknown);
}

TEST_F(TiledBuild, BorderOfTheRasterOpensNoTilesThatAreNotReached) {
  const RunResult run =
      run_scarp("$SCARP viewshed " + scene_ +
                " --observer=400300,5199700,40 --max-distance 600 --overwrite --json -o " +
                folder_->path("corner.tif"));
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_EQ(json::parse(run.output)["tiles_read"], 1);
}

TEST_F(TiledBuild, SightReadsTheTilesAlongTheLineAndAnswersAsTheWholeScene) {
  const auto whole = open_surface({scene_}, {}, {});
  EXPECT_EQ(whole->tiles_read(), 6U);
  const auto measured = [](const SightSurface& surface, const TypedLine& line) {
    return measure_sight(surface, surface.place(line.from, line.crs),
                         surface.place(line.to, line.crs), 1e9, line.from.text, line.to.text);
  };
  std::mt19937_64 random(7);
  std::size_t read = 0, blocked = 0;
  constexpr std::size_t kLines = 40;
  for (std::size_t i = 0; i < kLines; ++i) {
    const auto end = [&](double height_m) {
      const auto part = [&] { return std::uniform_real_distribution<double>(0.02, 0.98)(random); };
      return parse_position(fmt::format("{},{},{}asl", 400'000 + part() * 30 * test::kTiledColumns,
                                        5'200'000 - part() * 30 * test::kTiledRows, height_m));
    };
    const TypedLine line{end(100 + 60.0 * static_cast<double>(i)), end(1200), ""};
    const auto along = open_surface({scene_}, {}, {}, line);
    const SightLine one = measured(*along, line), all = measured(*whole, line);
    EXPECT_EQ(one.sight, all.sight);
    EXPECT_EQ(one.from.ground_m, all.from.ground_m);
    EXPECT_EQ(one.least_from_m, all.least_from_m);
    EXPECT_EQ(one.least_to_m, all.least_to_m);
    EXPECT_EQ(one.void_at_end, all.void_at_end);
    ASSERT_EQ(one.blocker.has_value(), all.blocker.has_value());
    if (one.blocker) {
      EXPECT_EQ(one.blocker->distance_m, all.blocker->distance_m);
    }
    ASSERT_EQ(one.profile.size(), all.profile.size());
    for (std::size_t k = 0; k < one.profile.size(); ++k) {
      EXPECT_EQ(one.profile[k].ground, all.profile[k].ground);
      EXPECT_EQ(one.profile[k].clearance_m, all.profile[k].clearance_m);
      EXPECT_EQ(one.profile[k].void_before, all.profile[k].void_before);
    }
    read += along->tiles_read();
    blocked += one.blocker.has_value();
  }
  EXPECT_LT(read, 6 * kLines);
  EXPECT_GT(blocked, 5U);
  const RunResult run =
      run_scarp("$SCARP sight " + scene_ + " --from=400700,5199300 --to=401200,5199300 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_EQ(json::parse(run.output)["tiles"], 6);
  EXPECT_EQ(json::parse(run.output)["tiles_read"], 1);
}

TEST_F(TiledBuild, OutlinesAreThoseOfAnExport) {
  const std::string scene = folder_->path("outlined.scene"), out = folder_->path("outlines");
  const RunResult built = run_scarp(build(scene) + "--outlines");
  ASSERT_EQ(built.exit_code, 0) << built.errors;
  auto files = files_of(scene);
  ASSERT_TRUE(files.contains("layers/groups.gpkg"));
  ASSERT_EQ(run_scarp("$SCARP export " + scene_ + " --to gpkg -o " + out).exit_code, 0);
  EXPECT_EQ(files["layers/groups.gpkg"], files_of(out)["groups.gpkg"]);
  files.erase("layers/groups.gpkg");
  EXPECT_EQ(files, files_of(scene_));
  EXPECT_EQ(run_scarp("$SCARP check " + scene).exit_code, 0);
}

TEST_F(TiledBuild, StepsOfAPlanMakeTheSameSceneInAnyOrderThatItAllows) {
  const std::string plan = folder_->path("plan.json"), scene = folder_->path("planned.scene");
  ASSERT_EQ(run_scarp(build(scene) + "--plan " + plan).exit_code, 0);
  EXPECT_FALSE(fs::exists(scene + ".part"));
  const json steps = read_json(plan)["steps"];
  const auto step = [&](std::size_t i) {
    return run_scarp("$SCARP build --plan " + plan + " --step " + std::to_string(i));
  };
  const RunResult early = step(steps.size() - 1);
  EXPECT_EQ(early.exit_code, 2);
  EXPECT_NE(early.errors.find("done before"), std::string::npos) << early.errors;
  // Always the last step that may be done.
  std::set<std::size_t> done;
  while (done.size() < steps.size()) {
    std::size_t next = steps.size();
    while (next-- > 0) {
      if (done.contains(next)) continue;
      const auto after = steps[next]["after"].get<std::vector<std::size_t>>();
      if (std::all_of(after.begin(), after.end(), [&](std::size_t b) { return done.contains(b); }))
        break;
    }
    const RunResult run = step(next);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    if (done.size() % 7 == 0) {
      const RunResult again = step(next);
      EXPECT_EQ(again.exit_code, 0) << again.errors;
      EXPECT_NE(again.output.find("was done already"), std::string::npos) << again.output;
    }
    done.insert(next);
  }
  EXPECT_EQ(files_of(scene), files_of(scene_));
  EXPECT_EQ(step(3).exit_code, 0);
  EXPECT_FALSE(fs::exists(scene + ".part"));
}

TEST_F(TiledBuild, CommandsThatTakeAllOfAScenePayHeedToMemory) {
  const std::string ground = " --from=401900,5198200 --to=402900,5198200";
  for (const std::string& command :
       {"verify " + scene_, "compare " + scene_ + " -o " + folder_->path("never"),
        "fly " + scene_ + " -o " + folder_->path("never"), "sight " + scene_ + ground,
        "viewshed " + scene_ + " --observer=401900,5198200 -o " + folder_->path("never.tif"),
        "preview " + scene_ + " --observer=401900,5198200 -o " + folder_->path("never.png")}) {
    const RunResult run = run_scarp("$SCARP " + command + " --memory 10K");
    EXPECT_EQ(run.exit_code, 1) << command;
    EXPECT_NE(run.errors.find("and --memory allows 0.00 GiB; raise --memory"), std::string::npos)
        << command << "\n"
        << run.errors;
    EXPECT_EQ(std::count(run.errors.begin(), run.errors.end(), '\n'), 1) << run.errors;
  }
  EXPECT_FALSE(fs::exists(folder_->path("never")));
}

TEST_F(TiledBuild, PicturesOfLargeScenesAreOfACoarserLevel) {
  const LoadedScene whole(scene_, {});
  EXPECT_EQ(whole.level, 2);
  EXPECT_TRUE(whole.is_finest);
  EXPECT_EQ(whole.groups.group_of_triangle.size(), whole.tin.triangles.size());
  ScenePart part;
  part.most_triangles = whole.tin.triangles.size() - 1;
  const LoadedScene coarser(scene_, part);
  EXPECT_EQ(coarser.level, 1);
  EXPECT_FALSE(coarser.is_finest);
  EXPECT_LT(coarser.tin.triangles.size(), whole.tin.triangles.size());
  EXPECT_TRUE(coarser.groups.group_of_triangle.empty());
}

TEST_F(TiledBuild, CheckFindsAFlippedBitInAnyFile) {
  for (const auto& [name, checksum] : files_of(scene_)) {
    const std::string path = scene_ + "/" + name;
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto at = static_cast<std::streamoff>(fs::file_size(path) * 3 / 5);
    file.seekg(at);
    const auto byte = static_cast<char>(file.get());
    const auto write = [&](char value) {
      file.seekp(at);
      file.put(value);
      file.flush();
    };
    write(static_cast<char>(byte ^ 4));
    const RunResult run = run_scarp("$SCARP check " + scene_);
    EXPECT_EQ(run.exit_code, 1) << name;
    EXPECT_NE(run.output.find(name), std::string::npos) << name << "\n" << run.output;
    write(byte);
  }
  EXPECT_EQ(run_scarp("$SCARP check " + scene_).exit_code, 0);
}

TEST_F(TiledBuild, WhatTakesOnePieceSaysSo) {
  const RunResult run = run_scarp("$SCARP build " + dem_ + " -o " + folder_->path("one.scene") +
                                  " --vertices 300 --fans 8 --tile-samples 64 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json report = json::parse(run.output);
  EXPECT_EQ(report["tiles"]["finest"], 1);
  ASSERT_EQ(report["warnings"].size(), 1U);
  EXPECT_EQ(report["warnings"][0],
            "--vertices takes all 141 x 118 samples in one piece; leave it out for tiles of "
            "--tile-samples 64");
}

TEST_F(TiledBuild, MemoryThatIsTooSmallIsSaidBeforeTheWork) {
  const std::string scene = folder_->path("small.scene"), large = folder_->path("large.vrt");
  std::ofstream(large) << "<VRTDataset rasterXSize='20000' rasterYSize='20000'>"
                          "<GeoTransform>4e5, 30, 0, 52e5, 0, -30</GeoTransform>"
                          "<VRTRasterBand dataType='Int16' band='1'/></VRTDataset>";
  const std::string build = "$SCARP build " + large + " -o " + scene + " --memory 600M ";
  const RunResult run = run_scarp(build + "--tile-samples 4096");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.errors.find("give --tile-samples 256"), std::string::npos) << run.errors;
  const RunResult whole = run_scarp(build + "--vertices 500");
  EXPECT_EQ(whole.exit_code, 1);
  EXPECT_NE(whole.errors.find("--vertices, which takes them in one piece"), std::string::npos)
      << whole.errors;
  const RunResult viewshed = run_scarp(build + "--tile-samples 256 --observer=4e5,52e5");
  EXPECT_EQ(viewshed.exit_code, 1);
  EXPECT_NE(viewshed.errors.find("for the viewshed of --observer"), std::string::npos)
      << viewshed.errors;
  EXPECT_FALSE(fs::exists(scene + ".part"));
}

}  // namespace
}  // namespace scarp
