#include "core/viewshed/sight_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ray_horizon.h"
#include "core/viewshed/view_limits.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

/// Samples placed in a frame around a point on the equator of a sphere: column by column eastwards.
/// height(column, row) is above the sphere, metres.
template <class Height>
SampleGrid on_sphere(const EarthFrame& earth, std::int32_t columns, std::int32_t rows,
                     double cell_m, Height height) {
  SampleGrid grid;
  grid.columns = columns;
  grid.rows = rows;
  for (std::int32_t r = 0; r < rows; ++r) {
    for (std::int32_t c = 0; c < columns; ++c) {
      const double longitude = (c - columns / 2) * cell_m / earth.semi_major_m;
      const double latitude = (rows / 2 - r) * cell_m / earth.semi_major_m;
      const double radius_m = earth.semi_major_m + height(c, r);
      grid.positions.push_back(round_to_lattice(earth.frame.flatten(
          {radius_m * std::cos(latitude) * std::cos(longitude),
           radius_m * std::cos(latitude) * std::sin(longitude), radius_m * std::sin(latitude)})));
      grid.known.push_back(1);
    }
  }
  return grid;
}

EarthFrame sphere(double refraction = 0) {
  return {Flattening({kEarthRadiusM, 0, 0}, refraction), kEarthRadiusM, 0};
}

/// An eye above the middle sample and its horizon eastwards, as elevation and distance.
struct Highest {
  double elevation_rad, distance_m;
};
Highest look_east(const SampleGrid& samples, const EarthFrame& earth, double eye_m) {
  const GroundGrid grid(samples);
  const Position eye = round_to_lattice(earth.frame.flatten({kEarthRadiusM + eye_m, 0, 0}));
  const Position end{eye.x_m + 1e6, eye.y_m, eye.z_m};
  const auto horizon = ray_horizon(eye, end, GridSight(grid, eye).ground_along(end));
  EXPECT_TRUE(horizon);
  const EyeBearings bearings(eye, earth);
  return {bearings.apparent_pitch_rad(horizon->place), bearings.to(horizon->place).distance_m};
}

TEST(RayHorizon, WallOfAThousandMetresAtFiveKilometres) {
  const EarthFrame earth = sphere();
  const auto wall = [](std::int32_t c, std::int32_t) { return c == 200 + 50 ? 1000.0 : 0.0; };
  const Highest seen = look_east(on_sphere(earth, 401, 5, 100, wall), earth, 0);
  // On the sphere: the wall's top above the eye's level plane, and along it.
  const double angle = 5000 / kEarthRadiusM, top_m = kEarthRadiusM + 1000;
  const double expected =
      std::atan2(top_m * std::cos(angle) - kEarthRadiusM, top_m * std::sin(angle));
  EXPECT_NEAR(seen.elevation_rad, expected, 1e-6);
  EXPECT_GT(seen.elevation_rad, 0.1967);
  EXPECT_LT(seen.elevation_rad, 0.1971);
  EXPECT_NEAR(seen.distance_m, 5000, 0.01);
}

TEST(RayHorizon, SeaHorizonDipsAndRefractionLiftsIt) {
  const auto sea = [](std::int32_t, std::int32_t) { return 0.0; };
  for (const double eye_m : {20.0, 150.0, 400.0}) {
    for (const double k : {0.0, 0.13, 0.25}) {
      const EarthFrame earth = sphere(k);
      const Highest seen = look_east(on_sphere(earth, 1801, 3, 100, sea), earth, eye_m);
      // The effective radius is R / (1 - k); the sea's samples err by the square of half a cell.
      const double radius_m = kEarthRadiusM / (1 - k);
      const double dip = std::sqrt(2 * eye_m * (1 - k) / kEarthRadiusM);
      EXPECT_NEAR(seen.elevation_rad, -dip, 2e-3 * dip) << eye_m << ' ' << k;
      EXPECT_NEAR(seen.distance_m, std::sqrt(2 * radius_m * eye_m), 200) << eye_m << ' ' << k;
    }
  }
}

TEST(RayHorizon, CliffIsSeenAtItsEdge) {
  const EarthFrame earth = sphere();
  // High ground up to 600 m from the eye, then far below.
  const auto cliff = [](std::int32_t c, std::int32_t) { return c <= 106 ? 100.0 : 0.0; };
  const Highest seen = look_east(on_sphere(earth, 201, 3, 100, cliff), earth, 102);
  EXPECT_NEAR(seen.distance_m, 600, 0.02);
  EXPECT_NEAR(seen.elevation_rad, -2.0 / 600, 5e-5);
}

TEST(RayHorizon, IsTheHighestOfAllTargetsOnTheRay) {
  const GroundGrid grid = test::random_ground({test::Relief::kSmooth, 40, 36, 1.5, 0.05, 9});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  for (int i = 0; i < 100; ++i) {
    Position eye = grid.at(12 + i % 15, 9 + i % 11);
    eye.z_m += 2;
    const double direction = turn(random);
    const Position end = ray_end(eye, direction, 3000);
    const auto along = GridSight(grid, eye).ground_along(end);
    const auto horizon = ray_horizon(eye, end, along);
    ASSERT_TRUE(horizon);
    // A line over the horizon by a hand's breadth is free all the way, one under it is not.
    const double run_m = std::hypot(horizon->place.x_m - eye.x_m, horizon->place.y_m - eye.y_m);
    const double slope = (horizon->place.z_m - eye.z_m) / run_m;
    const auto sight = [&](double more) {
      Position target = end;
      target.z_m = round_to_lattice(eye.z_m + (slope + more) *
                                                  std::hypot(end.x_m - eye.x_m, end.y_m - eye.y_m));
      return GridSight(grid, eye).judge(target);
    };
    EXPECT_NE(sight(1e-6), Seen::kHidden);
    EXPECT_EQ(sight(-1e-6), Seen::kHidden);
  }
}

TEST(RayHorizon, RaysEndWithinTheLattice) {
  const Position eye{1.2e8, -3, 7};
  const Position back = ray_end(eye, M_PI, 1.2e8), away = ray_end(eye, 0, 1.2e8);
  EXPECT_NEAR(back.x_m, 0, 1);
  EXPECT_EQ(away.x_m, kLatticeReachM);
  EXPECT_EQ(away.y_m, -3);
  const Position near = ray_end({5, 6, 7}, M_PI / 2, 100);
  EXPECT_EQ(near, (Position{5, 106, 7}));
}

TEST(SightProfile, ClearanceAndFresnelZoneOfALevelLine) {
  const EarthFrame earth = sphere();
  const auto hill = [](std::int32_t c, std::int32_t) { return c == 100 ? 50.0 : 0.0; };
  const SampleGrid samples = on_sphere(earth, 201, 3, 100, hill);
  const GroundGrid grid(samples);
  // 10 km from mast to mast, each 80 m high, the hill halfway.
  const auto mast = [&](double east_m) {
    const double angle = east_m / kEarthRadiusM, radius_m = kEarthRadiusM + 80;
    return round_to_lattice(
        earth.frame.flatten({radius_m * std::cos(angle), radius_m * std::sin(angle), 0}));
  };
  const Position a = mast(-5000), b = mast(5000);
  const auto profile =
      sight_profile(a, b, GridSight(grid, a).ground_along(b), earth, 299'792'458 / 5.8e9);
  ASSERT_EQ(profile.size(), 99U);
  const ProfilePoint& top = profile[49];
  // In the middle the chord has sunk by the sagitta, 10 km^2 / 8 R = 1.962 m.
  EXPECT_NEAR(top.clearance_m, 30 - 1.962, 0.002);
  EXPECT_NEAR(top.distance_m, 5000, 0.01);
  EXPECT_NEAR(top.fresnel_radius_m, std::sqrt(0.05168835 * 5000 * 5000 / 10'000), 0.001);
  EXPECT_NEAR(top.fresnel_ratio(), 28.038 / 11.367, 0.001);
  EXPECT_NEAR(profile[0].clearance_m, 80 - 0.0777, 0.002);
  for (const ProfilePoint& p : profile) EXPECT_FALSE(p.blocks);
}

TEST(LeastFreeHeight, IsFreeThereAndNotOneStepLower) {
  int raised = 0;
  for (const test::Relief relief :
       {test::Relief::kRough, test::Relief::kSmooth, test::Relief::kSpikes, test::Relief::kWalls}) {
    const GroundGrid grid = test::random_ground({relief, 24, 20, 1.5, 0, 2});
    std::mt19937 random(1);
    std::uniform_int_distribution<std::int32_t> column(0, 23), row(0, 19);
    for (int i = 0; i < 60; ++i) {
      const Position foot = grid.at(column(random), row(random));
      const Position target = grid.at(column(random), row(random));
      if (foot.x_m == target.x_m && foot.y_m == target.y_m) continue;
      const auto is_free = [&](double height_m) {
        return GridSight(grid, {foot.x_m, foot.y_m, foot.z_m + height_m}).judge(target) !=
               Seen::kHidden;
      };
      const auto least_m = least_free_height_m(is_free);
      if (!least_m) {
        EXPECT_FALSE(is_free(kGreatestFreeHeightM));
        continue;
      }
      EXPECT_TRUE(is_free(*least_m));
      if (*least_m > 0) {
        EXPECT_FALSE(is_free(*least_m - kLatticeStepM));
        ++raised;
      }
      // The same from the crossings: the highest of the lines from the target over the ground.
      double needed_m = 0;
      for (const GroundCrossing& c : GridSight(grid, foot).ground_along(target).crossings) {
        const double f = to_double(c.at);
        needed_m = std::max(needed_m, (c.ground_z_m - f * target.z_m) / (1 - f) - foot.z_m);
      }
      EXPECT_NEAR(*least_m, needed_m, 1.01 * kLatticeStepM);
    }
  }
  EXPECT_GT(raised, 100);
}

TEST(LeastFreeHeight, NothingWhereNoHeightHelps) {
  EXPECT_FALSE(least_free_height_m([](double) { return false; }));
  EXPECT_EQ(least_free_height_m([](double) { return true; }), 0);
}

}  // namespace
}  // namespace scarp
