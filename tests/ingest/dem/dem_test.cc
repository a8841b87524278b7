#include "ingest/dem/dem.h"

#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "tests/support/shared_data.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

using test::TempFolder;

/// What a test raster is made of; the defaults are a plain 3 x 2 DEM of 10 m cells in UTM.
struct Raster {
  int columns = 3, rows = 2;
  std::vector<double> values = {1, 2, 3, 4, 5, 6};
  std::string crs = "EPSG:32611";
  std::vector<double> geotransform = {500'000, 10, 0, 4'000'000, 0, -10};
  GDALDataType type = GDT_Float64;
  std::function<void(GDALDataset&)> adjust;
};

std::string write_raster(const std::string& path, const Raster& raster) {
  GDALAllRegister();
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), raster.columns, raster.rows, 1, raster.type, nullptr);
  if (!raster.geotransform.empty())
    dataset->SetGeoTransform(const_cast<double*>(raster.geotransform.data()));
  if (!raster.crs.empty()) {
    OGRSpatialReference crs;
    crs.SetFromUserInput(raster.crs.c_str());
    dataset->SetSpatialRef(&crs);
  }
  if (raster.adjust) raster.adjust(*dataset);
  std::vector<double> values = raster.values;
  EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, raster.columns, raster.rows,
                                                values.data(), raster.columns, raster.rows,
                                                GDT_Float64, 0, 0),
            CE_None);
  GDALClose(dataset);
  return path;
}

Dem read(const std::string& path, const DemOptions& options = {}) {
  return read_dem({path}, options, {});
}

std::string refusal(const std::vector<std::string>& paths, const DemOptions& options = {}) {
  try {
    read_dem(paths, options, {});
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "accepted";
}

TEST(ReadDem, HeightsAndPlacesOfAPlainRaster) {
  const TempFolder folder;
  const Dem dem = read(write_raster(folder.path("a.tif"), {}));
  EXPECT_EQ(dem.columns, 3);
  EXPECT_EQ(dem.rows, 2);
  EXPECT_EQ(dem.heights_m, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(dem.x_of(0), 500'005);
  EXPECT_EQ(dem.y_of(1), 3'999'985);
  EXPECT_EQ(dem.frame->description().earth, Earth::kEllipsoid);
  EXPECT_EQ(dem.sources.at(0).name, "a.tif");
  EXPECT_EQ(dem.sources.at(0).samples, 6U);
}

TEST(ReadDem, VoidByValueByNanByMaskAndByOption) {
  const TempFolder folder;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::uint8_t> expected = {1, 0, 1, 1, 1, 1};
  Raster value;
  value.values[1] = -9999;
  value.adjust = [](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(-9999); };
  EXPECT_EQ(read(write_raster(folder.path("value.tif"), value)).known, expected);
  Raster not_a_number;
  not_a_number.values[1] = nan;
  not_a_number.adjust = [nan](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(nan); };
  EXPECT_EQ(read(write_raster(folder.path("nan.tif"), not_a_number)).known, expected);
  Raster masked;
  masked.adjust = [](GDALDataset& d) {
    CPLSetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
    d.CreateMaskBand(GMF_PER_DATASET);
    std::vector<std::uint8_t> mask = {255, 0, 255, 255, 255, 255};
    EXPECT_EQ(d.GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, 0, 3, 2, mask.data(), 3, 2,
                                                          GDT_Byte, 0, 0),
              CE_None);
  };
  EXPECT_EQ(read(write_raster(folder.path("mask.tif"), masked)).known, expected);
  DemOptions option;
  option.nodata = 2;
  EXPECT_EQ(read(write_raster(folder.path("plain.tif"), {}), option).known, expected);
}

TEST(ReadDem, ScaleOffsetAndUnitsAreApplied) {
  const TempFolder folder;
  Raster scaled;
  scaled.adjust = [](GDALDataset& d) {
    d.GetRasterBand(1)->SetScale(0.5);
    d.GetRasterBand(1)->SetOffset(100);
  };
  EXPECT_EQ(read(write_raster(folder.path("scaled.tif"), scaled)).heights_m[3], 102);
  Raster feet;
  feet.adjust = [](GDALDataset& d) { d.GetRasterBand(1)->SetUnitType("ft"); };
  EXPECT_DOUBLE_EQ(read(write_raster(folder.path("feet.tif"), feet)).heights_m[3], 4 * 0.3048);
  DemOptions survey;
  survey.height_unit = "us-ft";
  EXPECT_DOUBLE_EQ(read(folder.path("feet.tif"), survey).heights_m[3], 4 * 1200.0 / 3937);
  Raster vertical;
  vertical.crs = "EPSG:32611+8228";  // NAVD88 height (ft)
  EXPECT_DOUBLE_EQ(read(write_raster(folder.path("vertical.tif"), vertical)).heights_m[3],
                   4 * 0.3048);
}

TEST(ReadDem, SouthUpIsTurned) {
  const TempFolder folder;
  Raster south_up;
  south_up.geotransform = {500'000, 10, 0, 3'999'980, 0, 10};
  const Dem dem = read(write_raster(folder.path("s.tif"), south_up));
  EXPECT_EQ(dem.heights_m, (std::vector<double>{4, 5, 6, 1, 2, 3}));
  EXPECT_EQ(dem.y_of(0), 3'999'995);
}

TEST(ReadDem, MosaicLaterOnTopGapsVoid) {
  const TempFolder folder;
  write_raster(folder.path("a.tif"), {});
  Raster b;
  b.geotransform[0] += 20;  // shares a column with a
  b.geotransform[3] -= 10;  // one row further south
  b.values = {10, 20, 30, 40, 50, 60};
  write_raster(folder.path("b.tif"), b);
  const Dem dem = read_dem({folder.path("a.tif"), folder.path("b.tif")}, {}, {});
  EXPECT_EQ(dem.columns, 5);
  EXPECT_EQ(dem.rows, 3);
  EXPECT_EQ(dem.heights_m,
            (std::vector<double>{1, 2, 3, 0, 0, 4, 5, 10, 20, 30, 0, 0, 40, 50, 60}));
  EXPECT_EQ(dem.known, (std::vector<std::uint8_t>{1, 1, 1, 0, 0, 1, 1, 1, 1, 1, 0, 0, 1, 1, 1}));
  const Dem other = read_dem({folder.path("b.tif"), folder.path("a.tif")}, {}, {});
  EXPECT_EQ(other.heights_m[7], 6);
  EXPECT_EQ(other.geotransform, dem.geotransform);
}

TEST(ReadDem, RefusesWithOneLineThatSaysWhy) {
  const TempFolder folder;
  const auto file = [&](const char* name) { return folder.path(name); };
  const auto refuses = [&](const Raster& raster, const std::string& reason,
                           const DemOptions& options = {}) {
    const std::string path = write_raster(file("refused.tif"), raster);
    const std::string message = refusal({path}, options);
    EXPECT_NE(message.find(reason), std::string::npos) << message;
    EXPECT_NE(message.find(options.height_unit || reason[0] == 't' ? "" : "refused.tif"),
              std::string::npos)
        << message;
  };
  EXPECT_NE(refusal({file("missing.tif")}).find("no such file"), std::string::npos);
  FILE* text = fopen(file("notes.txt").c_str(), "w");
  fputs("hello", text);
  fclose(text);
  EXPECT_NE(refusal({file("notes.txt")}).find("a raster that GDAL reads was expected"),
            std::string::npos);

  Raster r;
  r.geotransform[2] = 3;
  refuses(r, "rotated");
  r = {};
  r.columns = 6, r.rows = 1;
  refuses(r, "at least 2 x 2");
  r = {};
  r.values[2] = std::numeric_limits<double>::quiet_NaN();
  refuses(r, "not a number");
  r.values[2] = std::numeric_limits<double>::infinity();
  refuses(r, "not a number");
  r.values[2] = -32767;
  refuses(r, "--nodata -32767");
  r = {};
  r.values = {0, 0, 0, 0, 0, 0};
  r.adjust = [](GDALDataset& d) { d.GetRasterBand(1)->SetNoDataValue(0); };
  refuses(r, "all samples are void");
  r = {};
  r.adjust = [](GDALDataset& d) { d.GetRasterBand(1)->SetUnitType("fm"); };
  refuses(r, "height unit \"fm\" is not known");
  r = {};
  DemOptions furlongs;
  furlongs.height_unit = "furlong";
  refuses(r, "--height-unit furlong: not known", furlongs);
  r.crs = "";
  DemOptions ellipsoid;
  ellipsoid.earth = Earth::kEllipsoid;
  refuses(r, "the data have no coordinate system", ellipsoid);
  r = {};
  r.type = GDT_CFloat32;
  refuses(r, "complex");
  DemOptions tight;
  tight.memory_budget_bytes = 100;
  refuses({}, "--memory allows", tight);

  write_raster(file("a.tif"), {});
  r = {};
  r.crs = "EPSG:32612";
  EXPECT_NE(
      refusal({file("a.tif"), write_raster(file("b.tif"), r)}).find("another coordinate system"),
      std::string::npos);
  r = {};
  r.geotransform[0] += 5;
  EXPECT_NE(
      refusal({file("a.tif"), write_raster(file("c.tif"), r)}).find("does not share the cells"),
      std::string::npos);
}

TEST(ReadDem, TruncatedFileIsRefused) {
  const TempFolder folder;
  Raster big;
  big.columns = 200, big.rows = 200;
  big.values.assign(40'000, 7);
  const std::string path = write_raster(folder.path("cut.tif"), big);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_NE(refusal({path}).find("cut.tif"), std::string::npos);
}

TEST(PlaceSamples, SameBitsForAnyThreadCount) {
  const TempFolder folder;
  Raster raster;
  raster.crs = "EPSG:4326";
  raster.columns = 40, raster.rows = 100;
  raster.geotransform = {8, 0.001, 0, 46, 0, -0.001};
  raster.values.resize(4000);
  for (std::size_t i = 0; i < raster.values.size(); ++i)
    raster.values[i] = std::sin(static_cast<double>(i)) * 1000;
  const Dem dem = read(write_raster(folder.path("a.tif"), raster));
  set_thread_count(1);
  const SampleGrid one = place_samples(dem);
  for (const int threads : {2, 7}) {
    set_thread_count(threads);
    EXPECT_EQ(place_samples(dem).positions, one.positions);
  }
  set_thread_count(0);
  EXPECT_NEAR(one.cell_y_m, 111.15, 0.1);
  EXPECT_NEAR(one.cell_x_m, 77.4, 0.2);
  EXPECT_GT(one.bend_cells, 0);
  EXPECT_LT(one.bend_cells, 1e-4);
  for (const Position& p : one.positions) ASSERT_EQ(round_to_lattice(p), p);
}

TEST(PlaceSamples, FlatGridIsExactlyRegular) {
  const TempFolder folder;
  Raster raster;
  raster.crs = "";
  const SampleGrid grid = place_samples(read(write_raster(folder.path("a.tif"), raster)));
  EXPECT_EQ(grid.cell_x_m, 10);
  EXPECT_EQ(grid.bend_cells, 0);
  EXPECT_EQ(grid.at(2, 1).x_m - grid.at(1, 1).x_m, 10);
  EXPECT_EQ(grid.at(2, 0).y_m - grid.at(2, 1).y_m, 10);
  EXPECT_EQ(grid.at(2, 1).z_m, 6);
}

/// Every DEM of the collection is read, or refused for the reason its catalogue gives.
TEST(ReadDem, SharedCollection) {
  SCARP_SHARED_OR_SKIP(taiwan, "projected/taiwan_xueshan_z13_webmercator.tif");
  EXPECT_EQ(read(taiwan).columns, 3000);
  for (const char* name :
       {"geographic/N27E086_everest_srtm3_voids.tif", "geographic/N42E001.hgt",
        "geographic/S33W071_aconcagua.dt1", "geographic/front_range_srtmgl3.asc",
        "geographic/zion_srtm3_uint16.tif", "projected/bigtujunga_srtm30m_utm11.tif",
        "projected/gabilan_lidar1m.bil", "projected/mandakini_srtm90_utm44.bil",
        "projected/mt_st_helens_usgs30m.dem", "projected/new_zealand_1km_nztm.tif",
        "projected/slovenia_lidar1m_nan_nodata.tif", "urban/czech_village_dsm1m_krovak.tif"}) {
    SCARP_SHARED_OR_SKIP(path, name);
    EXPECT_EQ(refusal({path}), "accepted") << name;
  }
  SCARP_SHARED_OR_SKIP(local, "literature/ashby_gap_va_i16.tif");
  EXPECT_NE(refusal({local}).find("cannot be placed on the Earth"), std::string::npos);
  DemOptions flat;
  flat.earth = Earth::kFlat;
  EXPECT_EQ(refusal({local}, flat), "accepted");
  SCARP_SHARED_OR_SKIP(zip, "geographic/N43E007.hgt.zip");
  EXPECT_EQ(read("/vsizip/" + zip + "/N43E007.hgt").columns, 1201);
  SCARP_SHARED_OR_SKIP(crater, "geographic/crater_lake_30m_wgs84.tif");
  EXPECT_NE(refusal({crater}).find("--nodata -32767"), std::string::npos);
  SCARP_SHARED_OR_SKIP(picture, "tiles/mt_fuji_512_terrain_rgb.png");
  EXPECT_NE(refusal({picture}).find("picture"), std::string::npos);
  SCARP_SHARED_OR_SKIP(east, "geographic/N49W123_vancouver_srtm3.tif");
  SCARP_SHARED_OR_SKIP(west, "geographic/N49W124_vancouver_srtm3.tif");
  const Dem both = read_dem({east, west}, {}, {});
  EXPECT_EQ(both.columns, 2401);
  EXPECT_EQ(both.rows, 1201);
}

}  // namespace
}  // namespace scarp
