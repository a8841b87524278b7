#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/cli/written_dem.h"
#include "tests/support/fractal_ground.h"
#include "tests/support/glb_reader.h"
#include "tests/support/netcdf_reader.h"
#include "tests/support/run_scarp.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::read_glb_file;
using test::ReadGlb;
using test::run_scarp;
using test::RunResult;

/// Mountains in UTM 32, 30 m; 150 x 130 samples make 3 x 3 tiles of 64 cells on three levels.
constexpr int kColumns = 150, kRows = 130;
constexpr double kLeft = 400'000, kTop = 5'200'000, kCellM = 30;
/// What the heights are moved by: partly below the ellipsoid.
constexpr int kLowerM = 600;

std::vector<std::int16_t> dem_row(int row) {
  std::vector<std::int16_t> heights(kColumns);
  test::FractalGround(7).row(300, 500 + row, heights);
  for (std::int16_t& h : heights) h = static_cast<std::int16_t>(h - kLowerM);
  return heights;
}

std::string write_mountains(const std::string& path, int raised_m = 0) {
  std::vector<std::int16_t> all;
  for (int row = 0; row < kRows; ++row)
    for (const std::int16_t h : dem_row(row))
      all.push_back(static_cast<std::int16_t>(h + raised_m));
  return test::write_dem(
      path, {.columns = kColumns, .rows = kRows, .left = kLeft, .top = kTop, .cell_m = kCellM},
      std::move(all));
}

json read_json(const std::string& path) {
  return json::parse(std::ifstream(path));
}

std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[entry.path().lexically_relative(folder).generic_string()] = bytes.str();
  }
  return files;
}

/// A tile of the finest level by its place in the quadtree.
struct Tile {
  int x, y;
  ReadGlb glb;
};

class Export : public testing::Test {
 protected:
  static constexpr char kQuick[] =
      " --fans 8 --sectors 16 --patch 8 --group-triangles 80 --min-group-triangles 10 ";

  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    const std::string dem = write_mountains(folder_->path("dem.tif"));
    built("$SCARP build " + dem + " -o " + scene() + kQuick + "--max-error 1 --tile-samples 64");
    built("$SCARP build " + dem + " -o " + one_tile() + kQuick + "--max-error 1");
    built("$SCARP export " + scene() + " --to 3dtiles -o " + tileset());
  }
  static void TearDownTestSuite() { delete folder_; }

  static void built(const std::string& command) {
    const RunResult result = run_scarp(command);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  static std::string scene() { return folder_->path("tiled.scene"); }
  static std::string one_tile() { return folder_->path("one.scene"); }
  static std::string tileset() { return folder_->path("tiles"); }

  static std::vector<Tile> finest_tiles(const std::string& folder) {
    const json root = read_json(folder + "/tileset.json")["root"];
    const int level = root["implicitTiling"]["availableLevels"].get<int>() - 1;
    std::vector<Tile> tiles;
    const fs::path finest = fs::path(folder) / "tiles" / std::to_string(level);
    for (const auto& entry : fs::recursive_directory_iterator(finest))
      if (entry.is_regular_file())
        tiles.push_back({std::stoi(entry.path().parent_path().filename()),
                         std::stoi(entry.path().stem()), read_glb_file(entry.path())});
    return tiles;
  }

  static test::TempFolder* folder_;
};
test::TempFolder* Export::folder_ = nullptr;

/// ECEF by the tileset's own words: root transform, node translation, position.
std::array<double, 3> ecef_of(const std::array<double, 16>& m, const std::array<double, 3>& p) {
  std::array<double, 3> out{};
  for (std::size_t row = 0; row < 3; ++row)
    out[row] = m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row];
  return out;
}

/// Every vertex is a sample of the DEM: within a millimetre of where PROJ has that sample.
TEST_F(Export, VerticesLieWhereTheSamplesLieToTheMillimetre) {
  const auto transform =
      read_json(tileset() + "/tileset.json")["root"]["transform"].get<std::array<double, 16>>();
  OGRSpatialReference map, globe;
  map.SetFromUserInput("EPSG:32632");
  map.PromoteTo3D(nullptr);
  map.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  globe.SetFromUserInput("EPSG:4978");
  const std::unique_ptr<OGRCoordinateTransformation> to_map(
      OGRCreateCoordinateTransformation(&globe, &map));
  const std::unique_ptr<OGRCoordinateTransformation> to_globe(
      OGRCreateCoordinateTransformation(&map, &globe));
  ASSERT_TRUE(to_map && to_globe);
  double farthest_m = 0;
  std::size_t vertices = 0;
  for (const Tile& tile : finest_tiles(tileset())) {
    for (std::size_t v = 0; v < tile.glb.positions.size(); ++v, ++vertices) {
      const std::array<double, 3> at = ecef_of(transform, tile.glb.vertex(v));
      double x = at[0], y = at[1], z = at[2];
      ASSERT_TRUE(to_map->Transform(1, &x, &y, &z));
      const double column = std::round((x - kLeft) / kCellM - 0.5);
      const double row = std::round((kTop - y) / kCellM - 0.5);
      x = kLeft + (column + 0.5) * kCellM;
      y = kTop - (row + 0.5) * kCellM;
      z = dem_row(static_cast<int>(row))[static_cast<std::size_t>(column)];
      ASSERT_TRUE(to_globe->Transform(1, &x, &y, &z));
      farthest_m = std::max(farthest_m, std::hypot(at[0] - x, at[1] - y, at[2] - z));
    }
  }
  EXPECT_GT(vertices, 2000U);
  EXPECT_LT(farthest_m, 0.001);
  EXPECT_GT(farthest_m, 1e-5) << "rounding must be there: what is compared?";
}

/// Vertices on the edge of two tiles: the same points in both, to the bit.
TEST_F(Export, TilesOfALevelMeetWithoutCracks) {
  const std::vector<Tile> tiles = finest_tiles(tileset());
  ASSERT_EQ(tiles.size(), 9U);
  std::size_t shared = 0;
  for (const Tile& a : tiles) {
    for (const Tile& b : tiles) {
      const bool are_beside = (a.x + 1 == b.x && a.y == b.y) || (a.x == b.x && a.y + 1 == b.y);
      if (!are_beside) continue;
      // The edge: vertices of a that no vertex of b lies beyond, found by the places both have.
      const auto places = [](const ReadGlb& glb) {
        std::set<std::array<double, 3>> all;
        for (std::size_t v = 0; v < glb.positions.size(); ++v) all.insert(glb.vertex(v));
        return all;
      };
      const auto in_a = places(a.glb), in_b = places(b.glb);
      const auto near_edge = [&](const std::set<std::array<double, 3>>& own,
                                 const std::set<std::array<double, 3>>& other) {
        std::set<std::array<double, 3>> edge;
        for (const auto& p : own)
          for (const auto& q : other)
            if (std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) < 1) edge.insert(p);
        return edge;
      };
      const auto edge_a = near_edge(in_a, in_b), edge_b = near_edge(in_b, in_a);
      EXPECT_EQ(edge_a, edge_b);
      shared += edge_a.size();
    }
  }
  EXPECT_GT(shared, 100U);
}

TEST_F(Export, TilesOfALevelMeetWithTheSameNormals) {
  std::map<std::array<double, 3>, std::array<float, 3>> normals;
  std::size_t met = 0;
  for (const Tile& tile : finest_tiles(tileset())) {
    std::map<std::array<double, 3>, std::array<float, 3>> own;
    for (std::size_t v = 0; v < tile.glb.positions.size(); ++v)
      own[tile.glb.vertex(v)] = tile.glb.normals[v];
    for (const auto& [place, normal] : own) {
      const auto [at, is_new] = normals.try_emplace(place, normal);
      met += !is_new;
      EXPECT_EQ(at->second, normal);
    }
  }
  EXPECT_GT(met, 100U);
}

TEST_F(Export, GroupsAreThoseOfTheScene) {
  const json scene_json = read_json(scene() + "/scene.json");
  std::uint64_t triangles = 0, groups = 0;
  for (const json& tile : scene_json["tiles"]) {
    if (!tile.contains("contents") || tile["contents"]["groups"] == 0) continue;
    triangles += tile["contents"]["triangles"].get<std::uint64_t>();
    groups += tile["contents"]["groups"].get<std::uint64_t>();
  }
  std::map<std::uint32_t, std::uint32_t> sizes;
  std::uint64_t drawn = 0;
  for (const Tile& tile : finest_tiles(tileset())) {
    drawn += tile.glb.corners.size() / 3;
    for (std::size_t row = 0; row < tile.glb.group.size(); ++row) {
      EXPECT_TRUE(sizes.try_emplace(tile.glb.group[row], tile.glb.triangles[row]).second);
      EXPECT_LE(tile.glb.minimum_height_m[row], tile.glb.maximum_height_m[row]);
    }
  }
  EXPECT_EQ(drawn, triangles);
  EXPECT_EQ(sizes.size(), groups);
  EXPECT_EQ(sizes.rbegin()->first, groups - 1);
}

TEST_F(Export, SaysWhatItsHeightsAre) {
  const json tileset_json = read_json(tileset() + "/tileset.json");
  EXPECT_EQ(tileset_json["asset"]["version"], "1.1");
  EXPECT_EQ(tileset_json["asset"]["extras"]["heights"], "taken as ellipsoidal");
  EXPECT_EQ(tileset_json["metadata"]["properties"]["heights"], "taken as ellipsoidal");
  EXPECT_LE(tileset_json["metadata"]["properties"]["positionError"].get<double>(), 0.0005);
}

TEST_F(Export, IsTheSameBytesForAnyThreadsAndMemory) {
  built("$SCARP export " + scene() + " --to 3dtiles -o " + folder_->path("again") +
        " --threads 1 --memory 64MiB");
  EXPECT_EQ(files_of(tileset()), files_of(folder_->path("again")));
}

TEST_F(Export, CompressedHasTheSameVertices) {
  const std::string compressed = folder_->path("compressed");
  built("$SCARP export " + scene() + " --to 3dtiles --compress -o " + compressed);
  const std::vector<Tile> plain = finest_tiles(tileset()), small = finest_tiles(compressed);
  ASSERT_EQ(plain.size(), small.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_TRUE(small[i].glb.is_compressed);
    EXPECT_EQ(plain[i].glb.positions, small[i].glb.positions);
    EXPECT_EQ(plain[i].glb.translation, small[i].glb.translation);
    EXPECT_EQ(plain[i].glb.features, small[i].glb.features);
  }
}

TEST_F(Export, OneTileIsATilesetOfOneTile) {
  const std::string out = folder_->path("one");
  built("$SCARP export " + one_tile() + " --to 3dtiles -o " + out);
  const json root = read_json(out + "/tileset.json")["root"];
  EXPECT_EQ(root["implicitTiling"]["availableLevels"], 1);
  const double error_m =
      read_json(one_tile() + "/report.json")["mesh"]["error_over_surface_m"].get<double>();
  EXPECT_NEAR(root["geometricError"].get<double>(), error_m, error_m * 0.002);
  EXPECT_GE(root["geometricError"].get<double>(), error_m);
}

TEST_F(Export, RefusesInOneLineAndLeavesNothing) {
  const std::string out = folder_->path("refused");
  const RunResult memory =
      run_scarp("$SCARP export " + one_tile() + " --to 3dtiles --memory 1MiB -o " + out);
  EXPECT_EQ(memory.exit_code, 1);
  EXPECT_NE(memory.errors.find("--memory is 1 MiB"), std::string::npos) << memory.errors;
  EXPECT_EQ(run_scarp("$SCARP export " + scene() + " --to obj -o " + out).exit_code, 2);
  EXPECT_EQ(run_scarp("$SCARP export " + scene() + " --to gpkg --compress -o " + out).exit_code, 2);
  const RunResult there = run_scarp("$SCARP export " + scene() + " --to 3dtiles -o " + tileset());
  EXPECT_EQ(there.exit_code, 1);
  EXPECT_NE(there.errors.find("--overwrite"), std::string::npos);
  const std::string flat = folder_->path("flat.scene");
  built("$SCARP build " + folder_->path("dem.tif") + " -o " + flat + kQuick +
        "--max-error 100 --earth flat");
  const RunResult placeless = run_scarp("$SCARP export " + flat + " --to 3dtiles -o " + out);
  EXPECT_EQ(placeless.exit_code, 1);
  EXPECT_NE(placeless.errors.find("no place on the globe"), std::string::npos);
  for (const auto& entry : fs::directory_iterator(folder_->folder()))
    EXPECT_FALSE(entry.path().filename().string().starts_with("refused")) << entry.path();
}

TEST_F(Export, GeoPackageHasTheGroupsOfAllTiles) {
  const std::string out = folder_->path("gpkg");
  built("$SCARP export " + scene() + " --to gpkg -o " + out);
  const GDALDatasetUniquePtr dataset(
      GDALDataset::Open((out + "/groups.gpkg").c_str(), GDAL_OF_VECTOR));
  ASSERT_TRUE(dataset);
  OGRLayer* layer = dataset->GetLayerByName("groups");
  ASSERT_NE(layer, nullptr);
  std::set<std::int64_t> numbers;
  double area_m2 = 0, triangles = 0;
  for (const auto& feature : *layer) {
    EXPECT_TRUE(numbers.insert(feature->GetFieldAsInteger64("group")).second);
    EXPECT_TRUE(feature->GetGeometryRef()->IsValid());
    area_m2 += feature->GetGeometryRef()->toMultiPolygon()->get_Area();
    triangles += feature->GetFieldAsDouble("triangles");
  }
  const double all_m2 = (kColumns - 1) * (kRows - 1) * kCellM * kCellM;
  EXPECT_NEAR(area_m2, all_m2, 1e-6 * all_m2);
  EXPECT_EQ(*numbers.rbegin() + 1, static_cast<std::int64_t>(numbers.size()));
  EXPECT_GT(triangles, 1000);
}

/// By the conventions' own words: what a reader of UGRID looks for, and that it is whole.
TEST_F(Export, UgridIsOneMeshWithItsDatasets) {
  const std::string out = folder_->path("ugrid");
  built("$SCARP export " + scene() + " --to ugrid -o " + out);
  const test::ReadNetcdf file = test::read_netcdf(out + "/mesh.nc");
  EXPECT_EQ(std::get<std::string>(file.attributes.at("Conventions")), "CF-1.8 UGRID-1.0");
  const auto& mesh = file.variables.at("mesh2d");
  EXPECT_EQ(mesh.text("cf_role"), "mesh_topology");
  EXPECT_EQ(mesh.number("topology_dimension"), 2);
  std::istringstream names(mesh.text("node_coordinates"));
  std::string x_name, y_name;
  names >> x_name >> y_name;
  const auto &x = file.variables.at(x_name), &y = file.variables.at(y_name);
  const auto& corners = file.variables.at(mesh.text("face_node_connectivity"));
  EXPECT_EQ(corners.text("cf_role"), "face_node_connectivity");
  EXPECT_EQ(x.text("standard_name"), "projection_x_coordinate");
  ASSERT_EQ(corners.dimensions.size(), 2U);
  EXPECT_EQ(corners.dimensions[0], mesh.text("face_dimension"));
  const auto& crs = file.variables.at(x.text("grid_mapping"));
  EXPECT_EQ(crs.number("epsg"), 32632);
  const auto start = static_cast<std::size_t>(corners.number("start_index"));
  double area_m2 = 0;
  std::set<std::pair<std::size_t, std::size_t>> edges;
  for (std::size_t t = 0; t < corners.values.size() / 3; ++t) {
    std::array<std::size_t, 3> at{};
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = static_cast<std::size_t>(corners.values[3 * t + i]) - start;
      ASSERT_LT(at[i], x.values.size());
    }
    area_m2 += ((x.values[at[1]] - x.values[at[0]]) * (y.values[at[2]] - y.values[at[0]]) -
                (x.values[at[2]] - x.values[at[0]]) * (y.values[at[1]] - y.values[at[0]])) /
               2;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_TRUE(edges.insert({at[i], at[(i + 1) % 3]}).second) << "an edge twice";
  }
  std::size_t border = 0;
  for (const auto& [a, b] : edges) border += !edges.contains({b, a});
  const double all_m2 = (kColumns - 1) * (kRows - 1) * kCellM * kCellM;
  EXPECT_NEAR(area_m2, all_m2, 1e-6 * all_m2);
  EXPECT_LE(border, 2U * (kColumns + kRows)) << "tiles are not joined";
  for (const char* name : {"group", "error", "horizon", "horizon_least"}) {
    const auto& values = file.variables.at(name);
    EXPECT_EQ(values.text("location"), "face");
    EXPECT_EQ(values.text("mesh"), "mesh2d");
    EXPECT_EQ(values.values.size(), corners.values.size() / 3);
  }
  EXPECT_GT(file.variables.at("error").values[0], 0);
  EXPECT_LE(file.variables.at("error").values[0], 1);
}

/// With the DEM at hand the error is each triangle's own: the greatest is the scene's, and samples
/// within a triangle lie no farther from it.
TEST_F(Export, UgridMeasuresEachTriangleAgainstItsDem) {
  const std::string out = folder_->path("ugrid-errors");
  built("$SCARP export " + scene() + " --to ugrid --dem " + folder_->path("dem.tif") + " -o " +
        out);
  const test::ReadNetcdf file = test::read_netcdf(out + "/mesh.nc");
  const std::vector<double>& errors = file.variables.at("error").values;
  const double whole_m =
      read_json(scene() + "/report.json")["mesh"]["error_over_surface_m"].get<double>();
  EXPECT_NEAR(*std::max_element(errors.begin(), errors.end()), whole_m, 1e-6);
  EXPECT_LT(*std::min_element(errors.begin(), errors.end()), whole_m / 2);
  const auto& x = file.variables.at("mesh2d_node_x").values;
  const auto& y = file.variables.at("mesh2d_node_y").values;
  const auto& z = file.variables.at("mesh2d_node_z").values;
  const auto& corners = file.variables.at("mesh2d_face_nodes").values;
  std::size_t compared = 0;
  for (std::size_t t = 0; t < errors.size(); ++t) {
    // The middle of a side that runs along a row over two cells is a sample.
    for (std::size_t i = 0; i < 3; ++i) {
      const auto a = static_cast<std::size_t>(corners[3 * t + i]);
      const auto b = static_cast<std::size_t>(corners[3 * t + (i + 1) % 3]);
      if (std::abs(y[a] - y[b]) > 0.01 || std::abs(std::abs(x[a] - x[b]) - 2 * kCellM) > 0.01)
        continue;
      const auto column = std::lround(((x[a] + x[b]) / 2 - kLeft) / kCellM - 0.5);
      const auto row = static_cast<int>(std::lround((kTop - y[a]) / kCellM - 0.5));
      const double sample_m = dem_row(row)[static_cast<std::size_t>(column)];
      EXPECT_LE(std::abs(sample_m - (z[a] + z[b]) / 2), errors[t] + 0.01);
      ++compared;
    }
  }
  EXPECT_GT(compared, 50U);
  const RunResult other =
      run_scarp("$SCARP export " + one_tile() + " --to ugrid --dem " +
                write_mountains(folder_->path("other.tif"), 1) + " -o " + folder_->path("refused"));
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.errors.find("not those of the scene"), std::string::npos) << other.errors;
}

}  // namespace
}  // namespace scarp
