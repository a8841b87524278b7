#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/geodesy/earth_frame.h"
#include "core/memory/large_array.h"
#include "core/sight/tin_index.h"
#include "core/terrain/ground_grid.h"
#include "core/threads/progress.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/part_sweep.h"
#include "core/viewshed/thinned_ground.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// One eye and what it looks for.
struct ViewshedEye {
  Position position;
  double target_height_m = 0;  ///< along the normal
  ViewLimits limits;           ///< targets outside count as hidden
};

/// What targets stand on, and what blocks them.
struct ViewGround {
  /// The grid is both.
  // NOLINTNEXTLINE(google-explicit-constructor): a grid is the plain case
  ViewGround(const GroundGrid& grid) : stands(grid) {}

  /// The samples are on the ground, the obstacles above it block. Both have one placement and the
  /// same known samples.
  static ViewGround under(const GroundGrid& samples, const GroundGrid& obstacles) {
    ViewGround ground(samples);
    ground.obstacles = &obstacles;
    return ground;
  }
  /// The samples are on a TIN (stand_on), which blocks.
  static ViewGround of_tin(const GroundGrid& samples, const TinIndex& tin) {
    ViewGround ground(samples);
    ground.tin = &tin;
    return ground;
  }

  const GroundGrid& blocks() const { return obstacles ? *obstacles : stands; }
  /// Of grids: what a sweep takes.
  SweptGround swept() const {
    SweptGround swept(blocks(), stands);
    swept.tops = tops;
    swept.deciding = deciding;
    return swept;
  }

  const GroundGrid& stands;
  const GroundGrid* obstacles = nullptr;
  const TinIndex* tin = nullptr;
  /// Of what swept() has, for many eyes: measured once. Null: measured by each.
  const GroundTops* tops = nullptr;
  Deciding deciding = Deciding::kExactly;
  /// Of grids: swept in their place; samples get the answer of that which stands for them.
  const ThinnedGround* thinned = nullptr;
};

/// What one eye sees within its limits: exactly what GridSight or line_of_sight judges, unless the
/// ground is thinned or decided by bounds.
/// @param earth        of the grid's frame; nothing where it is flat
/// @param sight[out]   [rows * columns]; only the window returned is written
/// @return the window within reach; outside it nothing is within the limits
/// @param progress     told over a TIN, where samples are judged one by one
/// Cost: see part_sweep.h; with limits besides distance, a bearing for each sample seen.
SampleWindow view_from(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                       const ViewshedEye& eye, std::span<Seen> sight, SweepCounts* counts = nullptr,
                       const Progress& progress = {});

/// How high above each sample a target must be at least for one eye to see it within its limits,
/// metres along the normal, rounded up: NaN where that is not known (over void ground) or not to be
/// had at any height. Distance and azimuth are those of the sample, pitch that of the target.
/// @param least_m[out]  [rows * columns]; only the window returned is written
SampleWindow heights_from(const ViewGround& ground, const std::optional<EarthFrame>& earth,
                          const ViewshedEye& eye, std::span<float> least_m,
                          SweepCounts* counts = nullptr);

/// How many samples an eye has how.
struct SeenTotals {
  std::uint64_t visible = 0, hidden = 0, unknown = 0;
};
SeenTotals count_seen(std::span<const Seen> sight);

/// Seen by any of the eyes so far: visible where one sees it, otherwise unknown where that
/// holds for one.
class AnyEye {
 public:
  /// Nothing seen yet: hidden, and unknown where void.
  explicit AnyEye(const GroundGrid& grid);
  void add(const SampleWindow& window, std::span<const Seen> sight);
  std::span<const Seen> seen() const { return sight_.span(); }

 private:
  std::size_t columns_;
  LargeArray<Seen> sight_;
};

/// By how many of the eyes so far a sample is seen for certain.
class EyeCount {
 public:
  static constexpr std::uint32_t kVoid = 0xFFFFFFFF;  ///< where the sample is void

  explicit EyeCount(const GroundGrid& grid);
  void add(const SampleWindow& window, std::span<const Seen> sight);
  std::span<const std::uint32_t> counts() const { return counts_.span(); }

 private:
  std::size_t columns_;
  LargeArray<std::uint32_t> counts_;
};

/// The least height so far, over the eyes that have one; NaN where none has.
class LeastHeight {
 public:
  explicit LeastHeight(const GroundGrid& grid);
  /// Takes in what heights_from finds for one more eye, without a raster of its own.
  /// Cost: with many eyes near that of view_from; see lower_heights.
  void lower(const ViewGround& ground, const std::optional<EarthFrame>& earth,
             const ViewshedEye& eye, SweepCounts* counts = nullptr);
  void add(const SampleWindow& window, std::span<const float> least_m);
  std::span<float> heights_m() { return least_m_.span(); }
  std::span<const float> heights_m() const { return least_m_.span(); }

 private:
  std::size_t columns_;
  LargeArray<float> least_m_;
  LeastTops tops_;
};

}  // namespace scarp
