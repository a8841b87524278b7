#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace scarp {

/// Degrees, OGC:CRS84.
struct LonLat {
  double longitude_deg = 0, latitude_deg = 0;
};

/// Metres of EPSG:3857, which at latitude phi are 1 / cos phi metres of ground.
struct MercatorPoint {
  double x_m = 0, y_m = 0;
};
struct MercatorBox {
  double west_m = 0, south_m = 0, east_m = 0, north_m = 0;
};

inline constexpr double kMercatorRadiusM = 6'378'137;

/// Requires a latitude between the poles; beyond 85.06 degrees it is outside of all tiles.
MercatorPoint to_mercator(const LonLat& at);
LonLat to_lon_lat(const MercatorPoint& at);

inline constexpr int kTilePx = 256;
inline constexpr int kDeepestZoom = 22;

/// Requires zoom in [0, kDeepestZoom], x and y below 2^zoom.
MercatorBox tile_box(int zoom, std::int64_t x, std::int64_t y);

/// Column and row of a raster, in samples: 0 is the middle of the first cell.
struct RasterPlace {
  float column = 0, row = 0;
};

/// Where places of web mercator lie in a raster: exact at the knots of a square grid, bilinear
/// between them. Knots are so close that this errs by less than a fiftieth of a cell.
class MercatorMap {
 public:
  /// @param box     that is looked at; outside of it there is no place
  /// @param cell_m  of the raster, metres of ground
  /// @param place   exact place, or nothing where it has none
  /// Cost: a call of place for each 32 x 32 cells, about.
  MercatorMap(const MercatorBox& box, double cell_m,
              const std::function<std::optional<std::pair<double, double>>(LonLat)>& place);

  const MercatorBox& box() const { return box_; }
  /// Size of a picture's pixel that is about a cell, metres of EPSG:3857.
  double pixel_m() const { return pixel_m_; }

  /// Places along a line to the east, NaN where there is none.
  void places(double y_m, double first_x_m, double step_m, std::span<RasterPlace> places) const;

 private:
  MercatorBox box_;
  double pixel_m_ = 1, knot_m_ = 1;
  std::int64_t across_ = 0, down_ = 0;
  std::vector<RasterPlace> knots_;
};

}  // namespace scarp
