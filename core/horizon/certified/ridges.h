#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/horizon/certified/fan.h"
#include "core/terrain/tin.h"

namespace scarp {

/// The edges of a surface on which a horizon can lie: those that bend downwards (exact), and
/// borders, beyond which there is no ground. With the edges around each vertex, to follow them.
struct RidgeEdges {
  using Edge = std::array<VertexIndex, 2>;

  std::vector<Edge> edges;
  std::vector<std::uint32_t> first_around;  ///< [vertices + 1], into around
  std::vector<VertexIndex> around;          ///< the other ends of all edges at a vertex

  std::span<const VertexIndex> around_of(VertexIndex v) const {
    return {around.data() + first_around[v], first_around[v + 1] - first_around[v]};
  }
};

/// Requires tin.neighbours. Cost: O(triangles).
RidgeEdges ridge_edges_of(const Tin& tin);

/// Where an edge crosses the middle line of a strip.
struct RidgeCrossing {
  float u_m, z_m;
  std::uint32_t edge;  ///< into RidgeEdges::edges
};

inline constexpr std::size_t kCrossingsAtOnce = 16;

/// The part of a fan's frame from which ridges are looked for: ahead of low_u_m, in strips that
/// hold v from low_v_m to high_v_m.
struct RidgeRange {
  double low_u_m, low_v_m, high_v_m;
};

/// The ridges of a surface along a fan: for strips of equal width along its axis, the crossings of
/// their middle lines by rising u. Tells where to look for what hides; what is hidden follows from
/// the edges themselves. Side: none; heights and places are rounded.
class Ridges {
 public:
  /// Which strips there are and what they hold ahead of range.low_u_m does not depend on the range.
  /// Cost: O(edges + crossings) time, 12 bytes a crossing.
  void cross(const RidgeEdges& ridges, const FanView& view, double width_m,
             const RidgeRange& range);

  /// The crossings of the strip that holds v. Requires v in the range.
  std::span<const RidgeCrossing> along(double v_m) const;
  /// The greatest height of each kCrossingsAtOnce of them.
  std::span<const float> highest_along(double v_m) const;

 private:
  std::size_t strip_at(double v_m) const;
  /// Where a strip's greatest heights begin.
  std::size_t first_highest(std::size_t strip) const {
    return first_[strip] / kCrossingsAtOnce + strip;
  }

  double low_v_m_ = 0, width_m_ = 1;
  std::ptrdiff_t first_strip_ = 0;
  std::vector<std::size_t> first_;  // [strips + 1]
  std::vector<RidgeCrossing> crossings_;
  std::vector<float> highest_;
  // For cross: the strips of each edge, and where a strip's next crossing goes.
  std::vector<std::int32_t> first_edge_strip_, end_edge_strip_;
  std::vector<std::size_t> next_;
};

}  // namespace scarp
