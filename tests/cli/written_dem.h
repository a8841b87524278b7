#pragma once

#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace scarp::test {

/// A raster of square cells, north up.
struct WrittenDem {
  int columns, rows;
  double left, top;  ///< of the first cell's corner
  double cell_m;
  std::string crs = "EPSG:32632";
  std::optional<double> nodata = {};
};

/// Writes a GeoTIFF of one band of the heights' type.
/// @param heights  [rows][columns]
/// @return path
template <typename Height>
std::string write_dem(const std::string& path, const WrittenDem& dem, std::vector<Height> heights) {
  static_assert(std::is_same_v<Height, float> || std::is_same_v<Height, std::int16_t>);
  constexpr GDALDataType kType = std::is_same_v<Height, float> ? GDT_Float32 : GDT_Int16;
  GDALAllRegister();
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), dem.columns, dem.rows, 1, kType, nullptr);
  double transform[6] = {dem.left, dem.cell_m, 0, dem.top, 0, -dem.cell_m};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput(dem.crs.c_str());
  dataset->SetSpatialRef(&crs);
  if (dem.nodata) dataset->GetRasterBand(1)->SetNoDataValue(*dem.nodata);
  EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, dem.columns, dem.rows,
                                                heights.data(), dem.columns, dem.rows, kType, 0, 0),
            CE_None);
  GDALClose(dataset);
  return path;
}

}  // namespace scarp::test
