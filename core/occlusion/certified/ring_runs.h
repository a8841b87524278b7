#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/polar_cells.h"

namespace scarp {

/// Most runs that the rings of a sector are shared out to.
inline constexpr std::size_t kMostRuns = std::tuple_size_v<SectorSteps>;

/// Bounds far above all ground say no more than those that reach this far above it.
inline constexpr float kHeadroomM = 2000;

/// What rings are worth in one direction: a slope hides cameras over a ring's ground, as many as
/// weight * sqrt(their room in height, metres). Entries beyond the rings are never read.
struct RingGround {
  std::array<float, kRings> middle_m{};  ///< distance
  std::array<float, kRings> low_m{};     ///< of the ground, over where slopes start from
  std::array<float, kRings> weight{};
};

/// A run of rings that share one slope, up to where the next run begins.
struct RingRun {
  std::int32_t first;
  float slope;  ///< the least of its rings; -infinity where no camera is hidden by it
};

/// The best ways to share the rings of a sector out to 1, 2, ... kMostRuns runs, each with the
/// least slope of its rings.
class RingRuns {
 public:
  /// Cost: O(rings^2 * kMostRuns), a few microseconds. The same bits on every processor.
  RingRuns(const RingGround& ground, std::span<const float> slopes);

  /// What `count` runs are worth, from 1 to kMostRuns: rising.
  float worth(std::size_t count) const { return worth_[count]; }

  std::span<const RingRun> runs(std::size_t count) const {
    return {runs_.data() + count * (count - 1) / 2, count};
  }

 private:
  std::array<float, kMostRuns + 1> worth_{};
  std::array<RingRun, kMostRuns*(kMostRuns + 1) / 2> runs_{};  // of one run, then of two, ...
};

}  // namespace scarp
