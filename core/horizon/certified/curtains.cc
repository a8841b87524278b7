#include "core/horizon/certified/curtains.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

constexpr float kVoid = -std::numeric_limits<float>::infinity();
constexpr float kUntouched = std::numeric_limits<float>::infinity();

/// Levels of the search for high curtains: blocks of up to 2^(kLevels - 1).
constexpr std::int32_t kLevels = 8;

/// Where an edge from a to b, with a before b, crosses u.
FanPlace crossing(const FanPlace& a, const FanPlace& b, double u_m) {
  const double share = std::clamp((u_m - a.u_m) / (b.u_m - a.u_m), 0.0, 1.0);
  return {u_m, a.v_m + share * (b.v_m - a.v_m), a.z_m + share * (b.z_m - a.z_m)};
}

}  // namespace

void Curtains::raise(const Tin& tin,
                     std::vector<std::pair<VertexIndex, VertexIndex>> const& borders,
                     const FanView& view, double spacing_m, double width_m) {
  assert(spacing_m > 0);
  spacing_m_ = spacing_m;
  width_m_ = width_m;
  low_u_m_ = view.low_u_m;
  low_v_m_ = view.low_v_m - 2 * view.error_m;
  error_m_ = view.error_m;
  height_error_m_ = view.height_error_m;
  rows_ = static_cast<std::int32_t>((view.high_u_m - low_u_m_) / spacing_m) + 1;
  strips_ = static_cast<std::int32_t>((view.high_v_m + 4 * error_m_ - low_v_m_) / width_m) + 1;
  constexpr std::int32_t kBlock = 1 << (kLevels - 1);
  padded_rows_ = (rows_ + kBlock - 1) / kBlock * kBlock;
  levels_.resize(kLevels);
  by_row_.assign(static_cast<std::size_t>(strips_) * static_cast<std::size_t>(rows_), kUntouched);
  for (const auto& corners : tin.triangles)
    hang_triangle(view.vertices[corners[0]], view.vertices[corners[1]], view.vertices[corners[2]]);
  for (const auto& [from, to] : borders) open_border(view.vertices[from], view.vertices[to]);
  for (float& least : by_row_)
    if (least == kUntouched) least = kVoid;
  build_levels();
}

/// A curtain crosses an edge where one end lies before it and the other does not, by the computed
/// numbers: so it enters each triangle as often as it leaves it, and the pieces join.
void Curtains::hang_triangle(const FanPlace& a, const FanPlace& b, const FanPlace& c) {
  const FanPlace *first = &a, *middle = &b, *last = &c;
  if (middle->u_m < first->u_m) std::swap(first, middle);
  if (last->u_m < middle->u_m) std::swap(middle, last);
  if (middle->u_m < first->u_m) std::swap(first, middle);
  const auto begin = std::max(0, static_cast<std::int32_t>(row_at(first->u_m)) - 1);
  for (std::int32_t row = begin; row < rows_; ++row) {
    const double u_m = u_of(row);
    if (!(first->u_m < u_m)) continue;
    if (last->u_m < u_m) break;
    const FanPlace other =
        middle->u_m < u_m ? crossing(*middle, *last, u_m) : crossing(*first, *middle, u_m);
    hang_piece(row, crossing(*first, *last, u_m), other);
  }
}

void Curtains::hang_piece(std::int32_t row, const FanPlace& from, const FanPlace& to) {
  const FanPlace& left = from.v_m <= to.v_m ? from : to;
  const FanPlace& right = from.v_m <= to.v_m ? to : from;
  const auto first = static_cast<std::int32_t>(strip_at(left.v_m - error_m_));
  const auto last = static_cast<std::int32_t>(strip_at(right.v_m + error_m_));
  const double least_m = std::min(left.z_m, right.z_m);
  float* out =
      by_row_.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(strips_) + first;
  const double piece_m = right.v_m - left.v_m;
  // A piece that is hardly longer than its rounding has no slope worth computing.
  const double slope = piece_m > width_m_ / 16 ? (right.z_m - left.z_m) / piece_m : 0;
  for (std::int32_t s = first; s <= last; ++s, ++out) {
    double z_m = least_m;
    if (slope > 0) {
      const double from_m = low_v_m_ + s * width_m_ - 4 * error_m_ - left.v_m;
      z_m = std::max(z_m, left.z_m + slope * from_m - height_error_m_);
    } else if (slope < 0) {
      const double to_m = low_v_m_ + (s + 1) * width_m_ + 4 * error_m_ - left.v_m;
      z_m = std::max(z_m, left.z_m + slope * to_m - height_error_m_);
    }
    *out = std::min(*out, round_down(z_m - height_error_m_));
  }
}

void Curtains::open_border(const FanPlace& a, const FanPlace& b) {
  const FanPlace& first = a.u_m <= b.u_m ? a : b;
  const FanPlace& last = a.u_m <= b.u_m ? b : a;
  const auto begin = std::max(0, static_cast<std::int32_t>(row_at(first.u_m)) - 1);
  for (std::int32_t row = begin; row < rows_; ++row) {
    const double u_m = u_of(row);
    if (!(first.u_m < u_m)) continue;
    if (last.u_m < u_m) break;
    const double v_m = crossing(first, last, u_m).v_m;
    const auto from = std::max(0, static_cast<std::int32_t>(strip_at(v_m - 2 * error_m_)));
    const auto to = std::min(strips_ - 1, static_cast<std::int32_t>(strip_at(v_m + 2 * error_m_)));
    for (std::int32_t s = from; s <= to; ++s)
      by_row_[static_cast<std::size_t>(row) * static_cast<std::size_t>(strips_) +
              static_cast<std::size_t>(s)] = kVoid;
  }
}

void Curtains::build_levels() {
  constexpr std::int32_t kTile = 16;  // of the transposition: a cache line
  levels_[0].assign(static_cast<std::size_t>(strips_) * static_cast<std::size_t>(padded_rows_),
                    kVoid);
  for (std::int32_t row_0 = 0; row_0 < rows_; row_0 += kTile)
    for (std::int32_t s_0 = 0; s_0 < strips_; s_0 += kTile)
      for (std::int32_t s = s_0; s < std::min(s_0 + kTile, strips_); ++s)
        for (std::int32_t r = row_0; r < std::min(row_0 + kTile, rows_); ++r)
          levels_[0][at(0, s) + static_cast<std::size_t>(r)] = row(r)[s];
  for (std::int32_t level = 1; level < kLevels; ++level) {
    const std::vector<float>& below = levels_[static_cast<std::size_t>(level - 1)];
    std::vector<float>& here = levels_[static_cast<std::size_t>(level)];
    here.resize(below.size() / 2);
    for (std::size_t i = 0; i < here.size(); ++i)
      here[i] = std::max(below[2 * i], below[2 * i + 1]);
  }
}

}  // namespace scarp
