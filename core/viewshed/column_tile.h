#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/viewshed/grid_sight.h"

namespace scarp {

/// Results of a part that sweeps over columns, gathered so that rows of the raster are written a
/// cache line at a time.
class ColumnTile {
 public:
  static constexpr std::size_t kStride = 64;

  explicit ColumnTile(std::int32_t rows)
      : sight_(static_cast<std::size_t>(rows) * kStride, Seen::kUnknown),
        marks_(static_cast<std::size_t>(rows), 0) {}

  /// Where a column's results go, kStride apart.
  Seen* column(std::int32_t column) { return &sight_[static_cast<std::size_t>(column) % kStride]; }

  /// Rows [first, last] of a column are of the part.
  void mark(std::int32_t column, std::int32_t first, std::int32_t last) {
    const std::uint64_t bit = std::uint64_t{1} << (static_cast<std::size_t>(column) % kStride);
    for (auto r = static_cast<std::size_t>(first); r <= static_cast<std::size_t>(last); ++r)
      marks_[r] |= bit;
    first_row_ = std::min(first_row_, first);
    last_row_ = std::max(last_row_, last);
  }

  static bool is_last_in_tile(std::int32_t column, std::int32_t outwards) {
    const std::size_t at = static_cast<std::size_t>(column) % kStride;
    return outwards > 0 ? at == kStride - 1 : at == 0;
  }

  /// Writes what is marked of the tile that a column belongs to, and begins anew.
  void flush(std::int32_t column, std::int32_t columns, std::span<Seen> result) {
    const std::size_t begin = static_cast<std::size_t>(column) / kStride * kStride;
    for (std::int32_t row = first_row_; row <= last_row_; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const Seen* from = &sight_[r * kStride];
      Seen* to = &result[r * static_cast<std::size_t>(columns) + begin];
      // Mostly one run of columns; where rows bend there may be more.
      for (std::uint64_t marks = marks_[r]; marks != 0;) {
        const int first = std::countr_zero(marks);
        const int length = std::countr_one(marks >> first);
        std::copy(from + first, from + first + length, to + first);
        marks = first + length == 64 ? 0 : marks >> (first + length) << (first + length);
      }
      marks_[r] = 0;
    }
    first_row_ = std::numeric_limits<std::int32_t>::max();
    last_row_ = -1;
  }

 private:
  std::vector<Seen> sight_;
  std::vector<std::uint64_t> marks_;
  std::int32_t first_row_ = std::numeric_limits<std::int32_t>::max(), last_row_ = -1;
};

}  // namespace scarp
