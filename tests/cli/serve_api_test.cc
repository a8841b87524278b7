#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "cli/serve/json_schema.h"
#include "tests/cli/served_terrain.h"
#include "tests/support/run_scarp.h"

/// What the server answers is what the command line answers.
namespace scarp {
namespace {

using nlohmann::json;
using test::HttpAnswer;
using test::HttpConnection;
using test::run_scarp;
using test::RunResult;
using test::ServedTerrain;
using test::TempFolder;
using test::TestServer;

std::string read_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

json inputs_of(const std::string& text) {
  return {{"inputs", json::parse(text)}};
}

class ServeApi : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = std::make_unique<TestServer>(); }
  static void TearDownTestSuite() { server_.reset(); }

  static HttpAnswer execute(const std::string& process, const json& body,
                            const std::string& headers = "") {
    return server_->post("/processes/" + process + "/execution", body.dump(), headers);
  }
  static json result(const std::string& process, const std::string& inputs) {
    const HttpAnswer answer = execute(process, inputs_of(inputs));
    EXPECT_EQ(answer.status, 200) << answer.body;
    return answer.status == 200 ? json::parse(answer.body) : json();
  }
  static json get_json(const std::string& target) {
    const HttpAnswer answer = server_->get(target);
    EXPECT_EQ(answer.status, 200) << target << answer.body;
    return answer.status == 200 ? json::parse(answer.body) : json();
  }

  static std::unique_ptr<TestServer> server_;
};
std::unique_ptr<TestServer> ServeApi::server_;

TEST_F(ServeApi, ViewshedIsTheCommandLinesBitForBit) {
  struct Case {
    const char* source;
    const char* inputs;
    const char* options;
  };
  const TempFolder folder;
  const std::string dem = ServedTerrain::get().dem(), scene = ServedTerrain::get().scene();
  for (
      const Case& c : {
          Case{"alps", R"("observers":["8.65,46.55"])", "--observer=8.65,46.55"},
          Case{
              "alps",
              R"("observers":["8.65,46.55,20",[8.69,46.57,5]],"max_distance_m":4000,"azimuth":[300,100],
                   "target_height_m":3,"min_distance_m":200,"pitch":[-30,10])",
              "--observer=8.65,46.55,20 --observer=8.69,46.57,5 --max-distance 4000 --azimuth "
              "300,100 --target-height 3 --min-distance 200 --pitch=-30,10"},
          Case{"alps", R"("observers":["8.65,46.55,20","8.69,46.57,2500asl"],"mode":"count")",
               "--observer=8.65,46.55,20 --observer=8.69,46.57,2500asl --mode count"},
          Case{"alps", R"("observers":["8.65,46.55"],"mode":"ground","refraction":0.13)",
               "--observer=8.65,46.55 --mode ground --refraction 0.13"},
          Case{"alps", R"("observers":["8.65,46.55"],"mode":"dem","max_distance_m":5000)",
               "--observer=8.65,46.55 --mode dem --max-distance 5000"},
          Case{"valley", R"("observers":["8.65,46.55,30"],"max_distance_m":2000)",
               "--observer=8.65,46.55,30 --max-distance 2000"},
      }) {
    const std::string out = folder.path("own.tif");
    const RunResult own =
        run_scarp("$SCARP viewshed " + (c.source == std::string("alps") ? dem : scene) +
                  " --crs OGC:CRS84 --overwrite -o " + out + " " + c.options);
    ASSERT_EQ(own.exit_code, 0) << own.errors;
    const HttpAnswer served = execute(
        "viewshed", inputs_of("{\"scene\":\"" + std::string(c.source) + "\"," + c.inputs + "}"),
        "Accept: image/tiff\r\n");
    ASSERT_EQ(served.status, 200) << served.body;
    EXPECT_EQ(served.headers.at("content-type"),
              "image/tiff; application=geotiff; profile=cloud-optimized");
    EXPECT_TRUE(served.body == read_file(out)) << c.inputs;
  }
}

/// Pixels of a picture, red green blue alpha, by GDAL.
struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};
Pixels pixels_of(const std::string& png) {
  GDALAllRegister();
  std::string copy = png;
  VSIFCloseL(VSIFileFromMemBuffer("/vsimem/served.png", reinterpret_cast<GByte*>(copy.data()),
                                  copy.size(), FALSE));
  const GDALDatasetUniquePtr file(GDALDataset::Open("/vsimem/served.png", GDAL_OF_RASTER));
  Pixels pixels;
  if (!file) return pixels;
  pixels.width = file->GetRasterXSize();
  pixels.height = file->GetRasterYSize();
  const auto count = static_cast<std::size_t>(pixels.width * pixels.height);
  pixels.rgba.assign(4 * count, 255);
  std::vector<std::uint8_t> band(count);
  for (int b = 0; b < file->GetRasterCount(); ++b) {
    EXPECT_EQ(file->GetRasterBand(b + 1)->RasterIO(GF_Read, 0, 0, pixels.width, pixels.height,
                                                   band.data(), pixels.width, pixels.height,
                                                   GDT_Byte, 0, 0),
              CE_None);
    const GDALColorTable* colours = file->GetRasterBand(b + 1)->GetColorTable();
    for (std::size_t i = 0; i < count; ++i) {
      if (!colours) {
        pixels.rgba[4 * i + static_cast<std::size_t>(b)] = band[i];
        continue;
      }
      const GDALColorEntry* c = colours->GetColorEntry(band[i]);
      const short own[] = {c->c1, c->c2, c->c3, c->c4};
      for (std::size_t k = 0; k < 4; ++k)
        pixels.rgba[4 * i + k] = static_cast<std::uint8_t>(own[k]);
    }
  }
  return pixels;
}

TEST_F(ServeApi, PictureShowsTheNearestCellEverywhere) {
  const HttpAnswer picture =
      server_->get("/scenes/alps/viewshed.png?observer=8.65,46.55,20&max_distance_m=5000");
  ASSERT_EQ(picture.status, 200) << picture.body;
  const HttpAnswer raster =
      server_->get("/scenes/alps/viewshed.tif?observer=8.65,46.55,20&max_distance_m=5000");
  ASSERT_EQ(raster.status, 200);
  const Pixels pixels = pixels_of(picture.body);
  ASSERT_GT(pixels.width, 80);
  double west, south, east, north;
  ASSERT_EQ(std::sscanf(picture.headers.at("x-scarp-bounds").c_str(), "%lf,%lf,%lf,%lf", &west,
                        &south, &east, &north),
            4);
  std::string copy = raster.body;
  VSIFCloseL(VSIFileFromMemBuffer("/vsimem/served.tif", reinterpret_cast<GByte*>(copy.data()),
                                  copy.size(), FALSE));
  const GDALDatasetUniquePtr file(GDALDataset::Open("/vsimem/served.tif", GDAL_OF_RASTER));
  ASSERT_TRUE(file);
  const int columns = file->GetRasterXSize(), rows = file->GetRasterYSize();
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(columns * rows));
  ASSERT_EQ(file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns, rows, seen.data(), columns,
                                             rows, GDT_Byte, 0, 0),
            CE_None);
  double transform[6];
  file->GetGeoTransform(transform);
  OGRSpatialReference mercator, data(*file->GetSpatialRef()), lon_lat;
  mercator.SetFromUserInput("EPSG:3857");
  lon_lat.SetFromUserInput("OGC:CRS84");
  for (OGRSpatialReference* crs : {&mercator, &data, &lon_lat})
    crs->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_data(
      OGRCreateCoordinateTransformation(&mercator, &data));
  const std::unique_ptr<OGRCoordinateTransformation> to_mercator(
      OGRCreateCoordinateTransformation(&lon_lat, &mercator));
  ASSERT_TRUE(to_mercator->Transform(1, &west, &north) && to_mercator->Transform(1, &east, &south));
  int visible = 0, compared = 0;
  for (int py = 0; py < pixels.height; ++py) {
    for (int px = 0; px < pixels.width; ++px) {
      double x = west + (east - west) * (px + 0.5) / pixels.width;
      double y = north + (south - north) * (py + 0.5) / pixels.height;
      ASSERT_TRUE(to_data->Transform(1, &x, &y));
      const double column = (x - transform[0]) / transform[1],
                   row = (y - transform[3]) / transform[5];
      const double to_edge =
          std::min(std::abs(column - std::round(column)), std::abs(row - std::round(row)));
      if (to_edge < 0.02) continue;  // as near as the map is
      const bool inside = column > 0 && row > 0 && column < columns && row < rows;
      const bool is_seen =
          inside && seen[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                         static_cast<std::size_t>(column)] == 1;
      const auto i = 4 * static_cast<std::size_t>(py * pixels.width + px);
      ASSERT_EQ(pixels.rgba[i + 3] > 0, is_seen) << px << "," << py;
      visible += is_seen;
      ++compared;
    }
  }
  EXPECT_GT(visible, 200);
  EXPECT_GT(compared, pixels.width * pixels.height * 9 / 10);
  EXPECT_EQ(picture.headers.at("x-scarp-visible-cells"),
            std::to_string(std::count(seen.begin(), seen.end(), 1)));
}

TEST_F(ServeApi, SightLineIsTheCommandLines) {
  const json served = result(
      "line-of-sight",
      R"({"scene":"alps","from":"8.65,46.55,2","to":[8.69,46.57,2],"refraction":0.13,"frequency_hz":5.8e9})");
  const RunResult run =
      run_scarp("$SCARP sight " + ServedTerrain::get().dem() +
                " --crs OGC:CRS84 --from=8.65,46.55,2 --to=8.69,46.57,2 --refraction 0.13 "
                "--frequency 5.8GHz --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json own = json::parse(run.output);
  EXPECT_EQ(served["sight"], own["sight"]);
  EXPECT_EQ(served["visible"], own["sight"] == "visible");
  EXPECT_EQ(served["distance_m"], own["distance_m"]);
  EXPECT_EQ(served["clearance_m"], own["least_clearance"]["clearance_m"]);
  EXPECT_EQ(served["least_eye_height_m"], own["from"]["least_above_ground_m"]);
  EXPECT_EQ(served["least_target_height_m"], own["to"]["least_above_ground_m"]);
  EXPECT_EQ(served["fresnel"]["least_ratio"], own["fresnel"]["least_ratio"]);
  ASSERT_FALSE(served["blocker"].is_null());
  EXPECT_EQ(served["blocker"]["distance_m"], own["first_blocker"]["distance_m"]);
  EXPECT_EQ(served["profile"].size(), own["profile"].size() + 2);
  EXPECT_EQ(served["profile"][1][1], own["profile"][0]["ground_m"]);
}

TEST_F(ServeApi, HorizonIsTheCommandLines) {
  for (const char* name : {"alps", "valley"}) {
    const json served = result(
        "horizon", std::string(R"({"scene":")") + name + R"(","at":"8.65,46.55","azimuths":24})");
    const RunResult run = run_scarp(
        "$SCARP horizon " +
        (name == std::string("alps") ? ServedTerrain::get().dem() : ServedTerrain::get().scene()) +
        " --crs OGC:CRS84 --at=8.65,46.55 --azimuths 24 --json");
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const json own = json::parse(run.output)["horizon"];
    ASSERT_EQ(served["azimuths_deg"].size(), 24U);
    for (std::size_t i = 0; i < 24; ++i) {
      EXPECT_EQ(served["lower_deg"][i], own[i]["elevation_deg"]);
      EXPECT_EQ(served["distance_m"][i], own[i]["distance_m"]);
      EXPECT_EQ(served["points"][i][0], own[i]["longitude_deg"]);
    }
  }
}

TEST_F(ServeApi, CullingIsTheCommandLines) {
  const json served = result(
      "cull",
      R"({"scene":"valley","camera":"8.65,46.55,5","heading_deg":45,"field_of_view_deg":60})");
  const RunResult run = run_scarp("$SCARP cull " + ServedTerrain::get().scene() +
                                  " --camera=8.65,46.55,5 --crs OGC:CRS84 --azimuth 45 "
                                  "--field-of-view 60 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  json own = json::parse(run.output);
  auto visible = own["visible_groups"].get<std::vector<int>>();
  std::sort(visible.begin(), visible.end());
  EXPECT_EQ(served["visible"].get<std::vector<int>>(), visible);
  EXPECT_EQ(served["triangles"]["drawn"], own["drawn"]);
  EXPECT_EQ(served["visible"].size() + served["hidden"].size(), served["groups"]["total"]);
  EXPECT_EQ(served["method"], own["method"]);
  EXPECT_EQ(execute("cull", inputs_of(R"({"scene":"alps","camera":"8.65,46.55"})")).status, 400);
}

TEST_F(ServeApi, OutlinesCoverWhatIsSeen) {
  const HttpAnswer answer =
      server_->get("/scenes/alps/viewshed.geojson?observer=8.65,46.55,20&max_distance_m=3000");
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.headers.at("content-type"), "application/geo+json");
  const json outlines = json::parse(answer.body);
  EXPECT_EQ(outlines["type"], "FeatureCollection");
  ASSERT_GT(outlines["features"].size(), 1U);
  for (const json& feature : outlines["features"]) {
    EXPECT_EQ(feature["properties"]["visible"], 1);
    const json& corner = feature["geometry"]["coordinates"][0][0];
    EXPECT_NEAR(corner[0].get<double>(), 8.65, 0.1);
    EXPECT_NEAR(corner[1].get<double>(), 46.55, 0.1);
  }
}

TEST_F(ServeApi, DocumentTellsNumbersAndWhereTheRestIs) {
  const json document = result(
      "viewshed",
      R"({"scene":"alps","observers":["8.65,46.55,20"],"max_distance_m":4000,"azimuth":[10,200]})");
  EXPECT_GT(document["visible_cells"].get<int>(), 10);
  EXPECT_EQ(document["known_cells"].get<int>(), 140 * 120 - 7 * 9);
  const std::string href = document["href"];
  const std::string start = "http://localhost";
  ASSERT_TRUE(href.starts_with(start)) << href;
  EXPECT_EQ(server_->get(href.substr(start.size())).status, 200) << href;
  for (const json& link : document["links"])
    EXPECT_EQ(server_->get(link["href"].get<std::string>().substr(start.size())).status, 200);
}

TEST_F(ServeApi, TilesAreWhereTheGroundIs) {
  const json tiles = get_json("/scenes/alps/tiles/terrain-rgb.json");
  EXPECT_EQ(tiles["encoding"], "mapbox");
  EXPECT_EQ(tiles["tilejson"], "3.0.0");
  const std::string pattern = tiles["tiles"][0];
  EXPECT_NE(pattern.find("/scenes/alps/tiles/terrain-rgb/{z}/{x}/{y}.png?v="), std::string::npos);
  // The tile of zoom 12 that holds 8.65 E 46.55 N, and the pixel of the place.
  const double n = 4096, fx = (8.65 + 180) / 360 * n;
  const double fy = (1 - std::asinh(std::tan(46.55 * M_PI / 180)) / M_PI) / 2 * n;
  const std::string at = "/12/" + std::to_string(static_cast<int>(fx)) + "/" +
                         std::to_string(static_cast<int>(fy)) + ".png";
  const HttpAnswer tile = server_->get("/scenes/alps/tiles/terrain-rgb" + at);
  ASSERT_EQ(tile.status, 200) << tile.body;
  const Pixels pixels = pixels_of(tile.body);
  ASSERT_EQ(pixels.width, 256);
  const auto px = static_cast<std::size_t>((fx - std::floor(fx)) * 256);
  const auto py = static_cast<std::size_t>((fy - std::floor(fy)) * 256);
  const std::uint8_t* p = &pixels.rgba[4 * (py * 256 + px)];
  const double height_m = -10'000 + (p[0] * 65'536 + p[1] * 256 + p[2]) * 0.1;
  const double ground_m = get_json("/scenes/alps/height?at=8.65,46.55")["ground_m"];
  EXPECT_NEAR(height_m, ground_m, 15);  // a pixel is 26 m wide
  // Known by its tag.
  const std::string etag = tile.headers.at("etag");
  EXPECT_EQ(
      server_->get("/scenes/alps/tiles/terrain-rgb" + at, "If-None-Match: " + etag + "\r\n").status,
      304);
  EXPECT_EQ(server_->get("/scenes/alps/tiles/hillshade" + at).status, 200);
  EXPECT_EQ(server_->get("/scenes/valley/tiles/groups" + at).status, 200);
  EXPECT_EQ(server_->get("/scenes/alps/tiles/groups" + at).status, 404);
  EXPECT_EQ(server_->get("/scenes/alps/tiles/viewshed" + at + "?observer=8.65,46.55").status, 200);
  EXPECT_EQ(server_->get("/scenes/alps/tiles/viewshed" + at).status, 400);
  const std::string ogc = "/collections/alps/map/tiles/WebMercatorQuad/12/" +
                          std::to_string(static_cast<int>(fy)) + "/" +
                          std::to_string(static_cast<int>(fx));
  EXPECT_EQ(get_json("/collections")["collections"][1]["id"], "valley");
  EXPECT_EQ(get_json("/collections/alps/map/tiles")["tilesets"][0]["dataType"], "map");
  EXPECT_EQ(server_->get(ogc).body, server_->get("/scenes/alps/tiles/hillshade" + at).body);
  for (const char* bad : {"/12/4096/1.png", "/12/-1/1.png", "/99/0/0.png", "/1/0/a.png",
                          "/0/0/0.jpg", "/12/1e3/1.png", "/99999999999999999999/0/0.png"})
    EXPECT_EQ(server_->get(std::string("/scenes/alps/tiles/hillshade") + bad).status, 404) << bad;
  // Far from the data all is transparent.
  const Pixels empty = pixels_of(server_->get("/scenes/alps/tiles/hillshade/5/1/1.png").body);
  for (std::size_t i = 3; i < empty.rgba.size(); i += 4) ASSERT_EQ(empty.rgba[i], 0);
}

TEST_F(ServeApi, NumbersOfGroupsAreWhereTheirColoursAre) {
  const json scene = get_json("/scenes/valley");
  EXPECT_EQ(scene["file"], "valley.scene");
  EXPECT_EQ(get_json("/scenes/alps")["file"], "alps.tif");
  const std::string at = "/11/1073/724.png";
  EXPECT_EQ(server_->get("/scenes/alps/tiles/group-ids" + at).status, 404);
  const Pixels numbers = pixels_of(server_->get("/scenes/valley/tiles/group-ids" + at).body);
  const Pixels colours = pixels_of(server_->get("/scenes/valley/tiles/groups" + at).body);
  ASSERT_EQ(numbers.rgba.size(), colours.rgba.size());
  std::map<std::uint32_t, std::map<std::uint32_t, int>> colours_of;
  for (std::size_t i = 0; i < numbers.rgba.size(); i += 4) {
    const std::uint8_t *n = &numbers.rgba[i], *c = &colours.rgba[i];
    ASSERT_EQ(n[3] != 0, c[3] != 0) << i / 4;
    if (n[3] == 0) continue;
    ++colours_of[65'536U * n[0] + 256U * n[1] + n[2]][65'536U * c[0] + 256U * c[1] + c[2]];
  }
  EXPECT_GT(colours_of.size(), 3U);
  for (const auto& [number, counts] : colours_of) {
    EXPECT_TRUE(number == 0xFFFFFF || number < scene["groups"].get<std::uint32_t>()) << number;
    EXPECT_LE(counts.size(), 2U) << "a colour, and a darker one along the border, of " << number;
  }
}

TEST_F(ServeApi, HeightIsThatOfTheGround) {
  EXPECT_TRUE(get_json("/scenes/alps/height?at=0,0")["ground_m"].is_null());
  for (const char* bad : {"", "?at=", "?at=1", "?at=a,b", "?at=nan,nan", "?at=1e999,2", "?at=8,91",
                          "?at=1,2&at=1,2", "?at=1,2&more=3", "?at=1,2,3,4"})
    EXPECT_EQ(server_->get(std::string("/scenes/alps/height") + bad).status, 400) << bad;
}

TEST_F(ServeApi, BadInputsAreRefusedWithTheReason) {
  for (
      const std::string inputs :
      {R"({"inputs":{}})",
       R"({"inputs":{"scene":"alps"}})",
       R"({"inputs":{"scene":"nowhere","observers":["8.65,46.55"]}})",
       R"({"inputs":{"scene":"../alps","observers":["8.65,46.55"]}})",
       R"({"inputs":{"scene":"alps","observers":[]}})",
       R"({"inputs":{"scene":"alps","observers":"8.65,46.55"}})",
       R"({"inputs":{"scene":"alps","observers":["8.65"]}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55,1e400"]}})",
       R"({"inputs":{"scene":"alps","observers":["nan,inf"]}})",
       R"({"inputs":{"scene":"alps","observers":[[8.65]]}})",
       R"({"inputs":{"scene":"alps","observers":[[8.65,46.55,1,2]]}})",
       R"({"inputs":{"scene":"alps","observers":["0,0"]}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"max_distance_m":-1}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"max_distance_m":1e12}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"max_distance_m":NaN}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"max_distance_m":5,"min_distance_m":9}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"refraction":2}})",
       R"({"inputs":{"scene":"valley","observers":["8.65,46.55"],"refraction":0.5}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"pitch":[10,-10]}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"mode":"all"}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"],"more":1}})",
       R"({"inputs":{"scene":"alps","observers":["8.65,46.55"]},"outputs":{"other":{}}})",
       R"([])",
       R"("x")",
       R"(null)",
       R"(12)",
       "",
       "{",
       R"({"inputs":[]})",
       R"({"inputs":null})",
       R"({"inputs":{"scene":{"value":{"value":1}},"observers":["8.65,46.55"]}})"}) {
    const HttpAnswer answer = server_->post("/processes/viewshed/execution", inputs);
    EXPECT_EQ(answer.status, 400) << inputs << answer.body;
    EXPECT_EQ(answer.headers.at("content-type"), "application/problem+json");
  }
  std::string many = R"({"inputs":{"scene":"alps","observers":[)";
  for (int i = 0; i < 33; ++i) many += (i ? "," : "") + std::string("\"8.65,46.55\"");
  EXPECT_EQ(server_->post("/processes/viewshed/execution", many + "]}}").status, 400);
  EXPECT_EQ(
      server_->post("/processes/echo/execution", "{\"inputs\":" + std::string(5000, '[')).status,
      400);
  EXPECT_EQ(result("line-of-sight", R"({"scene":"alps","from":"8.65,46.55","to":"8.66,46.56"})")
                .contains("visible"),
            true);
  EXPECT_EQ(execute("line-of-sight",
                    inputs_of(R"({"scene":"alps","from":"8.65,46.55","to":"8.65,46.55"})"))
                .status,
            400);
}

TEST_F(ServeApi, FormatsAreNegotiated) {
  const json body =
      inputs_of(R"({"scene":"alps","observers":["8.65,46.55"],"max_distance_m":1000})");
  EXPECT_EQ(execute("viewshed", body).headers.at("content-type"), "application/json");
  EXPECT_EQ(execute("viewshed", body, "Accept: text/html;q=1, image/*;q=0.5\r\n")
                .headers.at("content-type"),
            "image/png");
  EXPECT_EQ(execute("viewshed", body, "Accept: text/html\r\n").status, 406);
  json named = body;
  named["outputs"]["viewshed"]["format"]["mediaType"] = "image/tiff";
  EXPECT_EQ(
      execute("viewshed", named, "Accept: image/png\r\n").headers.at("content-type").substr(0, 10),
      "image/tiff");
  named["outputs"]["viewshed"]["format"]["mediaType"] = "image/webp";
  EXPECT_EQ(execute("viewshed", named).status, 400);
  json document = body;
  document["response"] = "document";
  EXPECT_TRUE(
      json::parse(execute("viewshed", document).body)["viewshed"]["value"].contains("href"));
  document["outputs"]["viewshed"]["format"]["mediaType"] = "image/png";
  const json value = json::parse(execute("viewshed", document).body)["viewshed"];
  EXPECT_EQ(value["mediaType"], "image/png");
  EXPECT_EQ(value["value"].get<std::string>().substr(0, 8), "iVBORw0K");  // a PNG's signature
  EXPECT_EQ(execute("echo", {{"inputs", {{"a", {1, 2}}}}}).body, "{\"a\":[1,2]}\n");
}

TEST_F(ServeApi, JobsRunToTheirResults) {
  const json body = inputs_of(R"({"scene":"alps","observers":["8.65,46.55,7"]})");
  const HttpAnswer begun =
      execute("viewshed", body, "Prefer: respond-async\r\nAccept: image/tiff\r\n");
  ASSERT_EQ(begun.status, 201) << begun.body;
  const json info = json::parse(begun.body);
  EXPECT_EQ(info["processID"], "viewshed");
  EXPECT_EQ(info["type"], "process");
  const std::string place = begun.headers.at("location").substr(std::strlen("http://localhost"));
  EXPECT_EQ(place, "/jobs/" + info["jobID"].get<std::string>());
  json status;
  for (int i = 0; i < 400; ++i) {
    status = get_json(place);
    if (status["status"] != "accepted" && status["status"] != "running") break;
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  }
  ASSERT_EQ(status["status"], "successful") << status;
  EXPECT_EQ(status["progress"], 100);
  const HttpAnswer job_result = server_->get(place + "/results");
  EXPECT_EQ(job_result.status, 200);
  EXPECT_EQ(job_result.body, execute("viewshed", body, "Accept: image/tiff\r\n").body);
  bool listed = false;
  const json jobs = get_json("/jobs");
  for (const json& job : jobs["jobs"]) listed |= job["jobID"] == info["jobID"];
  EXPECT_TRUE(listed);
  HttpConnection dismissing(server_->port());
  dismissing.send("DELETE " + place + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(json::parse(dismissing.receive().body)["status"], "dismissed");
  const HttpAnswer gone = server_->get(place);
  EXPECT_EQ(gone.status, 404);
  EXPECT_EQ(json::parse(gone.body)["type"],
            "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-job");
  EXPECT_EQ(json::parse(server_->get("/processes/none").body)["type"],
            "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-process");
  // What goes wrong later is kept for who asks.
  const HttpAnswer failing =
      execute("viewshed", inputs_of(R"({"scene":"alps","observers":["0,0"]})"),
              "Prefer: respond-async\r\n");
  ASSERT_EQ(failing.status, 201);
  const std::string own = "/jobs/" + json::parse(failing.body)["jobID"].get<std::string>();
  HttpAnswer results;
  for (int i = 0; i < 400; ++i) {
    results = server_->get(own + "/results");
    if (results.status != 404) break;
    EXPECT_EQ(json::parse(results.body)["type"],
              "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/result-not-ready");
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  }
  EXPECT_EQ(results.status, 400) << results.body;
  EXPECT_EQ(get_json(own)["status"], "failed");
}

/// All schemas in a JSON text, wherever they are.
void visit_schemas(const json& value, const std::function<void(const json&)>& visit) {
  if (value.is_object() && value.contains("schema")) visit(value["schema"]);
  if (value.is_structured())
    for (const auto& member : value) visit_schemas(member, visit);
}

TEST_F(ServeApi, PublishedSchemasAreThoseThatAreChecked) {
  const std::function<void(const json&)> check = [&](const json& schema) {
    ASSERT_TRUE(schema.is_object()) << schema;
    for (const auto& [keyword, value] : schema.items()) {
      if (keyword == "properties") {
        for (const auto& own : value) check(own);
      } else if (keyword == "items" || (keyword == "additionalProperties" && value.is_object())) {
        check(value);
      } else if (keyword == "oneOf" || keyword == "anyOf") {
        for (const auto& own : value) check(own);
      } else {
        EXPECT_TRUE(is_checked_keyword(keyword)) << keyword << " in " << schema;
      }
    }
  };
  const json processes = get_json("/processes");
  EXPECT_EQ(processes["processes"].size(), 5U);
  for (const json& process : processes["processes"]) {
    const json description = get_json("/processes/" + process["id"].get<std::string>());
    visit_schemas(description["inputs"], check);
  }
}

TEST_F(ServeApi, OpenApiNamesEveryRoute) {
  const HttpAnswer answer = server_->get("/api");
  ASSERT_EQ(answer.headers.at("content-type"), "application/vnd.oai.openapi+json;version=3.0");
  const json api = json::parse(answer.body);
  EXPECT_EQ(api["openapi"], "3.0.3");
  std::set<std::string> ids;
  for (const auto& [path, operations] : api["paths"].items()) {
    EXPECT_EQ(path.find('+'), std::string::npos);
    for (const auto& [method, operation] : operations.items()) {
      EXPECT_TRUE(ids.insert(operation["operationId"].get<std::string>()).second)
          << operation["operationId"];
      EXPECT_TRUE(operation["responses"].contains("default"));
      const auto opening = std::count(path.begin(), path.end(), '{');
      std::int64_t named = 0;
      for (const json& parameter : operation.value("parameters", json::array()))
        named += parameter["in"] == "path";
      EXPECT_EQ(named, opening) << path;
    }
  }
  for (const char* path : {"/", "/health", "/metrics", "/api", "/conformance", "/scenes",
                           "/processes", "/processes/{id}/execution", "/jobs/{id}/results"})
    EXPECT_TRUE(api["paths"].contains(path)) << path;
}

TEST_F(ServeApi, HealthAndMetricsTellHowItIs) {
  EXPECT_EQ(get_json("/health")["status"], "ok");
  const HttpAnswer metrics = server_->get("/metrics");
  EXPECT_EQ(metrics.headers.at("content-type"), "text/plain; version=0.0.4");
  for (const char* name :
       {"scarp_answers_total{route=\"health\",status=\"200\"}", "scarp_open_connections ",
        "scarp_waiting_tasks ", "scarp_tile_cache_bytes ", "process_resident_memory_bytes "})
    EXPECT_NE(metrics.body.find(name), std::string::npos) << name;
  const json landing = json::parse(server_->get("/", "Accept: application/json\r\n").body);
  EXPECT_GE(landing["links"].size(), 5U);
  EXPECT_NE(server_->get("/", "Accept: text/html\r\n").body.find("<html"), std::string::npos);
}

TEST_F(ServeApi, ScenesSayWhatTheyAre) {
  const json scenes = get_json("/scenes")["scenes"];
  ASSERT_EQ(scenes.size(), 2U);
  const json& dem = scenes[0];
  EXPECT_EQ(dem["name"], "alps");
  EXPECT_EQ(dem["kind"], "dem");
  EXPECT_TRUE(dem["groups"].is_null());
  EXPECT_NEAR(dem["cell_m"].get<double>(), 100, 0.2);
  EXPECT_LT(dem["bounds"][0].get<double>(), 8.65);
  EXPECT_GT(dem["bounds"][2].get<double>(), 8.65);
  const json& scene = scenes[1];
  EXPECT_EQ(scene["kind"], "scene");
  EXPECT_GT(scene["groups"].get<int>(), 1);
  EXPECT_EQ(get_json("/scenes/valley"), scene);
  const json files = get_json("/scenes/valley/files");
  EXPECT_GT(files["files"].size(), 4U);
  for (const json& file : files["files"]) {
    const std::string href = file["href"];
    EXPECT_EQ(server_->get(href.substr(std::strlen("http://localhost"))).status, 200) << href;
  }
}

}  // namespace
}  // namespace scarp
