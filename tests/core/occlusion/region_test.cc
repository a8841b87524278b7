#include "core/occlusion/region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/exact_region.h"

namespace scarp {
namespace {

constexpr SectorAxis kEast{1, 0};

/// A vertex with the horizon that its region was made from.
struct Sight {
  Position vertex;
  Position horizon;
};

Region merged(const RegionView& a, const RegionView& b) {
  Region result;
  merge_regions(a, b, result);
  return result;
}

std::vector<Region> regions_of(const std::vector<Sight>& sights, const SectorAxis& axis) {
  std::vector<Region> regions;
  for (const Sight& sight : sights) {
    const RayRegion ray = region_of_vertex(sight.vertex, sight.horizon, axis);
    regions.push_back({{ray.start}, ray.slope});
  }
  return regions;
}

Region merge_all(const std::vector<Region>& regions) {
  Region all = regions[0];
  for (std::size_t i = 1; i < regions.size(); ++i) all = merged(all.view(), regions[i].view());
  return all;
}

/// The same by halves, so that polylines with many points meet.
Region merge_halves(const std::vector<Region>& regions) {
  if (regions.size() == 1) return regions[0];
  const auto middle = regions.begin() + static_cast<std::ptrdiff_t>(regions.size() / 2);
  return merged(merge_halves({regions.begin(), middle}).view(),
                merge_halves({middle, regions.end()}).view());
}

std::optional<std::string> check_one(const Region& region) {
  Regions regions;
  regions.layout.count = 1;
  regions.first = {0, static_cast<std::uint32_t>(region.points.size())};
  regions.points = region.points;
  regions.end_slope = {region.end_slope};
  return check_regions(regions, 1);
}

/// Vertices around a place far from the origin, horizons ahead of them in a random sector.
struct RandomSights {
  explicit RandomSights(std::uint64_t seed) : random(seed) {
    const std::int32_t count = 4 + static_cast<std::int32_t>(random() % 30);
    axis =
        sector_axis({count, 1}, static_cast<std::int32_t>(random() % static_cast<unsigned>(count)));
    const double reach_m = std::exp(uniform(0, 17));
    const double middle_x_m = uniform(-reach_m, reach_m), middle_y_m = uniform(-reach_m, reach_m);
    const std::size_t n = 1 + random() % 12;
    for (std::size_t i = 0; i < n; ++i) {
      const Position vertex = round_to_lattice(
          {middle_x_m + uniform(-50, 50), middle_y_m + uniform(-50, 50), uniform(-20, 20)});
      const double run_m = std::exp(uniform(-7, 8)), aside_m = run_m * uniform(-0.05, 0.05);
      const Position horizon = round_to_lattice({vertex.x_m + axis.x * run_m - axis.y * aside_m,
                                                 vertex.y_m + axis.y * run_m + axis.x * aside_m,
                                                 vertex.z_m + run_m * uniform(-1, 1)});
      // Rounding to the lattice may have moved a near one out of the sector.
      const double dx_m = horizon.x_m - vertex.x_m, dy_m = horizon.y_m - vertex.y_m;
      if (axis.x * dx_m + axis.y * dy_m > 0.71 * std::hypot(dx_m, dy_m))
        sights.push_back({vertex, horizon});
    }
    if (sights.empty())
      sights.push_back({{0, 0, 0}, {axis.x > 0 ? 8.0 : -8.0, axis.y > 0 ? 8.0 : -8.0, 1}});
  }

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }

  /// A camera at about u_m, off the axis as far as its coordinates force it.
  Position camera_at(double u_m, double z_m) {
    return round_to_lattice({axis.x * u_m, axis.y * u_m, z_m});
  }

  bool truly_hidden(const Position& camera, double margin_m) const {
    return std::all_of(sights.begin(), sights.end(), [&](const Sight& s) {
      return exactly_hidden(s.vertex, s.horizon, axis, camera, margin_m);
    });
  }

  std::mt19937_64 random;
  SectorAxis axis;
  std::vector<Sight> sights;
};

TEST(Region, OfOneVertexLiesBeyondItsHorizonAndUnderTheRay) {
  const RayRegion region = region_of_vertex({0, 0, 0}, {10, 0, 5}, kEast);
  EXPECT_TRUE(hides(region.view(), 20, 9.99999));
  EXPECT_FALSE(hides(region.view(), 20, 10));  // on the ray: seen
  EXPECT_FALSE(hides(region.view(), 9.99999, -100));
  EXPECT_TRUE(hides(region.view(), 10.00001, 4.99999));
  EXPECT_TRUE(hides(region.view(), 1e8, 4.9999999e7));
  EXPECT_FALSE(hides(region.view(), 1e8, 5.0000001e7));
}

TEST(Region, MeasuresAlongTheAxisFromTheOrigin) {
  const SectorAxis north{0, 1};
  const RayRegion region = region_of_vertex({7, 1000, 0}, {7, 1010, -5}, north);
  EXPECT_TRUE(hides(region.view(), distance_along(north, {-3, 1020, 0}), -10.00001));
  EXPECT_FALSE(hides(region.view(), distance_along(north, {-3, 1020, 0}), -9.99999));
}

TEST(Region, NothingIsHiddenByAnEmptyOne) {
  const Region empty;
  const RayRegion ray = region_of_vertex({0, 0, 0}, {10, 0, 5}, kEast);
  EXPECT_FALSE(hides(empty.view(), 100, -100));
  EXPECT_TRUE(merged(empty.view(), ray.view()).points.empty());
  EXPECT_TRUE(merged(ray.view(), empty.view()).points.empty());
}

TEST(Region, IntersectionStartsWhereBothHaveAndFollowsTheLowerRay) {
  // Rays z = u / 2 from 10 on and z = 20 - (u - 20) / 4 from 20 on cross at (40 / 3 + 20, 50 / 3).
  const RayRegion rising = region_of_vertex({0, 0, 0}, {10, 0, 5}, kEast);
  const RayRegion falling = region_of_vertex({0, 0, 25}, {20, 0, 20}, kEast);
  const Region both = merged(rising.view(), falling.view());
  ASSERT_EQ(both.points.size(), 2U);
  EXPECT_NEAR(both.points[0].u_m, 20, 1e-6);
  EXPECT_NEAR(both.points[0].z_m, 10, 1e-6);
  EXPECT_NEAR(both.points[1].u_m, 100.0 / 3, 1e-6);
  EXPECT_NEAR(both.points[1].z_m, 50.0 / 3, 1e-6);
  EXPECT_NEAR(both.end_slope, -0.25, 1e-9);
  EXPECT_TRUE(hides(both.view(), 40, 14.9999));
  EXPECT_FALSE(hides(both.view(), 40, 15));
}

TEST(Region, MergingWithItselfChangesNothing) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomSights scene(seed);
    const Region region = merge_all(regions_of(scene.sights, scene.axis));
    const Region twice = merged(region.view(), region.view());
    ASSERT_EQ(twice.points.size(), region.points.size()) << "seed " << seed;
    for (std::size_t i = 0; i < region.points.size(); ++i) {
      EXPECT_EQ(twice.points[i].u_m, region.points[i].u_m) << "seed " << seed;
      EXPECT_EQ(twice.points[i].z_m, region.points[i].z_m) << "seed " << seed;
    }
    EXPECT_EQ(twice.end_slope, region.end_slope);
  }
}

/// Cameras on the border itself and a hair beside it, compared without rounding.
TEST(Region, NeverHidesWhatOneRayDoesNotAndMissesNothingClear) {
  int hidden = 0, seen = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    RandomSights scene(seed);
    std::vector<Region> rays = regions_of(scene.sights, scene.axis);
    std::vector<Region> results = {merge_all(rays), merge_halves(rays)};
    std::shuffle(rays.begin(), rays.end(), scene.random);
    results.push_back(merge_all(rays));
    results.push_back(merge_halves(rays));
    for (const Region& region : results) {
      ASSERT_EQ(check_one(region), std::nullopt) << "seed " << seed;
      const double start_m = region.points[0].u_m;
      for (int i = 0; i < 12; ++i) {
        const RegionPoint& point = region.points[scene.random() % region.points.size()];
        const double past_m = i % 3 == 0 ? 0 : std::exp(scene.uniform(-10, 8));
        const double u_m = std::max(start_m, point.u_m) + past_m;
        const double above_m =
            i % 2 == 0 ? 0 : scene.uniform(-1, 1) * std::exp(scene.uniform(-8, 3));
        const Position camera = scene.camera_at(u_m, region_height_m(region.view(), u_m) + above_m);
        const bool answer = hides(region.view(), distance_along(scene.axis, camera), camera.z_m);
        (answer ? hidden : seen)++;
        if (answer) ASSERT_TRUE(scene.truly_hidden(camera, 0)) << "seed " << seed;
        // Steepest slope 1 / 0.7, shift 0.24 um, and magnitudes up to 2e8 times 2^-50 a merge.
        else
          ASSERT_FALSE(scene.truly_hidden(camera, 1e-5)) << "seed " << seed;
      }
    }
  }
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(seen, 1000);
}

/// The polyline and the cameras' own z are far finer than the lattice here: one ulp decides.
TEST(Region, SideHoldsToTheLastBit) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    RandomSights scene(seed);
    const Region region = merge_halves(regions_of(scene.sights, scene.axis));
    for (int i = 0; i < 10; ++i) {
      Position camera = scene.camera_at(region.points[0].u_m + std::exp(scene.uniform(-8, 9)), 0);
      const double u_m = distance_along(scene.axis, camera);
      if (u_m < region.points[0].u_m) continue;
      camera.z_m = std::nextafter(region_height_m(region.view(), u_m), -HUGE_VAL);
      ASSERT_TRUE(hides(region.view(), u_m, camera.z_m));
      ASSERT_TRUE(scene.truly_hidden(camera, 0)) << "seed " << seed;
    }
  }
}

TEST(Region, CheckNamesTheFirstBrokenInvariant) {
  EXPECT_EQ(check_one({{{0, 0}, {1, 1}, {2, 1.5}}, 0.25}), std::nullopt);
  EXPECT_EQ(check_one({{{0, 0}, {1, 1}, {2, 2}}, 0.25}),
            "the region of node 0 in sector 0 is not concave");
  EXPECT_EQ(check_one({{{0, 0}, {1, 1}}, 2}), "the region of node 0 in sector 0 is not concave");
  EXPECT_EQ(check_one({{{0, 0}, {0, -1}}, -2}),
            "the region of node 0 in sector 0 does not rise in u");
  EXPECT_EQ(check_one({{{0, std::nan("")}}, -2}), "the region of node 0 in sector 0 is not finite");
  EXPECT_EQ(check_one({{{0, 0}}, HUGE_VAL}),
            "the region of node 0 in sector 0 has a slope that is no number");
  Regions missing;
  EXPECT_EQ(check_regions(missing, 1), "a region is missing");
}

}  // namespace
}  // namespace scarp
