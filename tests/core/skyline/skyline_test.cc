#include "core/skyline/skyline.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "core/geodesy/sun.h"
#include "core/skyline/crossing_kernels.h"
#include "core/skyline/sky_view.h"
#include "core/threads/parallel_for.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kStepsPerRad = 18'000 / std::numbers::pi;

struct Found {
  std::vector<std::int16_t> estimate, lower, upper;
  std::vector<float> distance_m;
};

Found look(const GroundGrid& grid, double azimuth_rad, const SkylineOptions& options = {},
           bool measures = false) {
  const auto samples =
      static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows());
  Found found{std::vector<std::int16_t>(samples), std::vector<std::int16_t>(samples),
              std::vector<std::int16_t>(samples), std::vector<float>(measures ? samples : 0)};
  Skyline(grid, {}, options)
      .look(fixed_azimuth(azimuth_rad),
            {found.estimate, found.lower, found.upper, found.distance_m});
  return found;
}

/// Flat ground on exact lattice places.
GroundGrid ground_of(std::int32_t columns, std::int32_t rows, double cell_m,
                     const std::function<double(std::int32_t, std::int32_t)>& height_m) {
  SeparablePlacement placement;
  for (std::int32_t c = 0; c < columns; ++c) placement.x_of_column_m.push_back(c * cell_m);
  for (std::int32_t r = 0; r < rows; ++r) placement.y_of_row_m.push_back(-r * cell_m);
  GroundGrid grid(columns, rows, placement);
  for (std::int32_t r = 0; r < rows; ++r)
    for (std::int32_t c = 0; c < columns; ++c)
      if (const double h = height_m(c, r); !std::isnan(h)) grid.set_z(c, r, h);
  return grid;
}

/// What a comparison of all samples with the judge came to.
struct Comparison {
  std::size_t compared = 0, unknown_needlessly = 0;
  double error_deg = 0;  ///< sum
};

/// Every sample in an azimuth (every n-th in both ways): the judge lies between the bounds, and
/// where it does not know, neither do they.
Comparison expect_bounded(const GroundGrid& grid, double azimuth_rad, const SkylineOptions& options,
                          const std::string& what, std::int32_t every = 1) {
  const Found found = look(grid, azimuth_rad, options);
  Comparison comparison;
  for (std::int32_t r = 0; r < grid.rows(); r += every) {
    for (std::int32_t c = 0; c < grid.columns(); c += every) {
      const std::size_t i = static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.columns()) +
                            static_cast<std::size_t>(c);
      const JudgedHorizon judged = judge_horizon(grid, {}, options.eye_height_m, c, r, azimuth_rad);
      const auto place = [&] {
        return what + ", azimuth " + std::to_string(azimuth_rad * 360 / kTurn) + ", column " +
               std::to_string(c) + ", row " + std::to_string(r);
      };
      if (!judged.is_known) {
        EXPECT_EQ(found.estimate[i], kUnknownElevation) << place();
        continue;
      }
      if (found.estimate[i] == kUnknownElevation) {
        ++comparison.unknown_needlessly;
        continue;
      }
      ++comparison.compared;
      EXPECT_LE(found.lower[i], found.estimate[i]) << place();
      EXPECT_LE(found.estimate[i], found.upper[i]) << place();
      if (!judged.met) {
        EXPECT_EQ(found.lower[i], kNothingSeen) << place();
        continue;
      }
      const double steps = judged.elevation_rad * kStepsPerRad;
      EXPECT_LE(found.lower[i], steps + 1e-9) << place();
      EXPECT_GE(found.upper[i], steps - 1e-9) << place();
      comparison.error_deg += std::abs(found.estimate[i] - steps) / 100;
    }
  }
  return comparison;
}

TEST(Skyline, BoundsHoldOnEveryRelief) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any_azimuth(0, kTurn);
  Comparison all;
  for (int relief = 0; relief < static_cast<int>(test::Relief::kCount); ++relief) {
    for (const auto& [columns, rows] :
         {std::pair(24, 20), std::pair(70, 9), std::pair(2, 2), std::pair(3, 40)}) {
      test::GroundRecipe recipe;
      recipe.relief = static_cast<test::Relief>(relief);
      recipe.columns = columns;
      recipe.rows = rows;
      recipe.seed = static_cast<std::uint32_t>(relief + 1);
      const GroundGrid grid = test::random_ground(recipe);
      for (int i = 0; i < 8; ++i) {
        const double azimuth = i < 4 ? any_azimuth(random) : (i - 4) * kTurn / 8;
        const Comparison one =
            expect_bounded(grid, azimuth, {}, "relief " + std::to_string(relief));
        all.compared += one.compared;
        all.error_deg += one.error_deg;
        EXPECT_EQ(one.unknown_needlessly, 0U);
      }
    }
  }
  EXPECT_GT(all.compared, 50'000U);
  EXPECT_LT(all.error_deg / static_cast<double>(all.compared), 0.05);
}

/// Large enough for squares of several sizes.
TEST(Skyline, BoundsHoldFarAway) {
  std::mt19937 random(11);
  const GroundGrid grid = ground_of(300, 210, 30, [&](std::int32_t c, std::int32_t r) {
    return test::relief_height_m(test::Relief::kSmooth, c, r, random) * (1 + 0.01 * c);
  });
  Comparison all;
  for (const double azimuth_deg : {0.0, 33.3, 45.0, 90.0, 121.0, 180.0, 200.5, 270.0, 359.9}) {
    const Comparison one = expect_bounded(grid, azimuth_deg * kTurn / 360, {}, "smooth", 7);
    all.compared += one.compared;
    all.error_deg += one.error_deg;
  }
  EXPECT_LT(all.error_deg / static_cast<double>(all.compared), 0.05);
}

TEST(Skyline, BoundsDifferByTheToleranceAndRoundingAtMost) {
  std::mt19937 random(3);
  const GroundGrid grid = ground_of(200, 150, 30, [&](std::int32_t c, std::int32_t r) {
    return test::relief_height_m(test::Relief::kSmooth, c, r, random);
  });
  for (const double tolerance_deg : {0.0, 0.1, 1.0}) {
    SkylineOptions options;
    options.tolerance_rad = tolerance_deg * kTurn / 360;
    const Found found = look(grid, 0.7, options);
    int widest = 0;
    for (std::size_t i = 0; i < found.lower.size(); ++i)
      if (found.lower[i] != kNothingSeen)
        widest = std::max(widest, found.upper[i] - found.lower[i]);
    EXPECT_LE(widest, 100 * tolerance_deg + 4) << tolerance_deg;
  }
}

TEST(Skyline, VoidMakesWhatLiesBehindUnknown) {
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    test::GroundRecipe recipe;
    recipe.columns = 60;
    recipe.rows = 50;
    recipe.void_share = 0.01;
    recipe.seed = seed;
    const GroundGrid grid = test::random_ground(recipe);
    std::size_t compared = 0, needlessly = 0;
    for (const double azimuth : {0.3, 1.9, 3.5, 5.1, kTurn / 8, kTurn / 4}) {
      const Comparison one = expect_bounded(grid, azimuth, {}, "void");
      compared += one.compared;
      needlessly += one.unknown_needlessly;
    }
    EXPECT_GT(compared, 2000U);
    // Only where a ray passes beside void or leaves the data behind it.
    EXPECT_LT(needlessly, compared / 5);
  }
}

TEST(Skyline, EyesStandAboveGround) {
  std::mt19937 random(5);
  const GroundGrid grid = ground_of(40, 40, 10, [&](std::int32_t c, std::int32_t r) {
    return test::relief_height_m(test::Relief::kRough, c, r, random);
  });
  SkylineOptions options;
  options.eye_height_m = 25;
  EXPECT_GT(expect_bounded(grid, 2.2, options, "25 m up").compared, 1000U);
}

// Closed forms.

TEST(Skyline, OfATiltedPlaneIsItsSlope) {
  const GroundGrid grid =
      ground_of(50, 40, 10, [](std::int32_t c, std::int32_t) { return 2.5 * c; });
  const auto rise = static_cast<int>(std::lround(std::atan(0.25) * kStepsPerRad));
  const Found east = look(grid, kTurn / 4), west = look(grid, 3 * kTurn / 4);
  const Found north = look(grid, 0);
  for (std::size_t i = 0; i < east.estimate.size(); ++i) {
    EXPECT_NEAR(east.estimate[i], i % 50 == 49 ? kNothingSeen : rise, 1);
    EXPECT_NEAR(west.estimate[i], i % 50 == 0 ? kNothingSeen : -rise, 1);
    EXPECT_NEAR(north.estimate[i], i < 50 ? kNothingSeen : 0, 1);
  }
}

TEST(Skyline, OfAConeIsItsTop) {
  constexpr int kSide = 121, kMiddle = 60;
  constexpr double kTopM = 200, kFall = 0.5, kCellM = 10;
  const GroundGrid grid = ground_of(kSide, kSide, kCellM, [](std::int32_t c, std::int32_t r) {
    return std::max(0.0, kTopM - kFall * kCellM * std::hypot(c - kMiddle, r - kMiddle));
  });
  const Found south = look(grid, kTurn / 2);
  const auto at = [](int c, int r) { return static_cast<std::size_t>(r * kSide + c); };
  // On the cone its own slope, on the plain before it the top.
  EXPECT_NEAR(south.estimate[at(kMiddle, 30)], std::atan(0.5) * kStepsPerRad, 1);
  EXPECT_NEAR(south.estimate[at(kMiddle, 10)], std::atan(200.0 / 500) * kStepsPerRad, 1);
  EXPECT_NEAR(south.estimate[at(kMiddle, kMiddle)], -std::atan(200.0 / 600) * kStepsPerRad, 1);
  // From a plain beside it, past the cone: level.
  EXPECT_NEAR(south.estimate[at(0, 10)], 0, 1);
}

TEST(Skyline, ARidgeARowOfSpikesAndAPit) {
  const GroundGrid ridge =
      ground_of(90, 60, 25, [](std::int32_t c, std::int32_t) { return c == 70 ? 100.0 : 0.0; });
  const Found east = look(ridge, kTurn / 4, {}, true);
  EXPECT_NEAR(east.estimate[10], std::atan(100.0 / (60 * 25)) * kStepsPerRad, 1);
  EXPECT_NEAR(east.distance_m[10], 60 * 25, 1);
  EXPECT_EQ(east.estimate[80], 0);

  const GroundGrid spike = ground_of(
      90, 60, 25, [](std::int32_t c, std::int32_t r) { return c == 70 && r == 30 ? 100.0 : 0.0; });
  const Found at_spike = look(spike, kTurn / 4);
  EXPECT_NEAR(at_spike.estimate[30 * 90 + 10], std::atan(100.0 / (60 * 25)) * kStepsPerRad, 1);
  EXPECT_NEAR(at_spike.estimate[28 * 90 + 10], 0, 1);

  const GroundGrid pit = ground_of(
      41, 41, 25, [](std::int32_t c, std::int32_t r) { return c == 20 && r == 20 ? -25.0 : 0.0; });
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(look(pit, i * kTurn / 4).estimate[20 * 41 + 20], 4500, 1);
}

// The same bits whatever they are computed with.

TEST(Skyline, SameBitsForAnyThreadsAndInstructionSet) {
  test::GroundRecipe recipe;
  recipe.relief = test::Relief::kSmooth;
  recipe.columns = 330;
  recipe.rows = 150;
  recipe.void_share = 0.002;
  const GroundGrid grid = test::random_ground(recipe);
  for (const double azimuth : {0.4, 2.0, kTurn / 8}) {
    const Found first = look(grid, azimuth, {}, true);
    const auto expect_same = [&](const std::string& what) {
      const Found again = look(grid, azimuth, {}, true);
      EXPECT_EQ(first.estimate, again.estimate) << what;
      EXPECT_EQ(first.lower, again.lower) << what;
      EXPECT_EQ(first.upper, again.upper) << what;
      const bool same =
          std::equal(first.distance_m.begin(), first.distance_m.end(), again.distance_m.begin(),
                     [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); });
      EXPECT_TRUE(same) << what;
    };
    for (const int threads : {1, 3, 5}) {
      set_thread_count(threads);
      expect_same(std::to_string(threads) + " threads");
    }
    set_thread_count(0);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      expect_same(hwy::TargetName(target));
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

// What is made of horizons.

TEST(CastShadow, OfAWallReachesAsFarAsItsHeightAsks) {
  const GroundGrid grid =
      ground_of(80, 30, 10, [](std::int32_t c, std::int32_t) { return c == 40 ? 50.0 : 0.0; });
  std::vector<Sunlight> light(80 * 30);
  // From the west, so that 50 m throw a shadow of 125 m; refraction raises the sun by 0.04 degree.
  const double elevation = std::atan(0.4);
  cast_shadow(grid, {}, {-std::cos(elevation), 0, std::sin(elevation)}, light);
  for (int c = 0; c < 80; ++c)
    EXPECT_EQ(light[15 * 80 + static_cast<std::size_t>(c)],
              c > 40 && c <= 52 ? Sunlight::kShadow : Sunlight::kLit)
        << c;
}

/// On a plain of small waves most samples see the sun near their horizon.
TEST(CastShadow, IsWhatTheJudgeSays) {
  std::mt19937 random(2);
  const GroundGrid grid = ground_of(60, 50, 30, [&](std::int32_t, std::int32_t) {
    return std::uniform_real_distribution<double>(0, 0.05)(random);
  });
  const double elevation = -0.0095, azimuth = 1.1;  // raised to about 0.0004
  std::vector<Sunlight> light(60 * 50);
  const std::size_t by_judge =
      cast_shadow(grid, {},
                  {std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
                   std::sin(elevation)},
                  light);
  EXPECT_GT(by_judge, 20U);
  std::size_t lit = 0, shadow = 0;
  for (std::int32_t r = 0; r < 50; ++r) {
    for (std::int32_t c = 0; c < 60; ++c) {
      const JudgedHorizon judged = judge_horizon(grid, {}, 0, c, r, azimuth);
      const bool is_lit = !judged.met || judged.elevation_rad <= refracted_elevation_rad(elevation);
      EXPECT_EQ(light[static_cast<std::size_t>(r * 60 + c)],
                is_lit ? Sunlight::kLit : Sunlight::kShadow)
          << c << ' ' << r;
      ++(is_lit ? lit : shadow);
    }
  }
  EXPECT_GT(lit, 100U);
  EXPECT_GT(shadow, 100U);
}

TEST(CastShadow, NoneWhereTheSunIsUpAndAllWhereItIsDown) {
  const GroundGrid grid = ground_of(20, 20, 10, [](std::int32_t, std::int32_t) { return 0.0; });
  std::vector<Sunlight> light(400);
  cast_shadow(grid, {}, {0, 0, 1}, light);
  EXPECT_EQ(std::count(light.begin(), light.end(), Sunlight::kLit), 400);
  cast_shadow(grid, {}, {0, 0.8, -0.6}, light);
  // Those at the border have no ground before them.
  EXPECT_EQ(std::count(light.begin(), light.end(), Sunlight::kShadow), 380);
}

TEST(SkyView, OfEqualHorizons) {
  SkyView sky(3, 1, true, true);
  for (int i = 0; i < 4; ++i) {
    const std::vector<std::int16_t> elevations = {3000, -500,
                                                  i == 2 ? kUnknownElevation : kNothingSeen};
    sky.begin_azimuth();
    // In two parts, as they come.
    sky.add({0, 0, 2, 1, std::span(elevations).first(2), {}, {}, {}});
    sky.add({2, 0, 1, 1, std::span(elevations).last(1), {}, {}, {}});
  }
  EXPECT_NEAR(sky.sky_view()[0], 0.75, 1e-6);
  EXPECT_NEAR(sky.sky_view()[1], 1, 1e-6);
  EXPECT_TRUE(std::isnan(sky.sky_view()[2]));
  EXPECT_NEAR(sky.openness_deg()[0], 60, 1e-4);
  EXPECT_NEAR(sky.openness_deg()[1], 95, 1e-4);
  EXPECT_TRUE(std::isnan(sky.openness_deg()[2]));
}

/// Openness of a sample, up or down, from as many azimuths.
double openness_deg(const GroundGrid& grid, Sight sight, std::int32_t column, std::int32_t row,
                    int azimuths = 16) {
  SkylineOptions options;
  options.sight = sight;
  Skyline skyline(grid, {}, options);
  SkyView view(grid.columns(), grid.rows(), false, true);
  for (int i = 0; i < azimuths; ++i) {
    view.begin_azimuth();
    skyline.look(fixed_azimuth(i * kTurn / azimuths), false,
                 [&](const SkylinePart& part) { view.add(part); });
  }
  return view.openness_deg()[static_cast<std::size_t>(row * grid.columns() + column)];
}

TEST(Openness, OfAPlaneIsARightAngleHoweverItTilts) {
  for (const double rise_m : {0.0, 4.0}) {
    const GroundGrid plane = ground_of(
        41, 41, 10, [&](std::int32_t c, std::int32_t r) { return rise_m * c + rise_m / 2 * r; });
    for (const Sight sight : {Sight::kUp, Sight::kDown})
      EXPECT_NEAR(openness_deg(plane, sight, 20, 20), 90, 0.02) << rise_m;
  }
}

TEST(Openness, OfAConeAndOfAPitAreEachOthersMirror) {
  // A cone of 45 degrees on a plain, 200 m high, seen from its top: up to the plain's border,
  // 600 m off in eight azimuths and a little more in the others; down to its own side.
  constexpr int kSide = 121, kMiddle = 60;
  const auto cone_m = [](std::int32_t c, std::int32_t r) {
    return std::max(0.0, 200 - 10 * std::hypot(c - kMiddle, r - kMiddle));
  };
  const GroundGrid cone = ground_of(kSide, kSide, 10, cone_m);
  const GroundGrid pit =
      ground_of(kSide, kSide, 10, [&](std::int32_t c, std::int32_t r) { return -cone_m(c, r); });
  const double to_border = std::atan(200.0 / 600) * 360 / kTurn;
  const double up = openness_deg(cone, Sight::kUp, kMiddle, kMiddle, 4);
  EXPECT_NEAR(up, 90 + to_border, 0.02);
  // Along rows and columns the cone is exact; beside them lines are chords of its circles.
  EXPECT_NEAR(openness_deg(cone, Sight::kDown, kMiddle, kMiddle, 4), 45, 0.02);
  EXPECT_NEAR(openness_deg(pit, Sight::kUp, kMiddle, kMiddle, 4), 45, 0.02);
  EXPECT_NEAR(openness_deg(pit, Sight::kDown, kMiddle, kMiddle, 4), up, 0.02);
}

/// Upside down and up again is the same ground.
TEST(Openness, LookingDownIsLookingUpAtTheGroundTimesMinusOne) {
  std::mt19937 random(21);
  std::vector<double> heights_m(90 * 70);
  for (std::int32_t r = 0; r < 70; ++r)
    for (std::int32_t c = 0; c < 90; ++c)
      heights_m[static_cast<std::size_t>(r * 90 + c)] =
          test::relief_height_m(test::Relief::kSmooth, c, r, random);
  const auto grid = [&](double sign) {
    return ground_of(90, 70, 30, [&](std::int32_t c, std::int32_t r) {
      return sign * heights_m[static_cast<std::size_t>(r * 90 + c)];
    });
  };
  const GroundGrid ground = grid(1), mirrored = grid(-1);
  SkylineOptions down;
  down.sight = Sight::kDown;
  for (const double azimuth : {0.0, 0.9, 2.2, 3.9, 5.5}) {
    const Found below = look(ground, azimuth, down), above = look(mirrored, azimuth);
    EXPECT_EQ(below.estimate, above.estimate) << azimuth;
    EXPECT_EQ(below.lower, above.lower) << azimuth;
    EXPECT_EQ(below.upper, above.upper) << azimuth;
  }
}

/// Rays through the samples themselves, over walls, spikes and to all borders.
TEST(Skyline, BoundsHoldOnDiagonals) {
  std::mt19937 random(17);
  std::size_t compared = 0;
  for (const auto relief : {test::Relief::kSmooth, test::Relief::kRough}) {
    const GroundGrid grid = ground_of(120, 90, 30, [&](std::int32_t c, std::int32_t r) {
      return test::relief_height_m(relief, c, r, random);
    });
    for (int i = 0; i < 4; ++i) {
      const Comparison one = expect_bounded(grid, (2 * i + 1) * kTurn / 8, {}, "diagonal", 3);
      compared += one.compared;
      EXPECT_LT(one.error_deg / static_cast<double>(one.compared), 0.05);
    }
    // Every other line is met in a sample.
    compared += expect_bounded(grid, std::atan(0.5), {}, "two to one", 3).compared;
  }
  EXPECT_GT(compared, 8000U);
}

}  // namespace
}  // namespace scarp
