#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>

#include "core/error/error.h"
#include "tests/tiles/limits.h"
#include "tests/tiles/temporary_folder.h"
#include "tiles/layers/geopackage.h"
#include "tiles/layers/geotiff.h"
#include "tiles/layers/png_image.h"

namespace scarp {
namespace {

using test::TemporaryFolder;

std::string wkt_of(int epsg) {
  OGRSpatialReference crs;
  crs.importFromEPSG(epsg);
  char* text = nullptr;
  const char* const options[] = {"FORMAT=WKT2_2019", nullptr};
  crs.exportToWkt(&text, options);
  const std::string wkt = text;
  CPLFree(text);
  return wkt;
}

GDALDatasetUniquePtr open(const std::string& path, unsigned kind = GDAL_OF_RASTER) {
  GDALAllRegister();
  return GDALDatasetUniquePtr(GDALDataset::Open(path.c_str(), kind | GDAL_OF_READONLY));
}

template <class Step>
std::string message_of(Step step) {
  try {
    step();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Writes, reads back and compares every number.
template <class T>
void expect_round_trip(GDALDataType type, std::int32_t columns, std::int32_t rows,
                       std::optional<double> nodata) {
  const TemporaryFolder folder;
  std::vector<T> samples(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = static_cast<T>((i * 2654435761U) % 251);
  samples[0] = std::numeric_limits<T>::max();
  samples.back() = std::numeric_limits<T>::lowest();
  RasterLayer layer;
  layer.columns = columns;
  layer.rows = rows;
  layer.samples = std::span<const T>(samples);
  layer.geotransform = {500000, 30, 0, 4000000, 0, -30};
  layer.crs_wkt = wkt_of(32611);
  layer.band_name = "visible";
  layer.unit = "m";
  layer.nodata = nodata;
  layer.metadata = {{"SURFACE", "grid"}, {"REFRACTION", "0.13"}};
  write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse);
  EXPECT_EQ(folder.names(), std::set<std::string>{"a.tif"});

  const GDALDatasetUniquePtr back = open(folder / "a.tif");
  ASSERT_TRUE(back);
  EXPECT_STREQ(back->GetMetadataItem("LAYOUT", "IMAGE_STRUCTURE"), "COG");
  EXPECT_STREQ(back->GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE"), "DEFLATE");
  EXPECT_STREQ(back->GetMetadataItem("SURFACE"), "grid");
  GDALRasterBand& band = *back->GetRasterBand(1);
  EXPECT_EQ(band.GetRasterDataType(), type);
  EXPECT_STREQ(band.GetDescription(), "visible");
  EXPECT_STREQ(band.GetUnitType(), "m");
  int has_nodata = 0;
  const double found = band.GetNoDataValue(&has_nodata);
  EXPECT_EQ(has_nodata != 0, nodata.has_value());
  if (nodata) {
    EXPECT_TRUE(found == *nodata || (std::isnan(found) && std::isnan(*nodata)));
  }
  std::array<double, 6> geotransform{};
  back->GetGeoTransform(geotransform.data());
  EXPECT_EQ(geotransform, layer.geotransform);
  OGRSpatialReference utm;
  utm.importFromEPSG(32611);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  ASSERT_NE(back->GetSpatialRef(), nullptr);
  EXPECT_TRUE(back->GetSpatialRef()->IsSame(&utm));
  std::vector<T> read(samples.size());
  ASSERT_EQ(band.RasterIO(GF_Read, 0, 0, columns, rows, read.data(), columns, rows, type, 0, 0),
            CE_None);
  EXPECT_EQ(read, samples);
  EXPECT_EQ(band.GetOverviewCount() > 0, columns > 512);
}

TEST(GeoTiff, RoundTripOfEveryType) {
  expect_round_trip<std::uint8_t>(GDT_Byte, 7, 5, 255);
  expect_round_trip<std::int32_t>(GDT_Int32, 600, 300, -1);
  expect_round_trip<std::uint32_t>(GDT_UInt32, 7, 5, {});
  expect_round_trip<float>(GDT_Float32, 600, 520, std::nan(""));
  expect_round_trip<float>(GDT_Float32, 1, 1, {});
}

/// A few visible cells with colours.
RasterLayer visible_layer(const std::vector<std::uint8_t>& samples) {
  RasterLayer layer;
  layer.columns = 3;
  layer.rows = static_cast<std::int32_t>(samples.size()) / 3;
  layer.samples = std::span(samples);
  layer.colours = {{200, 30, 20, 255}, {20, 200, 30, 128}};
  return layer;
}

TEST(GeoTiff, ColoursWithoutCrsAndTheSameBytesTwice) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> samples = {0, 1, 1, 0, 0, 1};
  write_geotiff_cog(folder / "a.tif", visible_layer(samples), Existing::kRefuse);
  write_geotiff_cog(folder / "b.tif", visible_layer(samples), Existing::kRefuse);
  EXPECT_EQ(test::read_text(folder / "a.tif"), test::read_text(folder / "b.tif"));
  const GDALDatasetUniquePtr back = open(folder / "a.tif");
  EXPECT_TRUE(back->GetSpatialRef() == nullptr || back->GetSpatialRef()->IsEmpty());
  GDALColorTable* table = back->GetRasterBand(1)->GetColorTable();
  ASSERT_NE(table, nullptr);
  EXPECT_EQ(table->GetColorEntry(0)->c1, 200);
  EXPECT_EQ(table->GetColorEntry(1)->c2, 200);
}

TEST(GeoTiff, FailuresLeaveNothingBehind) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> samples = {0, 1, 1, 0, 0, 1};
  RasterLayer layer = visible_layer(samples);
  {
    const test::FullDisk full(200);
    EXPECT_NE(message_of([&] {
                write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse);
              }).find("File too large"),
              std::string::npos);
  }
  layer.crs_wkt = "no such thing";
  EXPECT_NE(message_of([&] {
              write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse);
            }).find("the CRS \"no such thing\" is not understood"),
            std::string::npos);
  EXPECT_TRUE(folder.names().empty());
  layer.crs_wkt.clear();
  write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse);
  EXPECT_NE(message_of([&] {
              write_geotiff_cog(folder / "a.tif", layer, Existing::kRefuse);
            }).find("exists already"),
            std::string::npos);
  EXPECT_NE(message_of([&] {
              write_geotiff_cog(folder / "no/a.tif", layer, Existing::kRefuse);
            }).find("create it first"),
            std::string::npos);
}

std::vector<GroupPolygon> two_groups() {
  const Ring outer = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  const Ring hole = {{2, 2}, {2, 4}, {4, 4}, {4, 2}};
  const Ring apart = {{20, 0}, {25, 0}, {25, 5}};
  return {{3, -1, 14, 96, -2.5, 12, {{outer, hole}, {apart}}}, {4, 9, 2, 4, 0, 1, {{hole}}}};
}

TEST(GeoPackage, RoundTrip) {
  for (const std::string& wkt : {wkt_of(32611), wkt_of(4326), std::string()}) {
    const TemporaryFolder folder;
    write_group_polygons(folder / "g.gpkg", two_groups(), wkt, Existing::kRefuse);
    EXPECT_EQ(folder.names(), std::set<std::string>{"g.gpkg"});
    const GDALDatasetUniquePtr back = open(folder / "g.gpkg", GDAL_OF_VECTOR);
    ASSERT_TRUE(back);
    OGRLayer* layer = back->GetLayerByName("groups");
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(layer->GetFeatureCount(), 2);
    OGRFeatureUniquePtr feature(layer->GetNextFeature());
    EXPECT_EQ(feature->GetFieldAsInteger64("group"), 3);
    EXPECT_TRUE(feature->IsFieldNull(feature->GetFieldIndex("parent")));
    EXPECT_EQ(feature->GetFieldAsInteger64("triangles"), 14);
    EXPECT_EQ(feature->GetFieldAsDouble("area_m2"), 96);
    EXPECT_EQ(feature->GetFieldAsDouble("height_min_m"), -2.5);
    EXPECT_EQ(feature->GetFieldAsDouble("height_max_m"), 12);
    const OGRMultiPolygon* geometry = feature->GetGeometryRef()->toMultiPolygon();
    EXPECT_TRUE(geometry->IsValid());
    EXPECT_EQ(geometry->get_Area(), 100 - 4 + 12.5);
    OGREnvelope envelope;
    geometry->getEnvelope(&envelope);
    EXPECT_EQ(envelope.MaxX, 25);  // x stays x, also where the CRS has latitude first
    feature.reset(layer->GetNextFeature());
    EXPECT_EQ(feature->GetFieldAsInteger64("parent"), 9);
    if (!wkt.empty()) {
      ASSERT_NE(layer->GetSpatialRef(), nullptr);
      OGRSpatialReference crs;
      crs.importFromWkt(wkt.c_str());
      crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      EXPECT_TRUE(layer->GetSpatialRef()->IsSame(&crs));
    }
  }
}

TEST(GeoPackage, InPiecesTheSameBytes) {
  const TemporaryFolder folder;
  std::vector<GroupPolygon> many;
  for (std::int64_t i = 0; i < 3000; ++i)
    for (GroupPolygon group : two_groups()) {
      group.group += 2 * i;
      for (auto& polygon : group.polygons)
        for (Ring& ring : polygon)
          for (RingPoint& point : ring) point.x += 30.0 * static_cast<double>(i);
      many.push_back(std::move(group));
    }
  for (const std::size_t count : {std::size_t{0}, std::size_t{2}, many.size()}) {
    const std::span<const GroupPolygon> groups = std::span(many).first(count);
    write_group_polygons(folder / "whole.gpkg", groups, wkt_of(32611), Existing::kReplace);
    std::ofstream(folder / "growing.gpkg") << "left by a killed run";
    const auto give = [&](const TakeGroups& take) {
      for (std::size_t i = 0; i < count; i += 500)
        take(groups.subspan(i, std::min<std::size_t>(500, count - i)));
    };
    write_group_polygons_in_pieces(folder / "pieces.gpkg", folder / "growing.gpkg", give,
                                   wkt_of(32611), Existing::kReplace);
    EXPECT_EQ(test::read_text(folder / "pieces.gpkg"), test::read_text(folder / "whole.gpkg"))
        << count;
    EXPECT_EQ(folder.names(), (std::set<std::string>{"pieces.gpkg", "whole.gpkg"}));
  }
  EXPECT_THROW(write_group_polygons_in_pieces(
                   folder / "never.gpkg", folder / "growing.gpkg",
                   [](const TakeGroups&) { throw Error(ErrorCode::kInput, "the source is gone"); },
                   "", Existing::kRefuse),
               Error);
  EXPECT_EQ(folder.names(), (std::set<std::string>{"pieces.gpkg", "whole.gpkg"}));
}

TEST(GeoPackage, TheSameBytesTwice) {
  const TemporaryFolder folder;
  write_group_polygons(folder / "a.gpkg", two_groups(), wkt_of(32611), Existing::kRefuse);
  write_group_polygons(folder / "b.gpkg", two_groups(), wkt_of(32611), Existing::kRefuse);
  EXPECT_EQ(test::read_text(folder / "a.gpkg"), test::read_text(folder / "b.gpkg"));
}

TEST(GeoPackage, FailuresLeaveNothingBehind) {
  const TemporaryFolder folder;
  {
    const test::FullDisk full(20'000);
    EXPECT_NE(message_of([&] {
                write_group_polygons(folder / "g.gpkg", two_groups(), "", Existing::kRefuse);
              }).find("File too large"),
              std::string::npos);
  }
  EXPECT_TRUE(folder.names().empty());
  write_group_polygons(folder / "g.gpkg", {}, "", Existing::kRefuse);
  EXPECT_NE(message_of([&] {
              write_group_polygons(folder / "g.gpkg", {}, "", Existing::kRefuse);
            }).find("exists already"),
            std::string::npos);
  write_group_polygons(folder / "g.gpkg", two_groups(), "", Existing::kReplace);
}

TEST(Png, RoundTripAndFailures) {
  const TemporaryFolder folder;
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < 3 * 40 * 30; ++i) rgb.push_back(static_cast<std::uint8_t>((i * i) % 253));
  write_png(folder / "p.png", 40, 30, rgb, Existing::kRefuse);
  const GDALDatasetUniquePtr back = open(folder / "p.png");
  ASSERT_TRUE(back);
  EXPECT_EQ(back->GetRasterXSize(), 40);
  EXPECT_EQ(back->GetRasterYSize(), 30);
  std::vector<std::uint8_t> read(rgb.size());
  ASSERT_EQ(back->RasterIO(GF_Read, 0, 0, 40, 30, read.data(), 40, 30, GDT_Byte, 3, nullptr, 3, 120,
                           1, nullptr),
            CE_None);
  EXPECT_EQ(read, rgb);
  EXPECT_NE(message_of([&] {
              write_png(folder / "p.png", 40, 30, rgb, Existing::kRefuse);
            }).find("exists already"),
            std::string::npos);
  const test::FullDisk full(100);
  EXPECT_NE(message_of([&] {
              write_png(folder / "q.png", 40, 30, rgb, Existing::kRefuse);
            }).find("File too large"),
            std::string::npos);
  EXPECT_EQ(folder.names(), std::set<std::string>{"p.png"});
}

}  // namespace
}  // namespace scarp
