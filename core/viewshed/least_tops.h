#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/terrain/ground_grid.h"

namespace scarp {

/// In each tile of GroundTops the highest flattened height at which a target is seen so far, so
/// that a sweep passes over the tiles of which it can lower none.
/// Cost: of renew, one pass over the tiles that changed.
class LeastTops {
 public:
  /// Nothing is seen at any height yet.
  explicit LeastTops(const GroundGrid& stands);

  /// Metres; infinite where a known sample has no height yet. Never below what it stands for.
  double of_tile(std::int32_t across, std::int32_t down) const {
    return tops_m_[index(across, down)];
  }

  /// A sample's height was lowered. From any thread.
  void touch(std::int32_t column, std::int32_t row);
  /// Measures the touched tiles. @param least_m  [rows * columns] as lower_heights leaves them
  void renew(const GroundGrid& stands, std::span<const float> least_m);

 private:
  std::size_t index(std::int32_t across, std::int32_t down) const {
    return static_cast<std::size_t>(down) * static_cast<std::size_t>(across_) +
           static_cast<std::size_t>(across);
  }

  std::int32_t across_, down_;
  std::vector<double> tops_m_;
  std::vector<std::atomic<bool>> touched_;
};

/// A height along a normal is at most so many times its rise in the frame, and the other way round,
/// within a scene.
inline constexpr double kMostLift = 2;

}  // namespace scarp
