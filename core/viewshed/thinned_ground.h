#pragma once

#include <optional>

#include "core/geodesy/position.h"
#include "core/terrain/ground_grid.h"
#include "core/viewshed/ground_tops.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// Every second sample of each row and column, at the same positions. A last odd row or column that
/// is left over is kept by none. Requires at least 3 x 3 samples. Cost: O(samples), on all threads.
GroundGrid thinned(const GroundGrid& grid);

/// Flattened height of the ground under a place, bilinear; nothing outside or over void.
std::optional<double> ground_under_m(const GroundGrid& grid, const Position& place);

/// An eye that is over one ground, moved up where another would be higher under it, so that it is
/// no nearer to that: a coarser ground could bury it.
/// @param own_m, other_m  flattened heights of the grounds under it
Position raised_over(const Position& eye, std::optional<double> own_m,
                     std::optional<double> other_m);

/// What a view is swept over in place of ground with four times the samples: for answers that need
/// not be exact.
class ThinnedGround {
 public:
  /// Sample k of the thinned ground stands for samples 2 k and 2 k + 1 of the whole.
  static constexpr std::int32_t kStep = 2;
  /// Ground with fewer samples along a side is not thinned.
  static constexpr std::int32_t kFewest = 16;

  /// @param stands, blocks  as SweptGround has them; may be one
  ThinnedGround(const GroundGrid& stands, const GroundGrid& blocks);

  const GroundGrid& stands() const { return stands_; }
  const GroundGrid& blocks() const { return blocks_ ? *blocks_ : stands_; }
  const GroundTops& tops() const { return tops_; }

 private:
  GroundGrid stands_;
  std::optional<GroundGrid> blocks_;  // where they are two
  GroundTops tops_;
};

}  // namespace scarp
