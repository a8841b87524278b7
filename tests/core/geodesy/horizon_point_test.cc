#include "core/geodesy/horizon_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/geodesy/earth_frame.h"

namespace scarp {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

EcefPoint scaled(const EcefPoint& p) {
  const double a = kWgs84.semi_major_m, b = kWgs84.semi_minor_m();
  return {p.x_m / a, p.y_m / a, p.z_m / b};
}

double dot(const EcefPoint& p, const EcefPoint& q) {
  return p.x_m * q.x_m + p.y_m * q.y_m + p.z_m * q.z_m;
}

EcefPoint minus(const EcefPoint& p, const EcefPoint& q) {
  return {p.x_m - q.x_m, p.y_m - q.y_m, p.z_m - q.z_m};
}

/// As engines test it: beyond the plane of the horizon and within the cone of tangents.
bool is_point_hidden(const EcefPoint& point, const EcefPoint& camera_ecef) {
  const EcefPoint camera = scaled(camera_ecef);
  const double horizon_square = dot(camera, camera) - 1;
  const EcefPoint to_point = minus(point, camera);
  const double along = -dot(to_point, camera);
  if (horizon_square < 0) return along > 0;
  return along > horizon_square && along * along / dot(to_point, to_point) > horizon_square;
}

EcefPoint geodetic(double longitude_rad, double latitude_rad, double height_m) {
  const double e2 = kWgs84.flattening * (2 - kWgs84.flattening);
  const double n =
      kWgs84.semi_major_m / std::sqrt(1 - e2 * std::sin(latitude_rad) * std::sin(latitude_rad));
  return {(n + height_m) * std::cos(latitude_rad) * std::cos(longitude_rad),
          (n + height_m) * std::cos(latitude_rad) * std::sin(longitude_rad),
          (n * (1 - e2) + height_m) * std::sin(latitude_rad)};
}

/// A place on the globe, an angle away from another in some direction.
struct Place {
  double longitude_rad, latitude_rad;
  Place moved(double angle, double azimuth) const {
    const double sine = std::sin(latitude_rad) * std::cos(angle) +
                        std::cos(latitude_rad) * std::sin(angle) * std::cos(azimuth);
    const double turn = std::atan2(std::sin(azimuth) * std::sin(angle) * std::cos(latitude_rad),
                                   std::cos(angle) - std::sin(latitude_rad) * sine);
    return {longitude_rad + turn, std::asin(std::clamp(sine, -1.0, 1.0))};
  }
  EcefPoint at(double height_m) const { return geodetic(longitude_rad, latitude_rad, height_m); }
};

/// Least height above the ellipsoid along a segment, by a search that the height's convexity
/// allows.
double least_height_m(const EcefPoint& from, const EcefPoint& to) {
  const auto height_at = [&](double t) {
    return ellipsoid_normal(kWgs84,
                            {from.x_m + t * (to.x_m - from.x_m), from.y_m + t * (to.y_m - from.y_m),
                             from.z_m + t * (to.z_m - from.z_m)})
        .height_m;
  };
  // 40 rounds leave 1e-7 of a segment: micrometres of height around its lowest place.
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (height_at(a) < height_at(b) ? high : low) = height_at(a) < height_at(b) ? b : a;
  }
  return height_at((low + high) / 2);
}

struct TileCase {
  double wide_rad, lowest_m, highest_m;
};

/// Rays from cameras that the point is hidden from to points of the ground: each runs through the
/// solid Earth, which lies as deep as the lowest ground.
void check_rays(const TileCase& tile, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int hidden = 0;
  for (int round = 0; round < 24; ++round) {
    const Place middle{uniform(-std::numbers::pi, std::numbers::pi), std::asin(uniform(-1, 1))};
    std::vector<EcefPoint> ground;
    for (int i = 0; i < 8; ++i)
      ground.push_back(middle.moved(tile.wide_rad * std::sqrt(uniform(0, 1)), uniform(0, 2 * M_PI))
                           .at(uniform(tile.lowest_m, tile.highest_m)));
    const double depth_m = std::max(0.0, -tile.lowest_m);
    const auto point = horizon_point(ground, middle.at(0), kWgs84, depth_m);
    ASSERT_TRUE(point.has_value());
    for (int i = 0; i < 40; ++i) {
      // Mostly around the horizon of low cameras, where a point that lies too near gives itself
      // away.
      const double height_m = std::exp(uniform(0, 16)) - 1 - (i % 3 == 0 ? depth_m : 0);
      const double at_horizon = std::acos(1 / std::sqrt(dot(*point, *point))) +
                                std::acos(std::min(1.0, 6.371e6 / (6.371e6 + height_m)));
      const EcefPoint camera =
          middle.moved(std::min(at_horizon * uniform(0.98, 1.1), 3.1), uniform(0, 2 * M_PI))
              .at(height_m);
      if (!is_point_hidden(*point, camera)) continue;
      ++hidden;
      for (std::size_t j = 0; j < ground.size(); ++j) {
        const EcefPoint &a = ground[j], &b = ground[(j + 1) % ground.size()];
        const double t = uniform(0, 1);  // on an edge between two corners
        const EcefPoint target = {a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m),
                                  a.z_m + t * (b.z_m - a.z_m)};
        ASSERT_LE(least_height_m(camera, j % 2 == 0 ? a : target), -depth_m + 1e-3)
            << "width " << tile.wide_rad << ", camera at " << height_m << " m";
      }
    }
  }
  EXPECT_GT(hidden, 50);
}

TEST(HorizonPoint, HidesOnlyWhatTheEarthHides) {
  check_rays({0.0005, 0, 100}, 1);
  check_rays({0.01, 200, 4000}, 2);
  check_rays({0.2, 0, 8848}, 3);
  check_rays({1.2, 0, 8848}, 4);
}

TEST(HorizonPoint, HidesOnlyWhatGroundBelowTheEllipsoidHides) {
  check_rays({0.0005, -430, -300}, 5);
  check_rays({0.01, -105, -20}, 6);
  check_rays({0.2, -10'900, 0}, 7);
  check_rays({1.0, -430, 8848}, 8);
}

/// One point: hidden just beyond the horizon, seen just before it.
TEST(HorizonPoint, IsTightForAPoint) {
  const double longitude = 0.3, radius = kWgs84.semi_major_m;
  for (const double height_m : {0.0, 10.0, 3000.0}) {
    const EcefPoint ground = geodetic(longitude, 0, height_m);
    const EcefPoint point = *horizon_point(std::span(&ground, 1), ground, kWgs84, 0);
    for (const double eye_m : {2.0, 500.0, 12'000.0, 800'000.0}) {
      const double angle =
          std::acos(radius / (radius + height_m)) + std::acos(radius / (radius + eye_m));
      EXPECT_TRUE(is_point_hidden(point, geodetic(longitude + angle * 1.001, 0, eye_m)));
      EXPECT_FALSE(is_point_hidden(point, geodetic(longitude + angle * 0.999, 0, eye_m)));
    }
  }
}

TEST(HorizonPoint, ThereIsNoneForGroundAcrossHalfTheGlobe) {
  const std::vector<EcefPoint> wide = {geodetic(-88 * kDegree, 0, 0),
                                       geodetic(88 * kDegree, 0, 8848)};
  EXPECT_FALSE(horizon_point(wide, geodetic(0, 0, 0), kWgs84, 0).has_value());
  const std::vector<EcefPoint> less = {geodetic(-80 * kDegree, 0, 0),
                                       geodetic(80 * kDegree, 0, 8848)};
  EXPECT_TRUE(horizon_point(less, geodetic(0, 0, 0), kWgs84, 0).has_value());
}

}  // namespace
}  // namespace scarp
