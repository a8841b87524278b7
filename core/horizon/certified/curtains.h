#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/horizon/certified/fan.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Lower bounds of the ground along lines across a fan: curtains that every ray of the fan has to
/// pass. Curtain r stands over the line u = u_of(r) and is cut into strips of equal width along v.
/// least(strip, r) is at or below all ground over that piece; -infinity where any of it is void or
/// outside the data.
///
/// Exact but for rounding, which goes down: along a curtain the ground runs straight from mesh edge
/// to mesh edge, and its least height over each strip is taken from those lines. The curtain of
/// the numbers stands within error_m of the line u = u_of(r), because the place where an edge
/// crosses it is computed as a share of the edge, which no steepness of the ground makes worse.
class Curtains {
 public:
  /// @param view       vertices of `tin` in the fan's frame
  /// @param borders    the mesh edges with a triangle on one side only
  /// @param spacing_m  between curtains, and width of a strip
  /// Cost: O(triangles * (1 + (size / spacing)^2)) time, 8 bytes a strip and curtain.
  void raise(const Tin& tin, std::vector<std::pair<VertexIndex, VertexIndex>> const& borders,
             const FanView& view, double spacing_m, double width_m);

  double spacing_m() const { return spacing_m_; }
  std::int32_t rows() const { return rows_; }
  std::int32_t strips() const { return strips_; }
  double u_of(std::int32_t row) const { return low_u_m_ + row * spacing_m_; }
  /// Strips and rows as real numbers; the caller leaves room for rounding.
  double strip_at(double v_m) const { return (v_m - low_v_m_) / width_m_; }
  double row_at(double u_m) const { return (u_m - low_u_m_) / spacing_m_; }

  /// The least heights of one curtain, by strip.
  const float* row(std::int32_t row) const {
    return by_row_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(strips_);
  }

  /// Greatest of the least heights of 2^level curtains from row << level on, in one strip.
  float highest(std::int32_t level, std::int32_t s, std::int32_t row_block) const {
    return levels_[static_cast<std::size_t>(level)]
                  [at(level, s) + static_cast<std::size_t>(row_block)];
  }
  std::int32_t level_count() const { return static_cast<std::int32_t>(levels_.size()); }

 private:
  std::size_t at(std::int32_t level, std::int32_t s) const {
    return static_cast<std::size_t>(s) * static_cast<std::size_t>(padded_rows_ >> level);
  }
  void hang_triangle(const FanPlace& a, const FanPlace& b, const FanPlace& c);
  void hang_piece(std::int32_t row, const FanPlace& from, const FanPlace& to);
  void open_border(const FanPlace& a, const FanPlace& b);
  void build_levels();

  double spacing_m_ = 1, width_m_ = 1, low_u_m_ = 0, low_v_m_ = 0;
  double error_m_ = 0, height_error_m_ = 0;
  std::int32_t rows_ = 0, padded_rows_ = 0, strips_ = 0;
  std::vector<float> by_row_;               // [row][strip]
  std::vector<std::vector<float>> levels_;  // [level][strip][row >> level]
};

/// The double as a float that is not greater.
inline float round_down(double value) {
  return static_cast<float>(value - (value < 0 ? -value : value) * 0x1p-23);
}

}  // namespace scarp
