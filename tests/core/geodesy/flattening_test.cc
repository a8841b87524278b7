#include "core/geodesy/flattening.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace scarp {
namespace {

EcefPoint on_sphere(double longitude_rad, double latitude_rad, double radius_m) {
  return {radius_m * std::cos(latitude_rad) * std::cos(longitude_rad),
          radius_m * std::cos(latitude_rad) * std::sin(longitude_rad),
          radius_m * std::sin(latitude_rad)};
}

double distance_m(const EcefPoint& a, const EcefPoint& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m);
}

TEST(Flattening, UnflattenIsTheInverse) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-0.5, 0.5), height(-1e4, 1e6);
  for (const double refraction : {0.0, 0.13, 1.0}) {
    for (const double latitude : {-std::numbers::pi / 2, -0.8, 0.0, 1.2, std::numbers::pi / 2}) {
      const Flattening frame(on_sphere(3.1, latitude, kEarthRadiusM), refraction);
      for (int i = 0; i < 1000; ++i) {
        // around the centre also where that is a pole or the antimeridian
        const double up = std::clamp(latitude + angle(random), -1.57, 1.57);
        const EcefPoint p = on_sphere(3.1 + angle(random), up, kEarthRadiusM + height(random));
        ASSERT_LT(distance_m(frame.unflatten(frame.flatten(p)), p), 1e-7);
      }
    }
  }
}

TEST(Flattening, StraightLinesStayStraightWithoutRefraction) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> angle(-0.03, 0.03), height(0, 4000), part(0, 1);
  const Flattening frame(on_sphere(0.2, 0.8, kEarthRadiusM), 0);
  for (int i = 0; i < 1000; ++i) {
    const EcefPoint a =
        on_sphere(0.2 + angle(random), 0.8 + angle(random), kEarthRadiusM + height(random));
    const EcefPoint b =
        on_sphere(0.2 + angle(random), 0.8 + angle(random), kEarthRadiusM + height(random));
    const double s = part(random);
    const EcefPoint c{a.x_m + s * (b.x_m - a.x_m), a.y_m + s * (b.y_m - a.y_m),
                      a.z_m + s * (b.z_m - a.z_m)};
    const Position fa = frame.flatten(a), fb = frame.flatten(b), fc = frame.flatten(c);
    const double t =
        std::hypot(fc.x_m - fa.x_m, fc.y_m - fa.y_m) / std::hypot(fb.x_m - fa.x_m, fb.y_m - fa.y_m);
    ASSERT_NEAR(fc.x_m, fa.x_m + t * (fb.x_m - fa.x_m), 1e-6);
    ASSERT_NEAR(fc.y_m, fa.y_m + t * (fb.y_m - fa.y_m), 1e-6);
    ASSERT_NEAR(fc.z_m, fa.z_m + t * (fb.z_m - fa.z_m), 1e-6);
  }
}

TEST(Flattening, SurfaceOfTheSphereFallsAwayAsTheTextbookSays) {
  // Drop of the sphere below the tangent plane at distance d, less the share k bent back.
  for (const double refraction : {0.0, 0.13, 0.25, 1.0}) {
    const Flattening frame(on_sphere(1, 0.5, kEarthRadiusM), refraction);
    const Position p = frame.flatten(on_sphere(1, 0.5 + 30'000 / kEarthRadiusM, kEarthRadiusM));
    EXPECT_NEAR(p.y_m, 30'000, 0.5);
    EXPECT_NEAR(p.z_m, -(1 - refraction) * 30'000.0 * 30'000.0 / (2 * kEarthRadiusM), 0.01);
  }
}

TEST(Flattening, RefractedRaysAgreeBetweenFrames) {
  // A ray that one frame calls straight is straight in a frame with another centre.
  const double k = 0.25;
  const Flattening one(on_sphere(0, 0.7, kEarthRadiusM), k);
  const Flattening other(on_sphere(0.02, 0.72, kEarthRadiusM), k);
  const Position a{-20'000, 5'000, 300}, b{60'000, -9'000, 2'500};
  for (const double t : {0.1, 0.35, 0.5, 0.8}) {
    const Position c{a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m),
                     a.z_m + t * (b.z_m - a.z_m)};
    const Position fa = other.flatten(one.unflatten(a)), fb = other.flatten(one.unflatten(b)),
                   fc = other.flatten(one.unflatten(c));
    const double s = (fc.x_m - fa.x_m) / (fb.x_m - fa.x_m);
    EXPECT_NEAR(fc.y_m, fa.y_m + s * (fb.y_m - fa.y_m), 1e-6);
    EXPECT_NEAR(fc.z_m, fa.z_m + s * (fb.z_m - fa.z_m), 1e-6);
  }
}

}  // namespace
}  // namespace scarp
