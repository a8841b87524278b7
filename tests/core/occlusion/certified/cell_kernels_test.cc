#include "core/occlusion/certified/cell_kernels.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <limits>
#include <vector>

#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// Calls visit() with each instruction set that the kernels were compiled for and that the
/// processor has.
template <class Visit>
void with_each_target(Visit visit) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    visit();
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

/// Bounds over, at and under their hints, some of them infinite.
struct Cells {
  std::vector<float> bounds;
  std::vector<std::uint16_t> hints;

  Cells(std::size_t count, SplitMix64& random) : hints(count + kHintsBeyond) {
    for (std::size_t i = 0; i < count; ++i) {
      hints[i] = slope_hint(static_cast<float>(random.unit() * 2 - 1));
      const float infinity = std::numeric_limits<float>::infinity();
      switch (random.below(5)) {
        case 0:
          bounds.push_back(slope_of_hint(hints[i]));
          break;
        case 1:
          bounds.push_back(random.below(2) ? infinity : -infinity);
          break;
        default:
          bounds.push_back(static_cast<float>(random.unit() * 2 - 1));
      }
    }
  }
};

TEST(CellKernels, MarkCellsOverTheirHints) {
  SplitMix64 random(1);
  const Cells cells(64 * 9, random);
  with_each_target([&] {
    std::vector<std::uint64_t> bits(9, 0);
    mark_wanted(cells.bounds.data(), cells.hints.data(), {128, 6 * kCellsMarked}, bits.data());
    for (std::uint32_t i = 0; i < 64 * 9; ++i) {
      const bool is_asked = i >= 128 && i < 128 + 6 * kCellsMarked;
      EXPECT_EQ(bits[i / 64] >> (i % 64) & 1,
                is_asked && cells.bounds[i] > slope_of_hint(cells.hints[i]) ? 1U : 0U)
          << i;
    }
  });
}

TEST(CellKernels, LowerOnlyTheUselessBoundsOfRuns) {
  SplitMix64 random(2);
  const Cells cells(1000, random);
  std::vector<CellRun> runs;
  std::vector<float> best;
  for (std::uint32_t at = 0; at + 40 <= 1000; at += 41) {
    runs.push_back({at, static_cast<std::uint32_t>(random.below(41))});
    best.push_back(static_cast<float>(random.unit() * 2 - 1));
  }
  runs.push_back({990, 10});
  best.push_back(-0.5F);
  std::vector<float> expected = cells.bounds;
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (std::uint32_t i = runs[r].begin; i < runs[r].begin + runs[r].count; ++i)
      if (!(expected[i] > slope_of_hint(cells.hints[i])) && best[r] < expected[i])
        expected[i] = best[r];
  with_each_target([&] {
    std::vector<float> bounds = cells.bounds;
    lower_useless(runs.data(), best.data(), runs.size(), cells.hints.data(), bounds.data());
    EXPECT_EQ(bounds, expected);
  });
}

}  // namespace
}  // namespace scarp
