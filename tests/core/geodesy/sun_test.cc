#include "core/geodesy/sun.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace scarp {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

double declination_deg(double days) {
  return std::asin(sun_direction(days).z_m) * kDegreesPerRadian;
}

/// Longitude at which the sun stands in the south or north.
double noon_longitude_deg(double days) {
  const EcefPoint sun = sun_direction(days);
  return std::atan2(sun.y_m, sun.x_m) * kDegreesPerRadian;
}

/// Meeus, example 25.a: 1992 October 13, 0h dynamical time.
TEST(Sun, AgreesWithTheBook) {
  const double days = -2636.5 - 59.0 / 86'400;
  EXPECT_NEAR(declination_deg(days), -7.78507, 0.003);
  const double mean_sidereal_deg = std::fmod(280.46061837 + 360.98564736629 * days, 360.0);
  EXPECT_NEAR(std::remainder(noon_longitude_deg(days) + mean_sidereal_deg - 198.38083, 360), 0,
              0.003);
}

/// The equation of time: noon at Greenwich is 14.2 minutes late on February 11 and 16.4 early on
/// November 3, and the June solstice stands at 23.44 degrees.
TEST(Sun, KeepsTheYear) {
  constexpr double k2026 = 26 * 365.25 + 0.5;  // 2026-01-01T12:00Z less a quarter
  EXPECT_NEAR(noon_longitude_deg(k2026 - 0.0 + 41), 14.2 / 4, 0.4);
  EXPECT_NEAR(noon_longitude_deg(k2026 - 0.0 + 306), -16.4 / 4, 0.4);
  EXPECT_NEAR(declination_deg(9668), 23.44, 0.01);  // 2026-06-21T12:00Z
}

TEST(Sun, RefractionLiftsTheHorizonByHalfADegree) {
  EXPECT_NEAR(refracted_elevation_rad(0) * kDegreesPerRadian, 0.48, 0.01);
  EXPECT_NEAR((refracted_elevation_rad(0.5) - 0.5) * kDegreesPerRadian * 60, 1.86, 0.05);
  EXPECT_EQ(refracted_elevation_rad(-0.5), -0.5);
}

}  // namespace
}  // namespace scarp
