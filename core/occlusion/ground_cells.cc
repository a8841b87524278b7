#include "core/occlusion/ground_cells.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

/// Most nodes to a triangle, as a multiple of what is asked for, where the bounds are mostly void.
constexpr double kMostVoid = 4;

double twice_area_m2(const std::array<Position, 3>& p) {
  return (p[1].x_m - p[0].x_m) * (p[2].y_m - p[0].y_m) -
         (p[1].y_m - p[0].y_m) * (p[2].x_m - p[0].x_m);
}

std::array<Position, 3> corners_of(const Tin& tin, TriangleIndex t) {
  const auto& [a, b, c] = tin.triangles[t];
  return {tin.vertices[a], tin.vertices[b], tin.vertices[c]};
}

/// Writes the heights at the nodes in a triangle. Its corners are in cells from the first node.
void draw(const std::array<Position, 3>& p, GroundCells& ground) {
  const double twice_area = twice_area_m2(p);
  const double rise_x = ((p[1].z_m - p[0].z_m) * (p[2].y_m - p[0].y_m) -
                         (p[2].z_m - p[0].z_m) * (p[1].y_m - p[0].y_m)) /
                        twice_area;
  const double rise_y = ((p[2].z_m - p[0].z_m) * (p[1].x_m - p[0].x_m) -
                         (p[1].z_m - p[0].z_m) * (p[2].x_m - p[0].x_m)) /
                        twice_area;
  const auto [low, high] = std::minmax({p[0].y_m, p[1].y_m, p[2].y_m});
  for (auto row = static_cast<std::int32_t>(std::ceil(low)); row <= high; ++row) {
    double west = ground.columns, east = -1;
    for (std::size_t i = 0; i < 3; ++i) {
      const Position &from = p[i], &to = p[(i + 1) % 3];
      if (std::min(from.y_m, to.y_m) > row || std::max(from.y_m, to.y_m) < row) continue;
      const double along = from.y_m == to.y_m ? 0 : (row - from.y_m) / (to.y_m - from.y_m);
      const double x = from.x_m + along * (to.x_m - from.x_m);
      west = std::min({west, x, from.y_m == to.y_m ? to.x_m : x});
      east = std::max({east, x, from.y_m == to.y_m ? to.x_m : x});
    }
    const auto last = std::min(ground.columns - 1, static_cast<std::int32_t>(std::floor(east)));
    for (auto column = static_cast<std::int32_t>(std::ceil(west)); column <= last; ++column)
      ground.height_m[ground.at(column, row)] =
          static_cast<float>(p[0].z_m + rise_x * (column - p[0].x_m) + rise_y * (row - p[0].y_m));
  }
}

/// One viewshed, ring by ring.
class Rings {
 public:
  Rings(const GroundCells& ground, const Position& eye, std::span<float> seen_above_m)
      : ground_(ground),
        seen_above_m_(seen_above_m),
        eye_z_m_(static_cast<float>(eye.z_m)),
        column_(ground.column_of(eye.x_m)),
        row_(ground.row_of(eye.y_m)) {}

  void draw_all() {
    seen_above_m_[ground_.at(column_, row_)] = kVoidHeightM;
    const std::int32_t last =
        std::max({column_, row_, ground_.columns - 1 - column_, ground_.rows - 1 - row_});
    for (ring_ = 1; ring_ <= last; ++ring_) {
      nearer_ = static_cast<float>(ring_ - 1) / static_cast<float>(ring_);
      farther_ = ring_ == 1 ? 0 : static_cast<float>(ring_) / static_cast<float>(ring_ - 1);
      for (const std::int32_t side : {-ring_, ring_}) {
        draw_row(side);
        draw_column(side);
      }
    }
  }

 private:
  void draw_row(std::int32_t side) {
    const std::int32_t row = row_ + side;
    if (row < 0 || row >= ground_.rows) return;
    const std::int32_t nearer = row - (side > 0 ? 1 : -1);
    const std::int32_t last = std::min(ground_.columns - 1, column_ + ring_);
    for (std::int32_t column = std::max(0, column_ - ring_); column <= last; ++column) {
      const Crossing crossing = crossing_of(column_, column - column_);
      draw_node(ground_.at(column, row), ground_.at(crossing.first, nearer),
                ground_.at(crossing.second, nearer), crossing.share);
    }
  }

  void draw_column(std::int32_t side) {
    const std::int32_t column = column_ + side;
    if (column < 0 || column >= ground_.columns) return;
    const std::int32_t nearer = column - (side > 0 ? 1 : -1);
    const std::int32_t last = std::min(ground_.rows - 1, row_ + ring_ - 1);
    for (std::int32_t row = std::max(0, row_ - ring_ + 1); row <= last; ++row) {
      const Crossing crossing = crossing_of(row_, row - row_);
      draw_node(ground_.at(column, row), ground_.at(nearer, crossing.first),
                ground_.at(nearer, crossing.second), crossing.share);
    }
  }

  /// Where the sight line to a node `offset` beside the eye crosses the ring before.
  struct Crossing {
    std::int32_t first, second;
    float share;  // of the second
  };
  Crossing crossing_of(std::int32_t eye_at, std::int32_t offset) const {
    const float crossed = static_cast<float>(std::abs(offset)) * nearer_;
    const auto whole = static_cast<std::int32_t>(crossed);
    const float share = crossed - static_cast<float>(whole);
    const std::int32_t beyond = share > 0 ? whole + 1 : whole;
    return offset < 0 ? Crossing{eye_at - whole, eye_at - beyond, share}
                      : Crossing{eye_at + whole, eye_at + beyond, share};
  }

  void draw_node(std::size_t node, std::size_t first, std::size_t second, float share) {
    const float height_m = ground_.height_m[node] - eye_z_m_;
    if (ring_ == 1) {
      seen_above_m_[node] = height_m;
      return;
    }
    const float line_m =
        ((1 - share) * seen_above_m_[first] + share * seen_above_m_[second]) * farther_;
    seen_above_m_[node] = std::max({line_m, height_m, kVoidHeightM});
  }

  const GroundCells& ground_;
  std::span<float> seen_above_m_;
  float eye_z_m_;
  std::int32_t column_, row_;
  std::int32_t ring_ = 0;
  float nearer_ = 0, farther_ = 0;  // from this ring to the one before, and back
};

}  // namespace

std::int32_t GroundCells::column_of(double x_m) const {
  return static_cast<std::int32_t>(
      std::clamp(std::round((x_m - low_x_m) / cell_m), 0.0, columns - 1.0));
}

std::int32_t GroundCells::row_of(double y_m) const {
  return static_cast<std::int32_t>(
      std::clamp(std::round((y_m - low_y_m) / cell_m), 0.0, rows - 1.0));
}

GroundCells sample_ground(const Tin& tin, double per_triangle) {
  assert(per_triangle > 0 && !tin.triangles.empty());
  const Bounds bounds = bounds_of(tin.vertices);
  const double width_m = bounds.high.x_m - bounds.low.x_m;
  const double height_m = bounds.high.y_m - bounds.low.y_m;
  double area_m2 = 0;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    area_m2 += twice_area_m2(corners_of(tin, t)) / 2;
  const double nodes = per_triangle * static_cast<double>(tin.triangles.size());
  GroundCells ground;
  ground.low_x_m = bounds.low.x_m;
  ground.low_y_m = bounds.low.y_m;
  ground.cell_m = std::sqrt(std::max(area_m2, width_m * height_m / kMostVoid) / nodes);
  ground.columns = static_cast<std::int32_t>(width_m / ground.cell_m) + 2;
  ground.rows = static_cast<std::int32_t>(height_m / ground.cell_m) + 2;
  ground.height_m.assign(ground.at(0, ground.rows), kVoidHeightM);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    std::array<Position, 3> corners = corners_of(tin, t);
    for (Position& p : corners) {
      p.x_m = (p.x_m - ground.low_x_m) / ground.cell_m;
      p.y_m = (p.y_m - ground.low_y_m) / ground.cell_m;
    }
    draw(corners, ground);
  }
  return ground;
}

void estimate_viewshed(const GroundCells& ground, const Position& eye,
                       std::span<float> seen_above_m) {
  assert(seen_above_m.size() == ground.height_m.size());
  Rings(ground, eye, seen_above_m).draw_all();
}

}  // namespace scarp
