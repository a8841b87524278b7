#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/terrain/ground_grid.h"

namespace scarp {

/// The highest ground in each tile of a grid, so that a sweep passes over the tiles that lie wholly
/// under its horizon.
///
/// Tiles are kSide samples wide. What is kept for one is the highest of its samples and of the ring
/// of samples around it, so that segments that lead out of it count as well; kUnknown where any of
/// them is void. Of two grounds it is the higher one.
/// Cost: one pass over the grid; O(1 / kSide^2) memory a sample.
class GroundTops {
 public:
  static constexpr std::int32_t kSide = 16;
  static constexpr std::int32_t kUnknown = std::numeric_limits<std::int32_t>::max();

  explicit GroundTops(const GroundGrid& grid) : GroundTops(grid, grid) {}
  /// Requires the same samples in both.
  GroundTops(const GroundGrid& grid, const GroundGrid& other);

  /// In lattice steps of flattened height.
  std::int32_t of_tile(std::int32_t across, std::int32_t down) const {
    return tops_[static_cast<std::size_t>(down) * static_cast<std::size_t>(across_) +
                 static_cast<std::size_t>(across)];
  }
  std::int32_t tiles_across() const { return across_; }
  std::int32_t tiles_down() const { return down_; }

 private:
  std::int32_t across_ = 0, down_ = 0;
  std::vector<std::int32_t> tops_;
};

}  // namespace scarp
