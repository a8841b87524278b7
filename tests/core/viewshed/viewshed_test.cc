#include "core/viewshed/viewshed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/geodesy/predicates.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/part_sweep.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

using test::GroundRecipe;
using test::random_ground;
using test::Relief;

std::vector<Seen> judged(const GroundGrid& grid, const Position& eye, double target_m) {
  std::vector<Seen> sight(static_cast<std::size_t>(grid.columns() * grid.rows()));
  exhaustive_viewshed(grid, eye, target_m, sight);
  return sight;
}

std::vector<Seen> swept(const GroundGrid& grid, const Position& eye, double target_m,
                        SweepCounts* counts = nullptr) {
  std::vector<Seen> sight(static_cast<std::size_t>(grid.columns() * grid.rows()));
  const SweepCounts c = sweep_viewshed(grid, eye, target_m, whole_window(grid), sight);
  if (counts) *counts = c;
  return sight;
}

/// Eyes on samples, on grid lines, between, beside and far outside, at heights from under ground
/// to 10 km.
std::vector<Position> eyes_for(const GroundGrid& grid, std::mt19937& random, int count) {
  std::uniform_int_distribution<std::int32_t> column(0, grid.columns() - 2),
      row(0, grid.rows() - 2);
  std::uniform_int_distribution<int> kind(0, 5), height(0, 5);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double kHeights[] = {2, 100, 10'000, -5, 0, 0.5};
  std::vector<Position> eyes;
  for (int i = 0; i < count; ++i) {
    const std::int32_t c = column(random), r = row(random);
    const Position a = grid.at(c, r), b = grid.at(c + 1, r), d = grid.at(c, r + 1);
    Position eye = a;
    double f = unit(random), g = unit(random);
    switch (kind(random)) {
      case 0:
        f = g = 0;
        break;
      case 1:
        g = 0;
        break;
      case 2:
        f = 0;
        break;
      case 3:
        f += (unit(random) - 0.5) * 4 * grid.columns();
        g += (unit(random) - 0.5) * 4 * grid.rows();
        break;
      case 4:
        f = g = 0.5;
        break;
      default:
        break;
    }
    eye.x_m += f * (b.x_m - a.x_m) + g * (d.x_m - a.x_m);
    eye.y_m += f * (b.y_m - a.y_m) + g * (d.y_m - a.y_m);
    eye.z_m += kHeights[height(random)];
    eyes.push_back(round_to_lattice(eye));
  }
  return eyes;
}

std::vector<GroundRecipe> recipes() {
  std::vector<GroundRecipe> all;
  for (int relief = 0; relief < static_cast<int>(Relief::kCount); ++relief)
    for (const double bend : {0.0, 1.5})
      for (const double void_share : {0.0, 0.08})
        all.push_back({static_cast<Relief>(relief), 24, 20, bend, void_share,
                       static_cast<std::uint32_t>(relief + 1)});
  return all;
}

TEST(GridSightTest, WalkingFindsWhatTestingEverySegmentFinds) {
  for (const GroundRecipe& recipe : recipes()) {
    const GroundGrid grid = random_ground(recipe);
    std::mt19937 random(recipe.seed);
    for (const Position& eye : eyes_for(grid, random, 4)) {
      const GridSight judge(grid, eye);
      for (const double target_m : {0.0, 3.0}) {
        for (std::int32_t r = 0; r < grid.rows(); ++r) {
          for (std::int32_t c = 0; c < grid.columns(); ++c) {
            if (!grid.is_known(c, r)) continue;
            const Position target = grid.raised(c, r, target_m);
            ASSERT_EQ(judge.judge(target, c, r), sight_by_every_segment(grid, eye, target))
                << "relief " << static_cast<int>(recipe.relief) << " bend " << recipe.bend
                << " void " << recipe.void_share << " column " << c << " row " << r << " eye "
                << eye.x_m << ' ' << eye.y_m << ' ' << eye.z_m;
          }
        }
      }
    }
  }
}

/// Where the border of the data bends inwards, a line between two of its samples runs outside: no
/// ground is there, neither to block nor to make anything unknown. On a straight border it runs
/// over the samples, which block.
TEST(GridSightTest, MeetsNoGroundOutsideTheData) {
  for (const double inwards_m : {0.0, 5.0}) {
    SampleGrid samples;
    samples.columns = 6;
    samples.rows = 9;
    for (std::int32_t r = 0; r < samples.rows; ++r) {
      for (std::int32_t c = 0; c < samples.columns; ++c) {
        const double bow = 1 - (r - 4) * (r - 4) / 16.0;
        samples.positions.push_back({c * 30 + inwards_m * bow, -r * 30.0, r == 4 ? 100.0 : 0.0});
        samples.known.push_back(1);
      }
    }
    const GroundGrid grid(samples);
    Position eye = grid.at(0, 0);
    eye.z_m += 2;
    const GridSight judge(grid, eye);
    const Seen expected = inwards_m > 0 ? Seen::kVisible : Seen::kHidden;
    EXPECT_EQ(judge.judge(grid.at(0, 8), 0, 8), expected);
    EXPECT_EQ(sight_by_every_segment(grid, eye, grid.at(0, 8)), expected);
    EXPECT_EQ(swept(grid, eye, 0), judged(grid, eye, 0));
    EXPECT_EQ(judge.judge(grid.at(1, 8), 1, 8), Seen::kHidden);
  }
}

/// A line that runs exactly over the samples of a slanted border: measuring cannot tell on which
/// side of them it is.
TEST(SweepViewshed, ComparesExactlyAlongTheBorder) {
  for (const double slant_m : {7.0, -11.0, 3.0, -19.0}) {
    SampleGrid samples;
    samples.columns = 40;
    samples.rows = 41;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    for (std::int32_t r = 0; r < samples.rows; ++r) {
      for (std::int32_t c = 0; c < samples.columns; ++c) {
        samples.positions.push_back(
            round_to_lattice(Position{c * 31 + r * slant_m, -r * 30.0, 30 * unit(random)}));
        samples.known.push_back(1);
      }
    }
    const GroundGrid grid(samples);
    for (const auto& [column, row] : {std::pair(0, 0), std::pair(39, 40), std::pair(0, 22)}) {
      Position eye = grid.at(column, row);
      eye.z_m += 12;
      EXPECT_EQ(swept(grid, eye, 0), judged(grid, eye, 0)) << "slant " << slant_m;
    }
  }
}

TEST(SweepViewshed, EqualsTheJudgeOnEveryCell) {
  for (GroundRecipe recipe : recipes()) {
    for (const std::int32_t size : {24, 90}) {
      recipe.columns = size;
      recipe.rows = size - 7;
      const GroundGrid grid = random_ground(recipe);
      std::mt19937 random(recipe.seed);
      for (const Position& eye : eyes_for(grid, random, size < 50 ? 14 : 3)) {
        for (const double target_m : {0.0, 3.0}) {
          const auto expected = judged(grid, eye, target_m), found = swept(grid, eye, target_m);
          for (std::size_t i = 0; i < expected.size(); ++i)
            ASSERT_EQ(found[i], expected[i])
                << "relief " << static_cast<int>(recipe.relief) << " bend " << recipe.bend
                << " void " << recipe.void_share << " target " << target_m << " column "
                << i % static_cast<std::size_t>(size) << " row "
                << i / static_cast<std::size_t>(size) << " eye " << eye.x_m << ' ' << eye.y_m << ' '
                << eye.z_m;
        }
      }
    }
  }
}

/// Large enough for many tiles to be passed over, with voids, raised targets and eyes far outside.
TEST(SweepViewshed, PassesOverNothingThatIsSeen) {
  SweepCounts all;
  std::uint64_t samples = 0;
  for (const double bend : {0.0, 2.0}) {
    for (const double void_share : {0.0, 0.0003}) {
      for (const Relief relief : {Relief::kSmooth, Relief::kRough}) {
        const GroundGrid grid = random_ground({relief, 190, 170, bend, void_share, 5});
        std::mt19937 random(11);
        for (const Position& eye : eyes_for(grid, random, 2)) {
          const double target_m = relief == Relief::kSmooth ? 40 : 0;
          SweepCounts counts;
          const auto expected = judged(grid, eye, target_m);
          ASSERT_EQ(swept(grid, eye, target_m, &counts), expected)
              << "bend " << bend << " void " << void_share << " eye " << eye.x_m << ' ' << eye.y_m
              << ' ' << eye.z_m;
          all.add(counts);
          samples += expected.size();
        }
      }
    }
  }
  EXPECT_LT(all.targets, samples * 3 / 4);
}

/// A target at the least height is seen, and one two millimetres lower is not.
TEST(SweepHeights, AreTheLeastAtWhichATargetIsSeen) {
  for (const GroundRecipe& recipe : recipes()) {
    const GroundGrid grid = random_ground(recipe);
    std::mt19937 random(recipe.seed);
    std::vector<float> least_m(static_cast<std::size_t>(grid.columns() * grid.rows()));
    for (const Position& eye : eyes_for(grid, random, 8)) {
      sweep_heights(grid, eye, whole_window(grid), least_m);
      const GridSight judge(grid, eye);
      for (std::int32_t r = 0; r < grid.rows(); ++r) {
        for (std::int32_t c = 0; c < grid.columns(); ++c) {
          const float h = least_m[static_cast<std::size_t>(r * grid.columns() + c)];
          if (!grid.is_known(c, r)) {
            EXPECT_TRUE(std::isnan(h));
            continue;
          }
          const auto sight_at = [&](double height_m) {
            return judge.judge(grid.raised(c, r, height_m), c, r);
          };
          // Rounding to float may add its own step.
          const double step_m = 0.002 + h * 1e-6;
          if (std::isnan(h)) {
            ASSERT_NE(sight_at(1e6), Seen::kVisible);
          } else if (std::isinf(h)) {
            ASSERT_EQ(sight_at(1e6), Seen::kHidden);
          } else {
            ASSERT_EQ(sight_at(h), Seen::kVisible)
                << "relief " << static_cast<int>(recipe.relief) << " bend " << recipe.bend
                << " height " << h << " column " << c << " row " << r << " eye " << eye.x_m << ' '
                << eye.y_m << ' ' << eye.z_m;
            if (h > step_m) {
              ASSERT_EQ(sight_at(h - step_m), Seen::kHidden) << "height " << h;
            }
          }
        }
      }
    }
  }
}

TEST(SweepHeights, AreZeroExactlyWhereTheGroundIsSeen) {
  for (GroundRecipe recipe : recipes()) {
    recipe.columns = 70;
    recipe.rows = 61;
    const GroundGrid grid = random_ground(recipe);
    std::mt19937 random(recipe.seed);
    std::vector<float> least_m(static_cast<std::size_t>(grid.columns() * grid.rows()));
    for (const Position& eye : eyes_for(grid, random, 6)) {
      sweep_heights(grid, eye, whole_window(grid), least_m);
      const std::vector<Seen> seen = judged(grid, eye, 0);
      for (std::size_t i = 0; i < seen.size(); ++i)
        ASSERT_EQ(least_m[i] == 0, seen[i] == Seen::kVisible)
            << "relief " << static_cast<int>(recipe.relief) << " bend " << recipe.bend << " void "
            << recipe.void_share << " sample " << i << " height " << least_m[i];
    }
  }
}

/// Leaving out what cannot be lower leaves out nothing that is.
TEST(LowerHeights, AreTheLeastOfEachEyesOwn) {
  std::uint64_t compared = 0, climbed = 0;
  for (GroundRecipe recipe : recipes()) {
    recipe.columns = 60;
    recipe.rows = 53;
    const GroundGrid grid = random_ground(recipe);
    std::mt19937 random(recipe.seed);
    LeastHeight together(grid), apart(grid);
    std::vector<float> own_m(static_cast<std::size_t>(grid.columns() * grid.rows()));
    for (const Position& eye : eyes_for(grid, random, 6)) {
      ViewshedEye from{eye, 0, {}};
      from.limits.max_distance_m = 1100;
      from.limits.min_pitch_rad = -0.3;
      from.limits.azimuth_begin_rad = 5;
      from.limits.azimuth_end_rad = 4;
      SweepCounts few, all;
      together.lower(grid, {}, from, &few);
      apart.add(heights_from(grid, {}, from, own_m, &all), own_m);
      climbed += few.traced_part;
      compared += all.traced_part;
    }
    for (std::size_t i = 0; i < own_m.size(); ++i) {
      const float least = together.heights_m()[i], expected = apart.heights_m()[i];
      ASSERT_TRUE(least == expected || (std::isnan(least) && std::isnan(expected)))
          << "relief " << static_cast<int>(recipe.relief) << " sample " << i << ": " << least
          << " instead of " << expected;
    }
  }
  EXPECT_LT(climbed, compared * 3 / 4);
}

TEST(SweepViewshed, DecidesMostByItsBounds) {
  GroundRecipe recipe{Relief::kSmooth, 300, 280, 0, 0, 3};
  for (const double bend : {0.0, 2.0}) {
    recipe.bend = bend;
    const GroundGrid grid = random_ground(recipe);
    Position eye = grid.at(140, 120);
    eye.z_m += 2;
    SweepCounts counts;
    swept(grid, eye, 0, &counts);
    // The others lie in tiles that are hidden as a whole.
    EXPECT_LT(counts.targets, 300U * 280U / 3);
    EXPECT_LT(counts.traced_whole, 100U);
    EXPECT_LT(counts.traced_part, counts.targets / 5);
  }
}

}  // namespace
}  // namespace scarp
