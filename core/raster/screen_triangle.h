#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace scarp {

/// Corners of triangles are rounded to this part of a pixel, once; coverage is exact from there.
inline constexpr int kSubpixels = 256;
inline constexpr std::int64_t kHalfPixel = kSubpixels / 2;

/// First row or column whose pixel centre is at or after the coordinate.
inline int first_centre(std::int64_t subpixels) {
  static_assert(kSubpixels == 1 << 8);
  return static_cast<int>((subpixels - kHalfPixel + kSubpixels - 1) >> 8);
}

/// A corner on the screen, in subpixels from the upper left.
struct ScreenCorner {
  std::int32_t x, y;
  double depth;
};

/// A triangle ready to be drawn: corners in subpixels from the upper left, clockwise on the screen;
/// depth as a plane from the first corner, by subpixels.
struct ScreenTriangle {
  std::array<std::int32_t, 3> x;
  std::array<std::int32_t, 3> y;
  double depth;
  double depth_per_x;
  double depth_per_y;
  std::uint32_t object;

  /// Depth at a pixel's centre.
  float depth_at(int column, int row) const {
    const double dx = static_cast<double>(column) * kSubpixels + kHalfPixel - x[0];
    const double dy = static_cast<double>(row) * kSubpixels + kHalfPixel - y[0];
    return static_cast<float>(depth + depth_per_x * dx + depth_per_y * dy);
  }
  float depth_step() const { return static_cast<float>(depth_per_x * kSubpixels); }
};

/// Makes a triangle of its corners, however they turn.
/// @return whether it has any area; without, nothing is made
inline bool set_up(const ScreenCorner& a, ScreenCorner b, ScreenCorner c, std::uint32_t object,
                   ScreenTriangle& triangle) {
  std::int64_t x1 = b.x - a.x, y1 = b.y - a.y;
  std::int64_t x2 = c.x - a.x, y2 = c.y - a.y;
  std::int64_t twice_area = x1 * y2 - x2 * y1;
  if (twice_area == 0) return false;
  if (twice_area < 0) {
    std::swap(b, c);
    std::swap(x1, x2);
    std::swap(y1, y2);
    twice_area = -twice_area;
  }
  const double depth1 = b.depth - a.depth;
  const double depth2 = c.depth - a.depth;
  const double scale = 1 / static_cast<double>(twice_area);
  triangle = {{a.x, b.x, c.x},
              {a.y, b.y, c.y},
              a.depth,
              (depth1 * static_cast<double>(y2) - depth2 * static_cast<double>(y1)) * scale,
              (depth2 * static_cast<double>(x1) - depth1 * static_cast<double>(x2)) * scale,
              object};
  return true;
}

/// A rectangle of a picture, [left, right) x [top, bottom) in pixels, and where its pixels are.
struct PixelTile {
  int left, top, right, bottom;
  std::size_t stride_px;  ///< from one row to the next
  float* depth;           ///< of the picture's first pixel
  std::uint32_t* object;  ///< the same, or null: depth alone

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * stride_px + static_cast<std::size_t>(column);
  }
};

/// Walks down an edge and knows, in each row, the first column whose centre is at or right of it:
/// the exact ceiling of a fraction, kept as quotient and shortfall. Every triangle on either side
/// of the edge asks for the same number, which is what makes shared edges meet.
class EdgeWalk {
 public:
  EdgeWalk() = default;

  /// Requires y_bottom > y_top, and the row's centre between them.
  EdgeWalk(std::int64_t x_top, std::int64_t y_top, std::int64_t x_bottom, std::int64_t y_bottom,
           int row) {
    const std::int64_t dx = x_bottom - x_top;
    const std::int64_t dy = y_bottom - y_top;
    const std::int64_t y = static_cast<std::int64_t>(row) * kSubpixels + kHalfPixel;
    divisor_ = dy * kSubpixels;
    const std::int64_t numerator = (x_top - kHalfPixel) * dy + (y - y_top) * dx;
    column_ = -floor_divide(-numerator, divisor_);
    shortfall_ = column_ * divisor_ - numerator;
    // A row further down adds kSubpixels * dx / divisor_ = dx / dy columns.
    column_step_ = floor_divide(dx, dy);
    remainder_step_ = (dx - column_step_ * dy) * kSubpixels;
  }

  std::int64_t column() const { return column_; }

  void step() {
    column_ += column_step_;
    shortfall_ -= remainder_step_;
    if (shortfall_ < 0) {
      ++column_;
      shortfall_ += divisor_;
    }
  }

 private:
  static std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
    const std::int64_t quotient = a / b;
    return quotient - (a % b < 0 ? 1 : 0);
  }

  std::int64_t column_ = 0;     // ceiling of numerator / divisor
  std::int64_t shortfall_ = 0;  // column * divisor - numerator, in [0, divisor)
  std::int64_t divisor_ = 1;
  std::int64_t column_step_ = 0;
  std::int64_t remainder_step_ = 0;
};

/// The runs of pixels of a triangle in a tile, row by row: the definition of what it covers.
class RowWalk {
 public:
  RowWalk(const ScreenTriangle& triangle, const PixelTile& tile) : t_(triangle), tile_(tile) {
    // From top to bottom; every exchange turns the triangle over.
    const auto exchange_if_lower = [&](int& a, int& b) {
      if (t_.y[at(b)] >= t_.y[at(a)]) return;
      std::swap(a, b);
      longest_is_left_ = !longest_is_left_;
    };
    exchange_if_lower(top_, middle_);
    exchange_if_lower(middle_, bottom_);
    exchange_if_lower(top_, middle_);
    row_ = std::max(tile.top, first_centre(t_.y[at(top_)]));
    end_ = std::min(tile.bottom, first_centre(t_.y[at(bottom_)]));
    if (row_ >= end_) return;
    turn_ = std::clamp(first_centre(t_.y[at(middle_)]), row_, end_);
    left_ = right_ = edge(top_, bottom_);
    (longest_is_left_ ? right_ : left_) =
        row_ < turn_ ? edge(top_, middle_) : edge(middle_, bottom_);
  }

  /// The next run, [begin, end) of a row, which is not empty; false when there is none.
  bool next(int& row, int& begin, int& end) {
    while (row_ < end_) {
      if (row_ == turn_) (longest_is_left_ ? right_ : left_) = edge(middle_, bottom_);
      row = row_++;
      begin = static_cast<int>(std::max<std::int64_t>(left_.column(), tile_.left));
      end = static_cast<int>(std::min<std::int64_t>(right_.column(), tile_.right));
      left_.step();
      right_.step();
      if (begin < end) return true;
    }
    return false;
  }

 private:
  static std::size_t at(int corner) { return static_cast<std::size_t>(corner); }
  EdgeWalk edge(int a, int b) const {
    return {t_.x[at(a)], t_.y[at(a)], t_.x[at(b)], t_.y[at(b)], row_};
  }

  const ScreenTriangle& t_;
  const PixelTile tile_;
  int top_ = 0, middle_ = 1, bottom_ = 2;  // corners
  bool longest_is_left_ = true;
  int row_ = 0, end_ = 0, turn_ = 0;
  EdgeWalk left_, right_;
};

}  // namespace scarp
