#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/skyline/crossing_kernels.h"
#include "core/skyline/skyline.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem.h"
#include "tests/support/dem_list.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

/// Horizons of samples drawn at random on whole real DEMs, in azimuths drawn at random, against the
/// judge: no bound is violated, and the estimate is near it.
void expect_bounded(const test::ListedDem& listed, const std::string& path, int azimuths,
                    std::size_t draws) {
  DemOptions options;
  if (listed.flat) options.earth = Earth::kFlat;
  options.nodata = listed.nodata;
  options.refraction = 0.13;
  if (listed.flat) options.refraction = 0;
  const Ground ground = read_ground({path}, options, {});
  const GroundGrid& grid = ground.grid;
  // Degrees taken for metres are no ground that anyone walks on.
  if (cell_side_m(grid) < kLeastCellM) GTEST_SKIP() << "cells too small";
  const auto earth = ground.dem.frame->earth_frame();
  const auto columns = static_cast<std::size_t>(grid.columns());
  const std::size_t samples = columns * static_cast<std::size_t>(grid.rows());
  std::vector<std::int16_t> estimate(samples), lower(samples), upper(samples);
  Skyline skyline(grid, earth, {});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any_azimuth(0, 2 * std::numbers::pi);
  double error_steps = 0;
  std::size_t compared = 0;
  for (int a = 0; a < azimuths; ++a) {
    const double azimuth = a == 0 ? std::numbers::pi / 4 : any_azimuth(random);
    skyline.look(fixed_azimuth(azimuth), {estimate, lower, upper, {}});
    std::vector<std::size_t> at(draws);
    for (std::size_t& i : at) i = random() % samples;
    std::vector<JudgedHorizon> judged(draws);
    parallel_for(draws, [&](std::size_t d) {
      judged[d] = judge_horizon(grid, earth, 0, static_cast<std::int32_t>(at[d] % columns),
                                static_cast<std::int32_t>(at[d] / columns), azimuth);
    });
    for (std::size_t d = 0; d < draws; ++d) {
      const std::size_t i = at[d];
      const std::string place =
          std::string(listed.name) + ", column " + std::to_string(i % columns) + ", row " +
          std::to_string(i / columns) + ", azimuth " + std::to_string(azimuth);
      if (!judged[d].is_known) {
        EXPECT_EQ(estimate[i], kUnknownElevation) << place;
        continue;
      }
      if (estimate[i] == kUnknownElevation || !judged[d].met) continue;
      const double steps = judged[d].elevation_rad * 18'000 / std::numbers::pi;
      EXPECT_LE(lower[i], steps) << place;
      EXPECT_GE(upper[i], steps) << place;
      error_steps += std::abs(estimate[i] - steps);
      ++compared;
    }
  }
  if (compared > 0) {
    EXPECT_LT(error_steps / 100 / static_cast<double>(compared), 0.05);
  }
}

class SkylineRealDems : public testing::TestWithParam<test::ListedDem> {};

TEST_P(SkylineRealDems, JudgeLiesBetweenTheBounds) {
  SCARP_SHARED_OR_SKIP(path, GetParam().file);
  const bool proving = std::getenv("SCARP_PROVE_HORIZONS") != nullptr;
  expect_bounded(GetParam(), path, proving ? 24 : 2, proving ? 500 : 25);
}

INSTANTIATE_TEST_SUITE_P(All, SkylineRealDems, testing::ValuesIn(test::kListedDems),
                         [](const testing::TestParamInfo<test::ListedDem>& listed) {
                           std::string name = listed.param.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace scarp
