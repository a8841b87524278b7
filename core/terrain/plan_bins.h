#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geodesy/position.h"

namespace scarp {

/// Square bins over the plane, each with the numbers of the triangles or edges that may touch it.
/// Immutable after fill(): any number of threads may read it.
class PlanBins {
 public:
  /// Bins over the places of some positions, about one for two of the things to be held.
  PlanBins(std::span<const Position> positions, std::size_t things);

  /// Fills the bins with things 0 to count - 1.
  /// @param corners  corners(thing): std::array of Position, a triangle's or an edge's
  template <class Corners>
  void fill(std::uint32_t count, const Corners& corners) {
    first_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
    for (std::uint32_t i = 0; i < count; ++i)
      visit_bins(corners(i), [&](std::size_t bin) { ++first_[bin + 1]; });
    for (std::size_t bin = 1; bin < first_.size(); ++bin) first_[bin] += first_[bin - 1];
    held_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < count; ++i)
      visit_bins(corners(i), [&](std::size_t bin) { held_[next[bin]++] = i; });
  }

  /// What may touch a convex figure, by rising number, each once; and others.
  void find(std::span<const Position> corners, std::vector<std::uint32_t>& found) const;

 private:
  template <class Visit>
  void visit_bins(std::span<const Position> corners, Visit visit) const {
    const auto [first_row, last_row] = rows_over(corners);
    for (std::int32_t row = first_row; row <= last_row; ++row) {
      const auto [first, last] = columns_over(corners, row);
      for (std::int32_t column = first; column <= last; ++column)
        visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
              static_cast<std::size_t>(column));
    }
  }

  struct Range {
    std::int32_t first, last;
  };
  Range rows_over(std::span<const Position> corners) const;
  Range columns_over(std::span<const Position> corners, std::int32_t row) const;

  double low_x_m_ = 0, low_y_m_ = 0, bin_m_ = 1;
  std::int32_t columns_ = 1, rows_ = 1;
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> held_;
};

}  // namespace scarp
