#include "core/occlusion/certified/ring_runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/splitmix64.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr auto kRingCount = static_cast<std::size_t>(kRings);

double unit(SplitMix64& random) {
  return static_cast<double>(random.below(1 << 20)) / (1 << 20);
}

/// Slopes that fall and rise with the distance, with gaps where nothing is known.
std::vector<float> random_slopes(SplitMix64& random) {
  std::vector<float> slopes;
  double slope = 4 * unit(random);
  for (std::size_t k = 0; k < kRingCount; ++k) {
    slope = 0.9 * slope + 0.3 * (unit(random) - 0.55);
    slopes.push_back(random.below(9) == 0 ? kNothing : static_cast<float>(slope));
  }
  return slopes;
}

RingGround random_ground(SplitMix64& random) {
  RingGround ground;
  double low_m = -50;
  for (std::size_t k = 0; k < kRingCount; ++k) {
    ground.middle_m[k] = static_cast<float>(100 * std::exp2(static_cast<double>(k) / 8));
    ground.low_m[k] = static_cast<float>(low_m += 20 * (unit(random) - 0.5));
    ground.weight[k] = ground.middle_m[k] * (random.below(5) == 0 ? 1e-6F : 1);
  }
  return ground;
}

/// What a slope hides of a ring, as it is meant.
double worth_of(const RingGround& ground, std::size_t ring, float slope) {
  if (!(slope > kNothing)) return 0;
  const double above_m = static_cast<double>(slope) * static_cast<double>(ground.middle_m[ring]) -
                         static_cast<double>(ground.low_m[ring]);
  return static_cast<double>(ground.weight[ring]) *
         std::sqrt(std::clamp(above_m, 0.0, static_cast<double>(kHeadroomM)));
}

/// The same of a run up to a ring.
double worth_of_run(const RingGround& ground, const std::vector<float>& slopes, std::size_t first,
                    std::size_t end) {
  const float least = *std::min_element(slopes.begin() + static_cast<std::ptrdiff_t>(first),
                                        slopes.begin() + static_cast<std::ptrdiff_t>(end));
  double worth = 0;
  for (std::size_t k = first; k < end; ++k) worth += worth_of(ground, k, least);
  return worth;
}

/// The most that any runs keep: every way is tried, by rings and exact roots.
double most_worth(const RingGround& ground, const std::vector<float>& slopes, std::size_t count) {
  std::vector<std::vector<double>> best(count + 1, std::vector<double>(kRingCount + 1, -1));
  best[0][0] = 0;
  for (std::size_t n = 1; n <= count; ++n)
    for (std::size_t end = 1; end <= kRingCount; ++end)
      for (std::size_t first = 0; first < end; ++first)
        if (best[n - 1][first] >= 0)
          best[n][end] =
              std::max(best[n][end], best[n - 1][first] + worth_of_run(ground, slopes, first, end));
  return best[count][kRingCount];
}

TEST(RingRuns, NoRunIsAboveAnyOfItsRings) {
  SplitMix64 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<float> slopes = random_slopes(random);
    const RingRuns all(random_ground(random), slopes);
    for (std::size_t count = 1; count <= kMostRuns; ++count) {
      const auto runs = all.runs(count);
      ASSERT_EQ(runs.size(), count);
      EXPECT_EQ(runs[0].first, 0);
      for (std::size_t i = 0; i < count; ++i) {
        const auto first = static_cast<std::size_t>(runs[i].first);
        const auto end = i + 1 < count ? static_cast<std::size_t>(runs[i + 1].first) : kRingCount;
        for (std::size_t k = first; k < end; ++k) ASSERT_LE(runs[i].slope, slopes[k]) << trial;
      }
    }
  }
}

TEST(RingRuns, KeepNearlyAllThatSoManyRunsCan) {
  SplitMix64 random(6);
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<float> slopes = random_slopes(random);
    const RingGround ground = random_ground(random);
    const RingRuns all(ground, slopes);
    for (const std::size_t count : {std::size_t{1}, std::size_t{2}, std::size_t{4}, kMostRuns}) {
      double kept = 0;
      const auto runs = all.runs(count);
      for (std::size_t k = 0; k < kRingCount; ++k) {
        std::size_t i = 0;
        while (i + 1 < count && runs[i + 1].first <= static_cast<std::int32_t>(k)) ++i;
        kept += worth_of(ground, k, runs[i].slope);
      }
      const double most = most_worth(ground, slopes, count);
      EXPECT_LE(kept, most * 1.0001);
      // These rings have less to do with their neighbours than real ones: joining them costs more.
      EXPECT_GE(kept, most * 0.9) << trial << " with " << count;
    }
  }
}

TEST(RingRuns, MoreRunsAreWorthMore) {
  SplitMix64 random(7);
  for (int trial = 0; trial < 100; ++trial) {
    const RingRuns all(random_ground(random), random_slopes(random));
    for (std::size_t count = 2; count <= kMostRuns; ++count)
      EXPECT_GE(all.worth(count) * 1.0001F, all.worth(count - 1));
  }
}

TEST(RingRuns, OfNothingHideNothing) {
  const std::vector<float> nothing(kRingCount, kNothing);
  SplitMix64 random(8);
  const RingRuns all(random_ground(random), nothing);
  for (const RingRun& run : all.runs(kMostRuns)) EXPECT_EQ(run.slope, kNothing);
}

/// What is found of some groups, made up.
HidingBounds random_bounds(std::uint32_t groups, SplitMix64& random) {
  HidingBounds bounds;
  bounds.layout = {64, 2};
  for (std::uint32_t g = 0; g < groups; ++g) {
    bounds.circle.push_back({100 * unit(random), 100 * unit(random), 5 + unit(random)});
    bounds.height_m.push_back(20 * unit(random));
    for (std::int32_t s = 0; s < bounds.layout.sectors; ++s) {
      const std::vector<float> slopes = random_slopes(random);
      bounds.slope.insert(bounds.slope.end(), slopes.begin(), slopes.end());
    }
  }
  return bounds;
}

TEST(CompressBounds, WhatIsKeptIsNeverLargerThanWhatWasFound) {
  SplitMix64 random(9);
  const LeastGround ground(test::triangulated(test::random_hills(12, 12, 10, 3, 40, 0.01)));
  const HidingBounds bounds = random_bounds(40, random);
  const CertifiedRegions regions = compress_bounds(bounds, ground);
  ASSERT_EQ(check_certified(regions), std::nullopt);
  int kept = 0;
  for (GroupIndex g = 0; g < regions.groups.size(); ++g) {
    std::size_t different = 0;
    EXPECT_GE(static_cast<double>(regions.groups[g].radius_m), bounds.circle[g].radius_m);
    for (std::int32_t s = 0; s < regions.layout.sectors; ++s) {
      const SectorSteps& steps = regions.at(g, s);
      for (std::size_t i = 0; i < steps.size(); ++i)
        different += i == 0 || steps[i] != steps[i - 1];
      for (std::int32_t ring = 0; ring < kRings; ++ring) {
        std::int32_t code = 0;
        for (const std::uint16_t step : steps)
          if (step >> kSlopeBits <= ring) code = step & (kSlopeCodes - 1);
        if (code == 0) continue;
        ++kept;
        ASSERT_LE(slope_of(regions.groups[g], code),
                  bounds.at(g, s)[static_cast<std::size_t>(ring)])
            << "group " << g << ", sector " << s << ", ring " << ring;
      }
    }
    EXPECT_LE(static_cast<double>(different), kMeanSteps * regions.layout.sectors);
  }
  EXPECT_GT(kept, 10'000);
}

}  // namespace
}  // namespace scarp
