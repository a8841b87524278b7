#include "tests/judge/dem_window.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/terrain.h"

namespace scarp::test {

SampleGrid dem_window(const std::string& path, std::int32_t column, std::int32_t row,
                      std::int32_t columns, std::int32_t rows, double cell_m) {
  GDALAllRegister();
  const GDALDatasetUniquePtr dem(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!dem) return {};
  columns = std::min(columns, dem->GetRasterXSize() - column);
  rows = std::min(rows, dem->GetRasterYSize() - row);
  if (columns < 1 || rows < 1) return {};
  GDALRasterBand* band = dem->GetRasterBand(1);
  std::vector<double> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  if (band->RasterIO(GF_Read, column, row, columns, rows, heights.data(), columns, rows,
                     GDT_Float64, 0, 0, nullptr) != CE_None)
    return {};
  int has_nodata = 0;
  const double nodata = band->GetNoDataValue(&has_nodata);
  return grid_of(columns, rows, cell_m, [&](std::int32_t c, std::int32_t r) {
    const double z_m = heights[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                               static_cast<std::size_t>(c)];
    return has_nodata && z_m == nodata ? std::numeric_limits<double>::quiet_NaN() : z_m;
  });
}

}  // namespace scarp::test
