#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "ingest/mesh/mesh.h"
#include "ingest/mesh/sample_plane.h"

namespace scarp {

/// The samples of a grid that a mesh is made of, both ends included: all of them, or a tile's own.
struct SampleRange {
  GridNode first, last;
};

inline SampleRange all_samples(const SampleGrid& grid) {
  return {{0, 0}, {grid.columns - 1, grid.rows - 1}};
}

/// The ground cells of a grid, one byte each; a cell is named by its upper left sample.
class GroundCells {
 public:
  explicit GroundCells(const SampleGrid& grid) : GroundCells(grid, all_samples(grid)) {}
  /// Those between the samples of a range.
  GroundCells(const SampleGrid& grid, const SampleRange& range);

  /// False for cells beside the grid.
  bool operator()(std::int32_t column, std::int32_t row) const {
    if (column < 0 || row < 0 || column >= columns_ - 1 || row >= rows_ - 1) return false;
    return ground_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(column)] != 0;
  }
  std::uint64_t count() const { return count_; }
  /// Whether a sample is the corner of a ground cell.
  bool touches(const GridNode& n) const {
    return (*this)(n.column, n.row) || (*this)(n.column - 1, n.row) ||
           (*this)(n.column, n.row - 1) || (*this)(n.column - 1, n.row - 1);
  }

 private:
  std::int32_t columns_, rows_;
  std::vector<std::uint8_t> ground_;
  std::uint64_t count_ = 0;
};

/// A straight piece of the ground's border along a grid row or column, from its lower sample index
/// to its higher. Pieces meet only at their ends.
struct BorderRun {
  GridNode from, to;
};

/// What lies on a tile's edge: pieces of the ground's border, and pieces between ground and ground.
struct TileBorder {
  std::vector<BorderRun> runs;
  /// Samples on the tile's edges, between the ends of pieces, that must not become vertices.
  std::vector<GridNode> locked;
};

/// The whole border of the ground in straight pieces that end where the border turns or touches
/// itself, and where a longer chord would run farther than kBorderDeviationCells from the samples
/// in flattened space. Cost: O(samples), O(length log length) for what bends.
std::vector<BorderRun> ground_border(const SampleGrid& grid, const GroundCells& ground);

/// The border of a tile's ground: as ground_border, but that edges of the range with ground beyond
/// are cut as the tile beyond will cut them (mesh_tile). Pieces end wherever one of the two sides
/// begins or ends to be ground, and at the corners of the range.
///
/// @param grid    holds one more sample around the range, where there is one
/// @param ground  of the range
TileBorder tile_border(const SampleGrid& grid, const GroundCells& ground, const SampleRange& range,
                       double max_error_m, MeshBound bound);

/// Known samples of a range that are the corner of no ground cell of the grid. Of samples on the
/// range's last column and row only where the grid ends there: others belong to the next tile.
std::uint32_t count_lost_samples(const SampleGrid& grid, const SampleRange& range);

}  // namespace scarp
