#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/occlusion/leaf_groups.h"
#include "core/occlusion/seen_sample.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A place in the plane, metres, and how much being far from it weighs, for each square metre: one
/// over the plan area that a group of the size asked for would have where triangles are like this.
/// For several triangles their mean place, by weight, and the sum of their weights.
struct GrowthPlace {
  double x_m = 0;
  double y_m = 0;
  double weight = 0;
};

inline double squared_distance_m2(const GrowthPlace& a, const GrowthPlace& b) {
  return (a.x_m - b.x_m) * (a.x_m - b.x_m) + (a.y_m - b.y_m) * (a.y_m - b.y_m);
}

/// What growth by being hidden together knows of a surface.
///
/// The loss of a partition is the sum, over its groups, of triangles * eyes that see any of them,
/// plus spread_price * weight * squared distance to the group's mean place, over its triangles.
struct GrowthGround {
  SeenSample seen;
  std::vector<GrowthPlace> places;             ///< [triangles] centroids
  std::vector<std::uint32_t> first_neighbour;  ///< [triangles + 1] into neighbours
  std::vector<TriangleIndex> neighbours;       ///< across edges, then across bridges
  double spread_price = 0;                     ///< in triangles * eyes

  std::span<const TriangleIndex> neighbours_of(TriangleIndex t) const {
    return {neighbours.data() + first_neighbour[t], neighbours.data() + first_neighbour[t + 1]};
  }
};

/// A partition of the triangles: the group of each, by rising first triangle.
struct Partition {
  std::vector<GroupIndex> group_of_triangle;
  std::uint32_t count = 0;
};

/// Coalesces single triangles until there are `groups` at most, where neighbours allow it; groups
/// under min_group_triangles join a neighbour first. Each time the union that loses least; lowest
/// indices on ties. Cost: O(n log n + n words), n triangles.
Partition coalesce(const GrowthGround& ground, std::uint32_t groups,
                   std::uint32_t min_group_triangles);

/// How exchange() sees a group with some seen triangles from an eye: of c seen ones, the eye counts
/// as c / (c + softness) of one that sees the group. 0: as it is.
struct ExchangeRound {
  double softness;
  std::uint32_t sweeps;  ///< over all triangles at most, fewer when nothing moves
};

/// Moves triangles to a neighbour's group where that lowers the loss, in the order of their
/// indices. Where a group would fall apart, or fall under min_group_triangles, nothing moves.
/// Side: may leave a move out where it cannot tell within kLookAround triangles that the group
/// holds together. Cost: O(eyes) for each triangle at a border and sweep, at worst.
void exchange(const GrowthGround& ground, std::span<const ExchangeRound> rounds,
              std::uint32_t min_group_triangles, Partition& partition);

/// Triangles around a moving one that are searched for a way round it.
inline constexpr std::size_t kLookAround = 64;

}  // namespace scarp
