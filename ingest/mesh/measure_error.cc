// The judge: shares no code with the mesher and asks nothing of it but the mesh.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/geodesy/predicates.h"
#include "ingest/mesh/mesh.h"

namespace scarp {
namespace {

using Corners = std::array<Position, 3>;

struct Place {
  std::int64_t column, row;
};

/// A convex polygon in the plane; clipping a triangle by three lines leaves at most six corners.
struct Polygon {
  std::array<std::array<double, 2>, 8> corners;
  std::size_t count = 0;
};

/// Signed area of the parallelogram a, b, (x, y): positive left of a -> b.
double side(const Position& a, const Position& b, double x, double y) {
  return (b.x_m - a.x_m) * (y - a.y_m) - (b.y_m - a.y_m) * (x - a.x_m);
}

Polygon clip(const Polygon& polygon, const Position& a, const Position& b) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const auto& p = polygon.corners[i];
    const auto& q = polygon.corners[(i + 1) % polygon.count];
    const double at_p = side(a, b, p[0], p[1]), at_q = side(a, b, q[0], q[1]);
    if (at_p >= 0) kept.corners[kept.count++] = p;
    if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) {
      const double t = at_p / (at_p - at_q);
      kept.corners[kept.count++] = {p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])};
    }
  }
  return kept;
}

/// Height over (x, y) of the plane through three corners, by areas.
double height_m(const Corners& t, double x, double y) {
  const double a = side(t[1], t[2], x, y), b = side(t[2], t[0], x, y);
  const double whole = side(t[0], t[1], t[2].x_m, t[2].y_m);
  return t[2].z_m + (a * (t[0].z_m - t[2].z_m) + b * (t[1].z_m - t[2].z_m)) / whole;
}

/// Greatest distance of two planes over what their triangles share; 0 where they share nothing.
double distance_m(const Corners& one, const Corners& other) {
  Polygon shared;
  for (const Position& p : one) shared.corners[shared.count++] = {p.x_m, p.y_m};
  for (std::size_t i = 0; i < 3 && shared.count > 0; ++i)
    shared = clip(shared, other[i], other[(i + 1) % 3]);
  double worst_m = 0;
  for (std::size_t i = 0; i < shared.count; ++i) {
    const auto& [x, y] = shared.corners[i];
    worst_m = std::max(worst_m, std::abs(height_m(one, x, y) - height_m(other, x, y)));
  }
  return worst_m;
}

class Judge {
 public:
  Judge(const SampleGrid& grid, const Mesh& mesh)
      : grid_(grid),
        mesh_(mesh),
        vertex_(grid.positions.size(), 0),
        seen_(vertex_),
        of_triangle_m_(mesh.tin.triangles.size(), 0) {
    for (const std::int64_t sample : mesh.sample_of_vertex)
      vertex_[static_cast<std::size_t>(sample)] = 1;
  }

  MeasuredError run() {
    for (std::size_t t = 0; t < mesh_.tin.triangles.size(); ++t) judge(t);
    for (std::size_t t = 0; t < mesh_.tin.triangles.size(); ++t) judge_border(t);
    count_uncovered();
    found_.over_surface_m = std::max(found_.over_surface_m, found_.at_samples_m);
    return found_;
  }

  std::vector<double> of_triangles_m() && { return std::move(of_triangle_m_); }

 private:
  void note(std::size_t triangle, double error_m) {
    of_triangle_m_[triangle] = std::max(of_triangle_m_[triangle], error_m);
  }

  Place place(std::size_t triangle, std::size_t corner) const {
    const std::int64_t sample = mesh_.sample_of_vertex[mesh_.tin.triangles[triangle][corner]];
    return {sample % grid_.columns, sample / grid_.columns};
  }

  Corners corners(std::size_t triangle) const {
    const auto& [a, b, c] = mesh_.tin.triangles[triangle];
    return {mesh_.tin.vertices[a], mesh_.tin.vertices[b], mesh_.tin.vertices[c]};
  }

  void judge(std::size_t triangle) {
    const Corners t = corners(triangle);
    Place low = place(triangle, 0), high = low;
    for (std::size_t i = 1; i < 3; ++i) {
      const Place p = place(triangle, i);
      low = {std::min(low.column, p.column), std::min(low.row, p.row)};
      high = {std::max(high.column, p.column), std::max(high.row, p.row)};
    }
    // Bent grid lines bulge out of the box of the corners by less than this.
    const double length = std::hypot(high.column - low.column, high.row - low.row);
    const auto beyond = static_cast<std::int64_t>(1 + grid_.bend_cells * length * length);
    const std::int64_t last_column =
        std::min<std::int64_t>(high.column + beyond, grid_.columns - 1);
    const std::int64_t last_row = std::min<std::int64_t>(high.row + beyond, grid_.rows - 1);
    for (std::int64_t r = std::max<std::int64_t>(low.row - beyond, 0); r <= last_row; ++r) {
      for (std::int64_t c = std::max<std::int64_t>(low.column - beyond, 0); c <= last_column; ++c) {
        judge_sample(triangle, t, static_cast<std::int32_t>(c), static_cast<std::int32_t>(r));
        if (grid_.is_ground_cell(static_cast<std::int32_t>(c), static_cast<std::int32_t>(r)))
          judge_cell(triangle, t, static_cast<std::int32_t>(c), static_cast<std::int32_t>(r));
      }
    }
  }

  void judge_sample(std::size_t triangle, const Corners& t, std::int32_t c, std::int32_t r) {
    if (!is_ground_sample(c, r)) return;
    const Position& p = grid_.at(c, r);
    for (std::size_t i = 0; i < 3; ++i)
      if (orient2d(t[i], t[(i + 1) % 3], p) < 0) return;
    seen_[grid_.index(c, r)] = 1;
    const double error_m = std::abs(p.z_m - height_m(t, p.x_m, p.y_m));
    found_.at_samples_m = std::max(found_.at_samples_m, error_m);
    note(triangle, error_m);
  }

  void judge_cell(std::size_t triangle, const Corners& t, std::int32_t c, std::int32_t r) {
    const Position &nw = grid_.at(c, r), &ne = grid_.at(c + 1, r), &sw = grid_.at(c, r + 1),
                   &se = grid_.at(c + 1, r + 1);
    for (std::size_t i = 0; i < 3; ++i) {  // most cells of the box lie beside the triangle
      bool beside = true;
      for (const Position* p : {&nw, &ne, &sw, &se})
        beside = beside && side(t[i], t[(i + 1) % 3], p->x_m, p->y_m) <= 0;
      if (beside) return;
    }
    double worst_m = 0;
    for (const Corners& half :
         {Corners{nw, sw, ne}, Corners{ne, sw, se}, Corners{nw, sw, se}, Corners{nw, se, ne}})
      worst_m = std::max(worst_m, distance_m(t, half));
    if (fills_resolved_cell(triangle, c, r)) {
      found_.cell_ambiguity_m = std::max(found_.cell_ambiguity_m, worst_m);
      return;
    }
    found_.over_surface_m = std::max(found_.over_surface_m, worst_m);
    note(triangle, worst_m);
  }

  /// Whether a triangle is one half of a cell whose four corners are vertices.
  bool fills_resolved_cell(std::size_t triangle, std::int32_t c, std::int32_t r) const {
    if (!vertex_[grid_.index(c, r)] || !vertex_[grid_.index(c + 1, r)] ||
        !vertex_[grid_.index(c, r + 1)] || !vertex_[grid_.index(c + 1, r + 1)])
      return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const Place p = place(triangle, i);
      if (p.column < c || p.column > c + 1 || p.row < r || p.row > r + 1) return false;
    }
    return true;
  }

  /// Samples along the border edges of a triangle that no triangle holds, because the chord has
  /// left them outside.
  void judge_border(std::size_t triangle) {
    const Corners t = corners(triangle);
    for (std::size_t i = 0; i < 3; ++i) {
      if (mesh_.tin.neighbours[triangle][i] != kNone) continue;
      const Place a = place(triangle, (i + 1) % 3), b = place(triangle, (i + 2) % 3);
      const std::int64_t units = std::max(std::abs(b.column - a.column), std::abs(b.row - a.row));
      for (std::int64_t k = 1; k < units; ++k) {
        const auto c = static_cast<std::int32_t>(a.column + k * (b.column - a.column) / units);
        const auto r = static_cast<std::int32_t>(a.row + k * (b.row - a.row) / units);
        if (seen_[grid_.index(c, r)]) continue;
        seen_[grid_.index(c, r)] = 1;
        const Position &p = grid_.at(c, r), &from = t[(i + 1) % 3], &to = t[(i + 2) % 3];
        const double error_m = std::abs(p.z_m - height_m(t, p.x_m, p.y_m));
        found_.at_samples_m = std::max(found_.at_samples_m, error_m);
        note(triangle, error_m);
        const double gap_m =
            -side(from, to, p.x_m, p.y_m) / std::hypot(to.x_m - from.x_m, to.y_m - from.y_m);
        found_.border_gap_cells =
            std::max(found_.border_gap_cells, gap_m / std::min(grid_.cell_x_m, grid_.cell_y_m));
      }
    }
  }

  void count_uncovered() {
    for (std::int32_t r = 0; r < grid_.rows; ++r)
      for (std::int32_t c = 0; c < grid_.columns; ++c)
        found_.uncovered_samples += is_ground_sample(c, r) && !seen_[grid_.index(c, r)];
  }

  bool is_ground_sample(std::int32_t c, std::int32_t r) const {
    return grid_.is_ground_cell(c, r) || grid_.is_ground_cell(c - 1, r) ||
           grid_.is_ground_cell(c, r - 1) || grid_.is_ground_cell(c - 1, r - 1);
  }

  const SampleGrid& grid_;
  const Mesh& mesh_;
  std::vector<std::uint8_t> vertex_, seen_;
  std::vector<double> of_triangle_m_;
  MeasuredError found_;
};

}  // namespace

MeasuredError measure_error(const SampleGrid& grid, const Mesh& mesh) {
  return Judge(grid, mesh).run();
}

std::vector<double> measure_triangle_errors(const SampleGrid& grid, const Mesh& mesh) {
  Judge judge(grid, mesh);
  judge.run();
  return std::move(judge).of_triangles_m();
}

}  // namespace scarp
