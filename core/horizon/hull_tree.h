#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/horizon/subsector.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A vertex in the vertical plane along a subsector's middle direction.
struct PlanePoint {
  std::int64_t u;  ///< projection steps
  std::int64_t z;  ///< lattice steps
  VertexIndex vertex;
};

/// Steepest vertex seen so far from a point, or none.
struct Steepest {
  Slope slope = {0, 0};
  VertexIndex vertex = kNone;
};

/// The points inserted so far, and the steepest of those of lowest rank as seen from any point to
/// their left: the thesis's static tree of upper hulls, with the nodes that are left children
/// (a Fenwick tree). A leaf is a block of kBlock ranks, searched one by one.
///
/// Cost: insert and steepest O(log^2 n) amortised, apart from moving hull points; O(n log n)
/// memory. Source: Edmondson 2004, section 4.5.3 and figure 9.
class HullTree {
 public:
  static constexpr std::size_t kBlock = 64;

  /// Begins anew over points by rank, none of them inserted. Memory is kept for the next use.
  /// The points are not copied: they must stay where they are while the tree is used.
  void reset(std::span<const PlanePoint> by_rank);

  /// Adds the point of one rank. Requires a rank of the points, each inserted once.
  void insert(std::size_t rank);

  /// Steepest inserted point with rank < end as seen from (u, z), counting only points of greater
  /// u; of equally steep ones the nearest, then the lowest vertex.
  /// Cost: as above where every inserted point of these ranks has a greater u; O(n) otherwise.
  Steepest steepest(std::size_t end, std::int64_t u, std::int64_t z) const;

  /// Names the first broken invariant, or nothing: hulls strictly concave and of rising u, bounds
  /// right, every inserted point on or under the hulls of all its nodes.
  std::optional<std::string> check() const;

 private:
  using BlockMask = std::uint64_t;
  static_assert(kBlock == 8 * sizeof(BlockMask));

  /// Upper hull of a node's points: arena_[first, first + size), by rising u.
  struct Hull {
    std::size_t first = 0;
    std::uint32_t size = 0;
    std::uint32_t capacity = 0;
    std::int64_t low_u = 0, high_u = 0, top_z = 0;
  };

  bool insert_in_hull(Hull& hull, const PlanePoint& point);
  void replace(Hull& hull, std::size_t from, std::size_t to, const PlanePoint& point);
  void look_at_hull(const Hull& hull, std::int64_t u, std::int64_t z, Steepest& best) const;
  void look_at_block(std::size_t block, std::size_t count, std::int64_t u, std::int64_t z,
                     Steepest& best) const;
  bool is_inserted(std::size_t rank) const {
    return (inserted_[rank / kBlock] >> (rank % kBlock) & 1) != 0;
  }
  std::optional<std::string> check_hull(const Hull& hull, std::size_t begin, std::size_t end) const;

  std::vector<Hull> hulls_;        // [blocks + 1]; hull i covers blocks (i - lowest bit of i, i]
  std::vector<PlanePoint> arena_;  // room for hulls; a hull that outgrows its room moves to the end
  std::span<const PlanePoint> by_rank_;
  std::vector<BlockMask> inserted_;  // [blocks], a bit for each rank
};

}  // namespace scarp
