#pragma once

#include <array>
#include <optional>

#include "core/terrain/plan_bins.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Least and greatest height of a surface over rectangles of the plane.
/// Keeps a reference to the surface. Thread-safe. Cost: O(n) to make.
class GroundHeights {
 public:
  explicit GroundHeights(const Tin& tin);

  /// @return {least, greatest}, or nothing over void
  /// Accuracy: double.
  /// Cost: O(triangles over the rectangle).
  std::optional<std::array<double, 2>> over(const Bounds& rectangle) const;

 private:
  std::array<Position, 3> corners_of(TriangleIndex t) const {
    const auto& [a, b, c] = tin_.triangles[t];
    return {tin_.vertices[a], tin_.vertices[b], tin_.vertices[c]};
  }

  const Tin& tin_;
  PlanBins bins_;
};

}  // namespace scarp
