#include "ingest/crs/geoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error/error.h"
#include "ingest/dem/gdal_session.h"

namespace scarp {

Geoid::Geoid(const std::string& file) : file_(file) {
  const DatasetPtr dataset =
      open_dataset(file, GDAL_OF_RASTER, "a raster of geoid undulations in degrees and metres");
  double transform[6];
  const OGRSpatialReference* crs = dataset->GetSpatialRef();
  if (dataset->GetRasterCount() < 1 || dataset->GetGeoTransform(transform) != CE_None ||
      transform[2] != 0 || transform[4] != 0 || (crs && !crs->IsGeographic())) {
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': not a raster in degrees; geoid undulations on a longitude and "
                            "latitude grid were expected; give a file such as egm96_15.gtx",
                            file));
  }
  columns_ = dataset->GetRasterXSize();
  rows_ = dataset->GetRasterYSize();
  longitude_step_deg_ = transform[1];
  latitude_step_deg_ = transform[5];
  first_longitude_deg_ = transform[0] + transform[1] / 2;
  first_latitude_deg_ = transform[3] + transform[5] / 2;
  goes_around_ = columns_ * longitude_step_deg_ >= 360 - longitude_step_deg_ / 2;
  undulations_m_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  if (dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, columns_, rows_, undulations_m_.data(),
                                          columns_, rows_, GDT_Float64, 0, 0) != CE_None)
    throw Error(ErrorCode::kInput, fmt::format("'{}': cannot be read to its end; a whole raster "
                                               "was expected; fetch the file again",
                                               file));
}

double Geoid::sample_m(int column, int row) const {
  if (goes_around_) column = ((column % columns_) + columns_) % columns_;
  return undulations_m_[static_cast<std::size_t>(std::clamp(row, 0, rows_ - 1)) *
                            static_cast<std::size_t>(columns_) +
                        static_cast<std::size_t>(std::clamp(column, 0, columns_ - 1))];
}

double Geoid::undulation_m(double longitude_deg, double latitude_deg) const {
  double column = (longitude_deg - first_longitude_deg_) / longitude_step_deg_;
  const double row = (latitude_deg - first_latitude_deg_) / latitude_step_deg_;
  const double around = 360 / longitude_step_deg_;
  column -= std::floor(column / around) * around;
  // Half a sample beyond the outer samples still belongs to the raster.
  if (!goes_around_ && column >= around - 0.5) column -= around;
  if ((!goes_around_ && column > columns_ - 0.5) || row < -0.5 || row > rows_ - 0.5)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': does not reach longitude {:.4f}, latitude {:.4f}; the whole DEM "
                            "has to lie inside; give a geoid that covers it",
                            file_, longitude_deg, latitude_deg));
  const double west = std::floor(column), north = std::floor(row);
  const double east_part = column - west, south_part = row - north;
  const int c = static_cast<int>(west), r = static_cast<int>(north);
  return (1 - south_part) * ((1 - east_part) * sample_m(c, r) + east_part * sample_m(c + 1, r)) +
         south_part * ((1 - east_part) * sample_m(c, r + 1) + east_part * sample_m(c + 1, r + 1));
}

}  // namespace scarp
