#pragma once

#include <optional>
#include <vector>

#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ground_tops.h"
#include "core/viewshed/least_tops.h"
#include "core/viewshed/part_sweep.h"

namespace scarp {

/// What all parts of a sweep share.
struct SweepGround {
  const GridSight& sight;
  const GroundGrid& blocks;  ///< what blocks
  const GroundGrid& stands;  ///< what targets stand on
  bool apart;                ///< whether these are two
  Deciding deciding;
  double target_height_m;
  SampleWindow window;  ///< samples outside are no targets, though they block

  /// Plan places of columns and rows where the placement is separable; otherwise empty.
  std::vector<double> across_of_column, down_of_row;
  /// How far those lie from even spacing, in samples.
  double uneven_samples = 0;
  /// Greatest difference of height between neighbouring samples, metres; only where targets stand
  /// off their grid lines.
  double steepest_m = 0;
  /// How far aside of its sample a target may stand, in samples, and above the ground's tops,
  /// metres.
  double most_aside_samples = 0, most_raise_m = 0;

  /// Null where no tile is passed over.
  const GroundTops* tops = nullptr;
  /// Null where not only lower heights are wanted.
  const LeastTops* least_tops = nullptr;

  /// @param for_heights  whether heights are looked for, of targets on the ground
  SweepGround(const GridSight& sight, const SweptGround& ground, double target_height_m,
              const SampleWindow& window, bool for_heights);

 private:
  void measure_targets(const PlanFrame& frame);

  std::optional<GroundTops> own_tops_;
};

}  // namespace scarp
