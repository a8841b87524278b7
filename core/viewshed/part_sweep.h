#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "core/terrain/ground_grid.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ground_tops.h"
#include "core/viewshed/least_tops.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// @file
/// The fast way to what GridSight judges, for all samples of a window. Zero cells differ.
///
/// The plane around the eye is cut into 64 parts: in each of four wedges (east, south, west, north
/// in the eye's plan frame) sixteen between two tangents. Each sample but one under the eye lies in
/// exactly one part.
///
/// In the picture that the eye has, t = (sideways / forwards) and s = (rise / forwards), straight
/// segments stay straight, so a grid line is a polyline. A part is cut into bins of t, about one a
/// sample; a sweep from the eye outwards keeps for each bin a lower and an upper bound of the
/// horizon's s that hold for all directions of the bin. A target under the lower or above the upper
/// bound is decided; the others are compared exactly with the lines that reach their s in the bin
/// (BinHistory). Where the highest ground of the next lines (GroundTops) lies wholly under the
/// lower bounds of a group of bins, nothing there is seen and nothing rises above the horizon, so
/// the group is passed over without a look at its samples.
///
/// Side of error of the bounds: outwards, by margins derived in sweep_run.h; what they leave open
/// is decided by exact predicates, so the result has no error, unless Deciding says otherwise.
/// Requires of the grid what GridSight requires.
/// Cost: O(1) a sample and bin, about 1.5 bins a sample, of the samples that are not passed over;
/// O(columns + rows) memory, and for each thread a part's history, of some six bytes a sample.
/// Threads: all parts on all threads. The same bits for any number of threads.
/// Source: own; an interval of the horizon in each narrow bin, and exact tracing between.

/// How a sweep decides what its bounds leave open.
enum class Deciding : std::uint8_t {
  kExactly,   ///< by exact predicates: no error
  kByBounds,  ///< seen above a place between the bounds, least heights over the one line that
              ///< reaches highest; what lies between a target and the line before it is left out.
              ///< Errs to both sides.
};

/// What blocks, what targets stand on, and what is known of both.
struct SweptGround {
  /// The grid is both.
  // NOLINTNEXTLINE(google-explicit-constructor): a grid is the plain case
  SweptGround(const GroundGrid& grid) : SweptGround(grid, grid) {}
  /// @param blocks, stands  of the same placement and with the same known samples
  SweptGround(const GroundGrid& blocks_, const GroundGrid& stands_)
      : blocks(blocks_), stands(stands_) {}

  const GroundGrid& blocks;
  const GroundGrid& stands;
  const GroundTops* tops = nullptr;  ///< of both; measured anew where it is null
  LeastTops* least_tops = nullptr;   ///< for lower_heights
  Deciding deciding = Deciding::kExactly;
};

/// How the samples of a sweep were decided.
struct SweepCounts {
  std::uint64_t targets = 0;       ///< compared with bounds, one by one
  std::uint64_t traced_part = 0;   ///< compared exactly with the lines that might block them
  std::uint64_t traced_whole = 0;  ///< judged over their whole length

  void add(const SweepCounts& more) {
    targets += more.targets;
    traced_part += more.traced_part;
    traced_whole += more.traced_whole;
  }
};

/// @param target_height_m  of targets above their samples
/// @param window           samples outside are no targets, though they block
/// @param result[out]      [rows * columns]; the window is written, kUnknown where the sample is
///                         void
SweepCounts sweep_viewshed(const SweptGround& ground, const Position& eye, double target_height_m,
                           const SampleWindow& window, std::span<Seen> result);

/// How high above each sample, along its normal, a target must be at least to be seen.
/// @param least_m[out]  [rows * columns] metres, rounded up (by less than 1 mm and float's own
///                      step) for a target straight over the sample in the frame, from which a
///                      normal leans aside a little; 0 exactly where sweep_viewshed says kVisible
///                      of targets on the ground, NaN where the line is over void ground or the
///                      sample is void, infinite above an eye under ground
SweepCounts sweep_heights(const SweptGround& ground, const Position& eye,
                          const SampleWindow& window, std::span<float> least_m);

/// What a least height becomes under limits other than the ground: the same, more, or NaN where no
/// height will do. Called from several threads; empty where there are none.
using HeightLimit = std::function<float(std::int32_t column, std::int32_t row, float least_m)>;

/// Lowers the heights so far of several eyes to those of one more, within limits: nothing is
/// compared exactly whose lower bound is above those already.
/// @param least_m[in, out]  [rows * columns] NaN where no eye has any; the lesser of what it is and
///                          what sweep_heights finds, after limit, where that is finite
/// Cost: with many eyes less than sweep_viewshed, because most samples are seen lower already.
SweepCounts lower_heights(const SweptGround& ground, const Position& eye,
                          const SampleWindow& window, const HeightLimit& limit,
                          std::span<float> least_m);

}  // namespace scarp
