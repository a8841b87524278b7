#include "core/geodesy/earth_frame.h"

#include <cmath>

namespace scarp {

EllipsoidNormal ellipsoid_normal(const Ellipsoid& earth, const EcefPoint& point) {
  const double a = earth.semi_major_m, b = earth.semi_minor_m();
  const double e2 = earth.flattening * (2 - earth.flattening);
  const double second_e2 = e2 / (1 - e2);
  const double from_axis = std::hypot(point.x_m, point.y_m);
  const double reduced = std::atan2(point.z_m * a, from_axis * b);
  const double sine = std::sin(reduced), cosine = std::cos(reduced);
  const double latitude = std::atan2(point.z_m + second_e2 * b * sine * sine * sine,
                                     from_axis - e2 * a * cosine * cosine * cosine);
  const double sin_latitude = std::sin(latitude), cos_latitude = std::cos(latitude);
  const double normal_m = a / std::sqrt(1 - e2 * sin_latitude * sin_latitude);
  EllipsoidNormal normal;
  const double cos_longitude = from_axis > 0 ? point.x_m / from_axis : 1;
  const double sin_longitude = from_axis > 0 ? point.y_m / from_axis : 0;
  normal.up = {cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude};
  // p cos + z sin - a^2 / N keeps its digits at the poles too.
  normal.height_m = from_axis * cos_latitude + point.z_m * sin_latitude - a * a / normal_m;
  return normal;
}

}  // namespace scarp
