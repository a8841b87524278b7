#pragma once

#include <cstdint>
#include <vector>

#include "core/culling/group_batches.h"

namespace scarp {

/// Coarser versions of a scene's groups, each with a share of the triangles, for pictures that only
/// tell what hides what. Borders are not kept: neighbours may gape.
class CoarseBatches {
 public:
  /// @param shares  of the triangles, each in (0, 1), one a level, finest first
  /// Cost: O(n) a level, about 0.1 microseconds a triangle. Source: meshoptimizer's sloppy
  ///   simplification.
  CoarseBatches(const GroupBatches& batches, const std::vector<double>& shares);

  std::size_t levels() const { return levels_.size(); }

  std::uint32_t triangles(std::size_t level, GroupIndex group) const {
    return levels_[level].first_triangle[group + 1] - levels_[level].first_triangle[group];
  }

  /// Adds a group at a level; its object number is the group's.
  void add_to(std::size_t level, GroupIndex group, GroupBatches::Drawing& drawing) const;

  /// Memory of all levels.
  std::uint64_t bytes() const;

 private:
  struct Level {
    std::vector<std::uint32_t> first_vertex, first_triangle;  // [groups + 1]
    std::vector<Position> vertices;
    std::vector<std::array<VertexIndex, 3>> triangles;  // within their group
  };

  std::vector<Level> levels_;
};

}  // namespace scarp
