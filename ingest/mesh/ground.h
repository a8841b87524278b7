#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "ingest/mesh/sample_plane.h"

namespace scarp {

/// The ground cells of a grid, one byte each; a cell is named by its upper left sample.
class GroundCells {
 public:
  explicit GroundCells(const SampleGrid& grid);

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

/// The whole border of the ground in straight pieces that end where the border turns or touches
/// itself, and where a longer chord would run farther than kBorderDeviationCells from the samples
/// in flattened space. Cost: O(samples), O(length log length) for what bends.
std::vector<BorderRun> ground_border(const SampleGrid& grid, const GroundCells& ground);

/// Known samples that are the corner of no ground cell.
std::uint32_t count_lost_samples(const SampleGrid& grid, const GroundCells& ground);

}  // namespace scarp
