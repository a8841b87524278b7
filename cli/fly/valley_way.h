#pragma once

#include <cstdint>
#include <vector>

#include "core/sight/tin_index.h"

namespace scarp {

/// A place in plan.
struct PlanPoint {
  double x_m, y_m;
};

/// A way along valley floors, from one low place to another, far from it: the cheapest over a
/// coarse grid of the ground where each step costs more the higher it lies above what is around
/// it. Corners are rounded. The same seed gives the same way.
/// @return at least two places, or none where the ground has no two connected places
/// Cost: O(n log n) for a grid of n = kWayCells^2 heights.
std::vector<PlanPoint> valley_way(const TinIndex& index, std::uint64_t seed);

/// Columns and rows of that grid, at most.
inline constexpr int kWayCells = 160;

/// A way along the streets of a town, from one place to another far from it: over ground that does
/// not rise like a wall above what is around it, a cell away from what does. Taken where vertices
/// are densest of some that the seed draws, within kStreetReachM of there.
/// @return at least two places, or none where there is no such ground
std::vector<PlanPoint> street_way(const TinIndex& index, std::uint64_t seed);

inline constexpr double kStreetReachM = 600;

}  // namespace scarp
