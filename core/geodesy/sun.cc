#include "core/geodesy/sun.h"

#include <cmath>
#include <numbers>

namespace scarp {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

}  // namespace

EcefPoint sun_direction(double days) {
  // Terrestrial time runs ahead of UTC by about this much in this century.
  constexpr double kAheadDays = 69.2 / 86'400;
  const double t = (days + kAheadDays) / 36'525;
  const double mean_longitude_deg = 280.46646 + t * (36'000.76983 + t * 0.0003032);
  const double anomaly = (357.52911 + t * (35'999.05029 - t * 0.0001537)) * kRadiansPerDegree;
  const double centre_deg = (1.914602 - t * (0.004817 + t * 0.000014)) * std::sin(anomaly) +
                            (0.019993 - t * 0.000101) * std::sin(2 * anomaly) +
                            0.000289 * std::sin(3 * anomaly);
  const double node = (125.04 - 1934.136 * t) * kRadiansPerDegree;
  // With aberration and nutation, of the date.
  const double longitude =
      (mean_longitude_deg + centre_deg - 0.00569 - 0.00478 * std::sin(node)) * kRadiansPerDegree;
  const double obliquity = (23.43929111 - t * (0.0130041667 + t * (1.6389e-7 - t * 5.0361e-7)) +
                            0.00256 * std::cos(node)) *
                           kRadiansPerDegree;
  const double ascension =
      std::atan2(std::cos(obliquity) * std::sin(longitude), std::cos(longitude));
  const double declination = std::asin(std::sin(obliquity) * std::sin(longitude));
  // Mean sidereal time at Greenwich turns the sky.
  const double turns = std::fmod(280.46061837 + 360.98564736629 * days, 360.0);
  const double east = ascension - turns * kRadiansPerDegree;
  return {std::cos(declination) * std::cos(east), std::cos(declination) * std::sin(east),
          std::sin(declination)};
}

double refracted_elevation_rad(double true_elevation_rad) {
  const double h = true_elevation_rad / kRadiansPerDegree;
  if (h < -1 || h > 89.9) return true_elevation_rad;
  const double minutes = 1.02 / std::tan((h + 10.3 / (h + 5.11)) * kRadiansPerDegree);
  return (h + minutes / 60) * kRadiansPerDegree;
}

}  // namespace scarp
