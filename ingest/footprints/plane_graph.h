#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace scarp {

/// Straight edges between points with whole coordinates, and how long a step of each is.
struct PlaneGraph {
  std::vector<std::array<std::int64_t, 2>> points;  ///< below 2^45 in absolute value
  std::vector<std::array<std::uint32_t, 2>> edges;
  double step_x_m = 1;
  double step_y_m = 1;
};

/// Two edges, of which one ends on or within clearance_m of the other, or that cross or are the
/// same; nothing where every pair keeps its distance but for shared ends. Crossings are decided
/// exactly, the clearance in double. Points at one place are found where both have edges.
///
/// Cost: O(n log n + pairs that overlap in x).
std::optional<std::array<std::uint32_t, 2>> find_conflict(const PlaneGraph& graph,
                                                          double clearance_m);

}  // namespace scarp
