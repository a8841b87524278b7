#include "core/viewshed/seen_ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "core/viewshed/viewshed.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

constexpr double kEyeM = 2, kTargetM = 0.5, kReachM = 500;

std::vector<Seen> seen_from(const GroundGrid& grid, const SamplePlace& place, double eye_m,
                            double target_m) {
  std::vector<Seen> seen(static_cast<std::size_t>(grid.columns() * grid.rows()), Seen::kHidden);
  ViewshedEye eye{grid.raised(place.column, place.row, eye_m), target_m, {}};
  eye.limits.max_distance_m = kReachM;
  view_from(grid, {}, eye, seen);
  return seen;
}

/// Looking back from all samples is looking from each place.
TEST(SeenGround, IsWhatEachPlaceSeesByItself) {
  const GroundGrid grid = test::random_ground({test::Relief::kSmooth, 24, 19, 0, 0.05, 4});
  const std::vector<SamplePlace> all = choose_samples(grid, 1'000'000, 1);
  SeenGround back(grid);
  for (const SamplePlace& place : all)
    back.add(whole_window(grid), seen_from(grid, place, kTargetM, kEyeM),
             cell_area_m2(grid, {}, place));
  const std::span<const float> areas_km2 = back.finish_km2(1);
  int some = 0;
  for (std::int32_t r = 0; r < grid.rows(); ++r) {
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      const float found = areas_km2[static_cast<std::size_t>(r * grid.columns() + c)];
      if (!grid.is_known(c, r)) {
        EXPECT_TRUE(std::isnan(found));
        continue;
      }
      const std::vector<Seen> seen = seen_from(grid, {c, r}, kEyeM, kTargetM);
      double expected_m2 = 0;
      for (const SamplePlace& place : all)
        if (seen[static_cast<std::size_t>(place.row * grid.columns() + place.column)] ==
            Seen::kVisible)
          expected_m2 += cell_area_m2(grid, {}, place);
      EXPECT_NEAR(found, expected_m2 / 1e6, 1e-7 * expected_m2 / 1e6 + 1e-9);
      some += expected_m2 > 0 && expected_m2 < 900.0 * static_cast<double>(all.size());
    }
  }
  EXPECT_GT(some, 300);
}

TEST(SeenGround, CellsOfThirtyMetresAreNineHundredSquareMetres) {
  const GroundGrid grid = test::random_ground({test::Relief::kPlane, 24, 19, 0, 0, 4});
  for (const SamplePlace& place : choose_samples(grid, 1000, 1))
    EXPECT_NEAR(cell_area_m2(grid, {}, place), 900, 0.05);  // corners are on the lattice
}

TEST(ChooseSamples, TakesKnownOnesEachOnceAndEachAsOften) {
  const GroundGrid grid = test::random_ground({test::Relief::kPlane, 20, 16, 0, 0.1, 4});
  std::vector<int> times(320, 0);
  constexpr int kDraws = 400, kCount = 80;
  std::size_t known = 0;
  for (int seed = 0; seed < kDraws; ++seed) {
    std::set<std::pair<std::int32_t, std::int32_t>> places;
    for (const SamplePlace& place :
         choose_samples(grid, kCount, static_cast<std::uint64_t>(seed))) {
      EXPECT_TRUE(grid.is_known(place.column, place.row));
      places.insert({place.column, place.row});
      ++times[static_cast<std::size_t>(place.row * 20 + place.column)];
    }
    EXPECT_EQ(places.size(), static_cast<std::size_t>(kCount));
  }
  for (std::int32_t i = 0; i < 320; ++i) known += grid.is_known(i % 20, i / 20) ? 1U : 0U;
  const double mean = static_cast<double>(kDraws) * kCount / static_cast<double>(known);
  for (std::int32_t i = 0; i < 320; ++i) {
    if (!grid.is_known(i % 20, i / 20)) continue;
    EXPECT_NEAR(times[static_cast<std::size_t>(i)], mean, 6 * std::sqrt(mean));
  }
}

}  // namespace
}  // namespace scarp
