#include "tiles/tileset/tile_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/geodesy/earth_frame.h"

namespace scarp {
namespace {

/// A triangle that spans so many metres at heights on the globe.
struct WideGround {
  Tin tin;
  std::vector<EcefPoint> ecef;
};

EcefPoint on_globe(double longitude_rad, double latitude_rad, double height_m) {
  const double e2 = kWgs84.flattening * (2 - kWgs84.flattening);
  const double s = std::sin(latitude_rad), c = std::cos(latitude_rad);
  const double n = kWgs84.semi_major_m / std::sqrt(1 - e2 * s * s);
  return {(n + height_m) * c * std::cos(longitude_rad),
          (n + height_m) * c * std::sin(longitude_rad), (n * (1 - e2) + height_m) * s};
}

WideGround wide_ground(std::mt19937_64& random, double wide_rad) {
  std::uniform_real_distribution<double> place(-1.4, 1.4), away(-wide_rad, wide_rad),
      height(-400, 4000);
  WideGround ground;
  ground.tin.triangles = {{0, 1, 2}};
  ground.tin.vertices.resize(3);
  const double longitude = 2 * place(random), latitude = place(random);
  for (int i = 0; i < 3; ++i)
    ground.ecef.push_back(
        on_globe(longitude + away(random), latitude + away(random), height(random)));
  return ground;
}

TEST(TileGround, HeightsBracketAllOfATriangle) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (int round = 0; round < 300; ++round) {
    const WideGround ground = wide_ground(random, round % 2 == 0 ? 0.002 : 0.05);
    const TilesetFrame frame(ground.ecef[0], ground.ecef[1]);
    const TileFacts facts = tile_facts(ground.tin, ground.ecef, frame, 1.0 / 64);
    for (int i = 0; i < 50; ++i) {
      double a = share(random), b = share(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const auto mix = [&](double EcefPoint::*axis) {
        return ground.ecef[0].*axis * (1 - a - b) + ground.ecef[1].*axis * a +
               ground.ecef[2].*axis * b;
      };
      const EcefPoint p{mix(&EcefPoint::x_m), mix(&EcefPoint::y_m), mix(&EcefPoint::z_m)};
      const double height_m = ellipsoid_normal(kWgs84, p).height_m;
      ASSERT_GE(height_m, facts.least_height_m - 1e-3);
      ASSERT_LE(height_m, facts.greatest_height_m + 1e-3);
    }
  }
}

bool holds(const TileBox& box, const TilePoint& p) {
  for (const TilePoint& axis : box.half_axes) {
    double along = 0, square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      along += axis[i] * (p[i] - box.centre[i]);
      square += axis[i] * axis[i];
    }
    if (std::abs(along) > square) return false;
  }
  return true;
}

TEST(TileGround, BoxesHoldTheirGroundAndThatOfTilesBelow) {
  std::mt19937_64 random(4);
  const WideGround first = wide_ground(random, 0.01);
  const TilesetFrame frame(first.ecef[0], first.ecef[1]);
  std::vector<TileFacts> tiles;
  std::vector<TilePoint> points;
  for (int i = 0; i < 4; ++i) {
    WideGround ground = first;
    std::uniform_real_distribution<double> shift(-20'000, 20'000);
    for (EcefPoint& p : ground.ecef) p.x_m += shift(random), p.z_m += shift(random);
    tiles.push_back(tile_facts(ground.tin, ground.ecef, frame, 1.0 / 64));
    for (const EcefPoint& p : ground.ecef) points.push_back(frame.from_ecef(p));
    for (std::size_t k = points.size() - 3; k < points.size(); ++k)
      EXPECT_TRUE(holds(tiles.back().box, points[k]));
  }
  const TileFacts all = facts_of_all(frame, tiles);
  for (const TilePoint& p : points) EXPECT_TRUE(holds(all.box, p));
  for (const TileFacts& tile : tiles) {
    EXPECT_LE(all.least_height_m, tile.least_height_m);
    EXPECT_GE(all.greatest_height_m, tile.greatest_height_m);
  }
}

TEST(TilesetFrame, ItsTransformIsTheInverse) {
  const EcefPoint centre = on_globe(2, -0.8, 300);
  const TilesetFrame frame(centre, on_globe(2.001, -0.8, 5000));
  const std::array<double, 16> m = frame.transform();
  const EcefPoint p = on_globe(2.01, -0.79, 1234);
  const TilePoint local = frame.from_ecef(p);
  const double back[3] = {p.x_m, p.y_m, p.z_m};
  for (std::size_t row = 0; row < 3; ++row)
    EXPECT_NEAR(m[row] * local[0] + m[4 + row] * local[1] + m[8 + row] * local[2] + m[12 + row],
                back[row], 1e-8);
  EXPECT_NEAR(frame.from_ecef(on_globe(2, -0.8, 310))[2], 10, 1e-8) << "z is up";
  EXPECT_GT(frame.from_ecef(on_globe(2.001, -0.8, 300))[0], 0) << "x is ahead";
}

TEST(TilesetFrame, StepsHoldEveryReach) {
  EXPECT_EQ(step_for(1), kFinestStepM);
  EXPECT_EQ(step_for(8191), kFinestStepM);
  EXPECT_EQ(step_for(8193), 2 * kFinestStepM);
  for (const double reach_m : {10.0, 15'000.0, 40'000.0, 3e6})
    EXPECT_GE(step_for(reach_m) * kFloatSteps, reach_m);
}

}  // namespace
}  // namespace scarp
