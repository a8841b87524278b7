#pragma once

#include <string>
#include <vector>

namespace scarp {

/// Undulation of a geoid above the ellipsoid from any raster that GDAL reads (degrees, metres),
/// for example the gtx files of PROJ. Bilinear between samples; wraps in longitude where the
/// raster goes around the globe.
class Geoid {
 public:
  /// Throws Error{kInput} where the file is no raster in degrees.
  explicit Geoid(const std::string& file);

  /// Metres. Throws Error{kInput} outside the raster.
  double undulation_m(double longitude_deg, double latitude_deg) const;

 private:
  double sample_m(int column, int row) const;

  std::string file_;
  int columns_ = 0;
  int rows_ = 0;
  double first_longitude_deg_ = 0, longitude_step_deg_ = 0;
  double first_latitude_deg_ = 0, latitude_step_deg_ = 0;
  bool goes_around_ = false;
  std::vector<double> undulations_m_;
};

}  // namespace scarp
