#include "tiles/culling/least_heights.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace scarp {
namespace {

/// More than what the arithmetic below errs in a place or a height, metres.
constexpr double kSlackM = 0x1p-10;

/// A convex figure of two or three corners, row by row.
class Strip {
 public:
  Strip(const Position* corners, std::size_t count) : corners_(corners), count_(count) {
    for (std::size_t i = 0; i < count; ++i) {
      low_y_m_ = std::min(low_y_m_, corners[i].y_m);
      high_y_m_ = std::max(high_y_m_, corners[i].y_m);
    }
  }

  double low_y_m() const { return low_y_m_ - kSlackM; }
  double high_y_m() const { return high_y_m_ + kSlackM; }

  /// Least and greatest x between two y, rounded outwards; false where there is nothing.
  bool over(double from_y_m, double to_y_m, double& low_x_m, double& high_x_m) const {
    from_y_m = std::max(from_y_m - kSlackM, low_y_m_);
    to_y_m = std::min(to_y_m + kSlackM, high_y_m_);
    low_x_m = HUGE_VAL, high_x_m = -HUGE_VAL;
    for (std::size_t i = 0; i < count_; ++i) {
      const Position &a = corners_[i], &b = corners_[(i + 1) % count_];
      const double y0_m = std::min(a.y_m, b.y_m), y1_m = std::max(a.y_m, b.y_m);
      if (y0_m > to_y_m || y1_m < from_y_m) continue;
      for (const double y_m : {std::max(from_y_m, y0_m), std::min(to_y_m, y1_m)}) {
        const double part = y1_m > y0_m ? (y_m - a.y_m) / (b.y_m - a.y_m) : 0;
        const double x_m = a.x_m + part * (b.x_m - a.x_m);
        low_x_m = std::min(low_x_m, x_m), high_x_m = std::max(high_x_m, x_m);
        if (y1_m == y0_m) low_x_m = std::min(low_x_m, b.x_m), high_x_m = std::max(high_x_m, b.x_m);
      }
    }
    low_x_m -= kSlackM, high_x_m += kSlackM;
    return low_x_m <= high_x_m;
  }

 private:
  const Position* corners_;
  std::size_t count_;
  double low_y_m_ = HUGE_VAL, high_y_m_ = -HUGE_VAL;
};

/// Calls visit(index, low x, low y) for each cell that a figure may touch.
template <class Visit>
void visit_cells(const LeastHeights& grid, const Strip& strip, Visit visit) {
  const auto clipped = [&](double place_m, std::int32_t first, std::int32_t count) {
    const double cell = std::floor(place_m / grid.cell_m) - first;
    return static_cast<std::int32_t>(std::clamp(cell, 0.0, count - 1.0));
  };
  const std::int32_t last = clipped(strip.high_y_m(), grid.first_row, grid.rows);
  for (std::int32_t row = clipped(strip.low_y_m(), grid.first_row, grid.rows); row <= last; ++row) {
    const double y_m = (row + grid.first_row) * grid.cell_m;
    double low_x_m, high_x_m;
    if (!strip.over(y_m, y_m + grid.cell_m, low_x_m, high_x_m)) continue;
    const std::int32_t end = clipped(high_x_m, grid.first_column, grid.columns);
    for (std::int32_t column = clipped(low_x_m, grid.first_column, grid.columns); column <= end;
         ++column)
      visit(grid.at(column, row), (column + grid.first_column) * grid.cell_m, y_m);
  }
}

/// The plane of a triangle.
struct Plane {
  Position at;
  double along_x, along_y;

  Plane(const Position& a, const Position& b, const Position& c) : at(a) {
    const double ux = b.x_m - a.x_m, uy = b.y_m - a.y_m, uz = b.z_m - a.z_m;
    const double vx = c.x_m - a.x_m, vy = c.y_m - a.y_m, vz = c.z_m - a.z_m;
    const double area = ux * vy - uy * vx;
    along_x = (uz * vy - vz * uy) / area;
    along_y = (ux * vz - vx * uz) / area;
  }

  double least_over(double x_m, double y_m, double size_m) const {
    const double far_x_m = along_x < 0 ? x_m + size_m : x_m;
    const double far_y_m = along_y < 0 ? y_m + size_m : y_m;
    const double x_rise_m = along_x * (far_x_m - at.x_m), y_rise_m = along_y * (far_y_m - at.y_m);
    // Of steep planes the rises are large, and so is what they err.
    return at.z_m + x_rise_m + y_rise_m - (std::abs(x_rise_m) + std::abs(y_rise_m)) * 0x1p-30;
  }
};

float round_down(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) <= value
             ? nearest
             : std::nextafter(nearest, -std::numeric_limits<float>::infinity());
}

}  // namespace

LeastHeights least_heights(const Tin& tin, double cell_m) {
  assert(cell_m > 0);
  LeastHeights grid;
  grid.cell_m = cell_m;
  if (tin.vertices.empty()) return grid;
  const Bounds bounds = bounds_of(tin.vertices);
  grid.first_column = static_cast<std::int32_t>(std::floor(bounds.low.x_m / cell_m));
  grid.first_row = static_cast<std::int32_t>(std::floor(bounds.low.y_m / cell_m));
  grid.columns =
      static_cast<std::int32_t>(std::floor(bounds.high.x_m / cell_m)) - grid.first_column + 1;
  grid.rows = static_cast<std::int32_t>(std::floor(bounds.high.y_m / cell_m)) - grid.first_row + 1;
  assert(grid.columns <= 1 << 15 && grid.rows <= 1 << 15);
  constexpr float kNoGround = std::numeric_limits<float>::infinity();
  grid.height_m.assign(grid.at(0, grid.rows), kNoGround);

  std::vector<std::array<Position, 2>> borders;
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    std::array<Position, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = tin.vertices[tin.triangles[t][i]];
    const double lowest_m = std::min({corners[0].z_m, corners[1].z_m, corners[2].z_m});
    const Plane plane(corners[0], corners[1], corners[2]);
    visit_cells(grid, Strip(corners.data(), 3), [&](std::size_t cell, double x_m, double y_m) {
      const double least_m = std::max(lowest_m, plane.least_over(x_m, y_m, cell_m)) - kSlackM;
      grid.height_m[cell] = std::min(grid.height_m[cell], round_down(least_m));
    });
    for (std::size_t i = 0; i < 3; ++i)
      if (tin.neighbours[t][i] == kNone)
        borders.push_back({corners[(i + 1) % 3], corners[(i + 2) % 3]});
  }
  // A cell that ground touches, and that no border of it does, is all over ground.
  for (const auto& border : borders)
    visit_cells(grid, Strip(border.data(), 2),
                [&](std::size_t cell, double, double) { grid.height_m[cell] = kNoGround; });
  for (float& height_m : grid.height_m)
    if (height_m == kNoGround) height_m = -std::numeric_limits<float>::infinity();
  return grid;
}

}  // namespace scarp
