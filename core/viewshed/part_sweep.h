#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/terrain/ground_grid.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// A part of the plane around an eye: directions of one of the four wedges (east, south, west,
/// north in the eye's plan frame), between two tangents. Each sample but one under the eye lies in
/// exactly one part.
struct SweepPart {
  enum Wedge : std::uint8_t { kEast, kSouth, kWest, kNorth };
  static constexpr std::int32_t kPartsInWedge = 16;

  Wedge wedge = kEast;
  std::int32_t number = 0;  ///< [0, kPartsInWedge), by rising tangent
};

/// What a least height becomes under limits other than the ground: the same, more, or NaN where no
/// height will do. Called from several threads; empty where there are none.
using HeightLimit = std::function<float(std::int32_t column, std::int32_t row, float least_m)>;

/// What all parts of a sweep share; made by sweep_viewshed.
struct SweepGround;

/// How heights are taken that are to be lower than those of the eyes before; see lower_heights.
struct LeastSoFar {
  HeightLimit limit;
};

/// How the samples of a sweep were decided.
struct SweepCounts {
  std::uint64_t targets = 0;
  std::uint64_t traced_part = 0;   ///< compared exactly with the lines that might block them
  std::uint64_t traced_whole = 0;  ///< judged over their whole length

  void add(const SweepCounts& more) {
    targets += more.targets;
    traced_part += more.traced_part;
    traced_whole += more.traced_whole;
  }
};

/// The fast way to what GridSight judges, for all samples of a part. Zero cells differ.
///
/// In the picture that the eye has, t = (sideways / forwards) and s = (rise / forwards), straight
/// segments stay straight, so a grid line is a polyline. The part is cut into bins of t, about one
/// a sample; a sweep from the eye outwards keeps for each bin a lower and an upper bound of the
/// horizon's s that hold for all directions of the bin. A target under the lower or above the upper
/// bound is decided; the others are compared exactly with the lines that reach their s in the bin
/// (BinHistory).
///
/// Side of error of the bounds: outwards, by margins derived in part_sweep.cc; what they leave
/// open is decided by exact predicates, so the result has no error.
/// Requires of the grid what GridSight requires.
/// Cost: O(1) a sample and bin, about 1.5 bins a sample; O(columns + rows) memory.
/// Source: own; an interval of the horizon in each narrow bin, and exact tracing between.
class PartSweep {
 public:
  /// @param sight, ground    for the same grid, eye and target height, kept by reference
  /// @param stands           what targets stand on: the grid, or another one of the same placement
  ///                         and with the same known samples
  /// @param target_height_m  of targets above their samples
  /// @param window           samples outside are no targets, though they block
  PartSweep(const GridSight& sight, const GroundGrid& stands, const SweepGround& ground,
            double target_height_m, const SampleWindow& window);

  /// @param result[out]  [rows * columns]; the part's known samples in the window are written,
  /// others left
  SweepCounts run(const SweepPart& part, std::span<Seen> result);

  /// Instead: how high above each sample, along its normal, a target must be at least to be seen.
  /// @param least_m[out]  [rows * columns] metres, rounded up (by less than 1 mm and float's own
  ///                      step) for a target straight over the sample in the frame, from which a
  ///                      normal leans aside a little; 0 where the ground is seen, NaN where the
  ///                      line is over void ground, infinite above an eye under ground
  SweepCounts run_heights(const SweepPart& part, std::span<float> least_m);

  /// The same where only what is lower than the heights so far is of interest: nothing is compared
  /// exactly whose lower bound is above those already.
  SweepCounts lower_heights(const SweepPart& part, std::span<float> least_m,
                            const LeastSoFar& so_far);

 private:
  struct Line;
  class Run;

  const GridSight& sight_;
  const GroundGrid& stands_;
  const SweepGround& ground_;
  double target_height_m_;
  SampleWindow window_;
};

/// PartSweep::run_heights for all parts; NaN where a sample is void. 0 exactly where sweep_viewshed
/// says kVisible of targets on the ground.
SweepCounts sweep_heights(const GroundGrid& grid, const Position& eye, const SampleWindow& window,
                          std::span<float> least_m, const GroundGrid* stands = nullptr);

/// Lowers the heights so far of several eyes to those of one more, within limits.
/// @param least_m[in, out]  [rows * columns] NaN where no eye has any; the lesser of what it is and
///                          what sweep_heights finds, after limit, where that is finite
/// Cost: with many eyes little more than sweep_viewshed, because most samples are seen lower
/// already.
SweepCounts lower_heights(const GroundGrid& grid, const Position& eye, const SampleWindow& window,
                          const HeightLimit& limit, std::span<float> least_m,
                          const GroundGrid* stands = nullptr);

/// All parts on all threads. The same bits for any number of threads.
/// @param result[out]  [rows * columns]; the window is written, kUnknown where the sample is void
/// @param stands       what targets stand on where that is not the grid that blocks; see PartSweep
SweepCounts sweep_viewshed(const GroundGrid& grid, const Position& eye, double target_height_m,
                           const SampleWindow& window, std::span<Seen> result,
                           const GroundGrid* stands = nullptr);

}  // namespace scarp
