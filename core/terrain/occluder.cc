#include "core/terrain/occluder.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/geodesy/predicates.h"
#include "core/terrain/plan_bins.h"
#include "core/terrain/weld.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

using Corners = std::array<Position, 3>;

/// Triangles that one task compares.
constexpr std::size_t kTrianglesPerTask = 256;

Corners corners_of(const Tin& tin, std::size_t triangle) {
  const auto& [a, b, c] = tin.triangles[triangle];
  return {tin.vertices[a], tin.vertices[b], tin.vertices[c]};
}

/// Positive left of a -> b.
double side(const Position& a, const Position& b, double x_m, double y_m) {
  return (b.x_m - a.x_m) * (y_m - a.y_m) - (b.y_m - a.y_m) * (x_m - a.x_m);
}

/// Height of a triangle's plane, by areas.
double height_m(const Corners& t, double x_m, double y_m) {
  const double a = side(t[1], t[2], x_m, y_m), b = side(t[2], t[0], x_m, y_m);
  return t[2].z_m + (a * (t[0].z_m - t[2].z_m) + b * (t[1].z_m - t[2].z_m)) /
                        side(t[0], t[1], t[2].x_m, t[2].y_m);
}

/// Whether a figure has no corner strictly left of a -> b.
template <std::size_t kCorners>
bool is_not_left(const Position& a, const Position& b,
                 const std::array<Position, kCorners>& corners) {
  return std::all_of(corners.begin(), corners.end(),
                     [&](const Position& p) { return orient2d(a, b, p) <= 0; });
}

/// Whether the insides of two triangles meet. Exact.
bool overlap(const Corners& s, const Corners& t) {
  for (std::size_t i = 0; i < 3; ++i)
    if (is_not_left(s[i], s[(i + 1) % 3], t) || is_not_left(t[i], t[(i + 1) % 3], s)) return false;
  return true;
}

/// Whether an edge runs through the inside of a triangle. Exact.
bool runs_through(const std::array<Position, 2>& edge, const Corners& t) {
  for (std::size_t i = 0; i < 3; ++i)
    if (is_not_left(t[i], t[(i + 1) % 3], edge)) return false;
  return !is_not_left(edge[0], edge[1], t) && !is_not_left(edge[1], edge[0], t);
}

struct PlanePoint {
  double x_m, y_m;
};

/// A triangle cut by the three sides of another.
struct Polygon {
  std::array<PlanePoint, 8> corners;
  std::size_t count = 0;
};

Polygon cut_by(const Polygon& polygon, const Position& a, const Position& b) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const PlanePoint &p = polygon.corners[i], &q = polygon.corners[(i + 1) % polygon.count];
    const double at_p = side(a, b, p.x_m, p.y_m), at_q = side(a, b, q.x_m, q.y_m);
    if (at_p >= 0) kept.corners[kept.count++] = p;
    if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) {
      const double share = at_p / (at_p - at_q);
      kept.corners[kept.count++] = {p.x_m + share * (q.x_m - p.x_m),
                                    p.y_m + share * (q.y_m - p.y_m)};
    }
  }
  return kept;
}

/// What one coarse triangle finds below it.
struct Comparison {
  SurfaceGap gap;
  bool is_met = false;     // by the inside of a finer triangle
  bool is_broken = false;  // by a border of the finer surface
};

/// Whether a triangle holds a place in the plane, its border included. Exact.
bool holds(const Corners& t, const Position& p) {
  for (std::size_t i = 0; i < 3; ++i)
    if (orient2d(t[i], t[(i + 1) % 3], p) < 0) return false;
  return true;
}

/// Whether two edges cross in the plane, at the inside of both, with the first above the second.
/// Exact.
bool crosses_above(const Position& a, const Position& b, const Position& c, const Position& d) {
  if (orient2d(a, b, c) * orient2d(a, b, d) >= 0) return false;
  const int turn = orient2d(c, d, b);
  if (orient2d(c, d, a) * turn >= 0) return false;
  // Above the plane through c, d and a, b says which way a-b leaves it, and c-d lies in it.
  return orient3d(c, d, a, b) * -turn > 0;
}

/// Whether a triangle lies above another somewhere over both: at a corner of their overlay. Exact.
bool is_above(const Corners& s, const Corners& t) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (holds(t, s[i]) && orient3d(t[0], t[1], t[2], s[i]) > 0) return true;
    if (holds(s, t[i]) && orient3d(s[0], s[1], s[2], t[i]) < 0) return true;
    for (std::size_t k = 0; k < 3; ++k)
      if (crosses_above(s[i], s[(i + 1) % 3], t[k], t[(k + 1) % 3])) return true;
  }
  return false;
}

/// The finer surface of a comparison.
class FinerSurface {
 public:
  explicit FinerSurface(const Tin& tin)
      : tin_(tin),
        triangles_(tin.vertices, tin.triangles.size()),
        borders_(tin.vertices, tin.triangles.size()) {
    triangles_.fill(static_cast<std::uint32_t>(tin.triangles.size()),
                    [&](std::uint32_t t) { return corners_of(tin_, t); });
    for (std::size_t t = 0; t < tin.triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i)
        if (tin.neighbours[t][i] == kNone)
          edges_.push_back({tin.vertices[tin.triangles[t][(i + 1) % 3]],
                            tin.vertices[tin.triangles[t][(i + 2) % 3]]});
    borders_.fill(static_cast<std::uint32_t>(edges_.size()),
                  [&](std::uint32_t e) { return edges_[e]; });
  }

  /// What check_under says of one triangle.
  std::optional<std::string> check(const Corners& t, std::vector<std::uint32_t>& found) const {
    bool is_met = false;
    triangles_.find(t, found);
    for (const std::uint32_t other : found) {
      const Corners upper = corners_of(tin_, other);
      if (!overlap(t, upper)) continue;
      is_met = true;
      if (is_above(t, upper)) return "above triangle " + std::to_string(other);
    }
    if (!is_met) return "over void";
    borders_.find(t, found);
    for (const std::uint32_t e : found)
      if (runs_through(edges_[e], t)) return "partly over void";
    return std::nullopt;
  }

  /// @param found  memory to be reused
  Comparison compare(const Corners& t, std::vector<std::uint32_t>& found) const {
    Comparison result;
    triangles_.find(t, found);
    for (const std::uint32_t other : found) {
      const Corners finer = corners_of(tin_, other);
      if (!overlap(t, finer)) continue;
      result.is_met = true;
      Polygon shared;
      for (const Position& p : finer) shared.corners[shared.count++] = {p.x_m, p.y_m};
      for (std::size_t i = 0; i < 3; ++i) shared = cut_by(shared, t[i], t[(i + 1) % 3]);
      for (std::size_t i = 0; i < shared.count; ++i) {
        const auto& [x_m, y_m] = shared.corners[i];
        const double above_m = height_m(t, x_m, y_m) - height_m(finer, x_m, y_m);
        result.gap.above_m = std::max(result.gap.above_m, above_m + kGapRoundingM);
        result.gap.below_m = std::max(result.gap.below_m, kGapRoundingM - above_m);
      }
    }
    borders_.find(t, found);
    result.is_broken = std::any_of(found.begin(), found.end(),
                                   [&](std::uint32_t e) { return runs_through(edges_[e], t); });
    return result;
  }

 private:
  const Tin& tin_;
  PlanBins triangles_, borders_;
  std::vector<std::array<Position, 2>> edges_;
};

/// One comparison for each coarse triangle.
std::vector<Comparison> compare(const Tin& coarse, const Tin& finer) {
  const FinerSurface surface(finer);
  std::vector<Comparison> comparisons(coarse.triangles.size());
  parallel_for(
      (comparisons.size() + kTrianglesPerTask - 1) / kTrianglesPerTask, [&](std::size_t task) {
        std::vector<std::uint32_t> found;
        const std::size_t end = std::min(comparisons.size(), (task + 1) * kTrianglesPerTask);
        for (std::size_t t = task * kTrianglesPerTask; t < end; ++t)
          comparisons[t] = surface.compare(corners_of(coarse, t), found);
      });
  return comparisons;
}

SurfaceGap greatest_gap(std::span<const Comparison> comparisons) {
  SurfaceGap gap;
  for (const Comparison& found : comparisons) {
    gap.above_m = std::max(gap.above_m, found.gap.above_m);
    gap.below_m = std::max(gap.below_m, found.gap.below_m);
  }
  return gap;
}

/// Triangles that `keeps` keeps, and what remains of the vertices and neighbours.
template <class Keeps>
Occluder part_of(const Tin& tin, std::span<const std::int64_t> sample_of_vertex, Keeps keeps) {
  assert(sample_of_vertex.size() == tin.vertices.size());
  Occluder part;
  std::vector<TriangleIndex> new_triangle(tin.triangles.size(), kNone);
  std::vector<VertexIndex> new_vertex(tin.vertices.size(), kNone);
  TriangleIndex kept = 0;
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    if (!keeps(t)) continue;
    new_triangle[t] = kept++;
    for (const VertexIndex v : tin.triangles[t]) new_vertex[v] = 0;
  }
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    if (new_vertex[v] == kNone) continue;
    new_vertex[v] = static_cast<VertexIndex>(part.tin.vertices.size());
    part.tin.vertices.push_back(tin.vertices[v]);
    part.sample_of_vertex.push_back(sample_of_vertex[v]);
  }
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    if (new_triangle[t] == kNone) continue;
    auto corners = tin.triangles[t];
    auto across = tin.neighbours[t];
    for (VertexIndex& v : corners) v = new_vertex[v];
    for (TriangleIndex& other : across)
      if (other != kNone) other = new_triangle[other];
    part.tin.triangles.push_back(corners);
    part.tin.neighbours.push_back(across);
  }
  return part;
}

}  // namespace

SurfaceGap measure_gap(const Tin& coarse, const Tin& finer) {
  return greatest_gap(compare(coarse, finer));
}

std::optional<std::string> check_under(const Tin& lower, const Tin& upper) {
  const FinerSurface surface(upper);
  std::vector<std::uint32_t> found;
  for (std::size_t t = 0; t < lower.triangles.size(); ++t)
    if (const auto broken = surface.check(corners_of(lower, t), found))
      return "triangle " + std::to_string(t) + " lies " + *broken;
  return std::nullopt;
}

Occluder lower_under(const Tin& coarse, std::span<const std::int64_t> sample_of_vertex,
                     const Tin& finer) {
  const std::vector<Comparison> comparisons = compare(coarse, finer);
  Tin lowered = coarse;
  const auto is_covered = [&](std::size_t t) {
    return comparisons[t].is_met && !comparisons[t].is_broken;
  };
  std::vector<double> lower_by_m(coarse.vertices.size(), 0);
  for (std::size_t t = 0; t < coarse.triangles.size(); ++t)
    for (const VertexIndex v : coarse.triangles[t])
      if (is_covered(t)) lower_by_m[v] = std::max(lower_by_m[v], comparisons[t].gap.above_m);
  for (std::size_t v = 0; v < lowered.vertices.size(); ++v) {
    const double steps = std::floor((lowered.vertices[v].z_m - lower_by_m[v]) / kLatticeStepM);
    lowered.vertices[v].z_m = steps * kLatticeStepM;
  }
  Occluder occluder = part_of(lowered, sample_of_vertex, is_covered);
  occluder.gap = greatest_gap(comparisons);
  return occluder;
}

namespace {

/// A triangle's corners in samples of the raster, as a box.
struct SampleBox {
  std::int64_t low_column, low_row, high_column, high_row;
};

SampleBox box_of(const SeenTile& tile, std::int32_t columns, std::size_t triangle) {
  SampleBox box{columns, std::numeric_limits<std::int64_t>::max(), -1, -1};
  for (const VertexIndex v : tile.tin->triangles[triangle]) {
    const std::int64_t column = tile.sample_of_vertex[v] % columns;
    const std::int64_t row = tile.sample_of_vertex[v] / columns;
    box.low_column = std::min(box.low_column, column);
    box.high_column = std::max(box.high_column, column);
    box.low_row = std::min(box.low_row, row);
    box.high_row = std::max(box.high_row, row);
  }
  return box;
}

/// What of finer tiles can lie under a tile, as one surface.
Tin surface_under(const TileScheme& scheme, const TileId& tile, std::span<const SeenTile> finer) {
  const TileWindow window = scheme.window_with_halo(tile);
  std::vector<Occluder> near;
  for (const SeenTile& part : finer) {
    assert(part.id.level == tile.level + 1);
    near.push_back(reaching_into(part, scheme.columns(), window));
  }
  std::vector<const Tin*> parts;
  for (const Occluder& part : near) parts.push_back(&part.tin);
  return weld(parts).tin;
}

}  // namespace

Occluder occluder_of(const TileScheme& scheme, const SeenTile& coarse,
                     std::span<const SeenTile> finer) {
  return lower_under(*coarse.tin, coarse.sample_of_vertex, surface_under(scheme, coarse.id, finer));
}

SurfaceGap gap_of(const TileScheme& scheme, const SeenTile& coarse,
                  std::span<const SeenTile> finer) {
  return measure_gap(*coarse.tin, surface_under(scheme, coarse.id, finer));
}

Occluder reaching_into(const SeenTile& tile, std::int32_t columns, const TileWindow& window) {
  return part_of(*tile.tin, tile.sample_of_vertex, [&](std::size_t t) {
    const SampleBox box = box_of(tile, columns, t);
    return box.low_column <= window.last_column() && box.high_column >= window.first_column &&
           box.low_row <= window.last_row() && box.high_row >= window.first_row;
  });
}

Occluder outside(const SeenTile& tile, std::int32_t columns, const TileWindow& covered) {
  return part_of(*tile.tin, tile.sample_of_vertex, [&](std::size_t t) {
    const SampleBox box = box_of(tile, columns, t);
    return box.low_column < covered.first_column || box.high_column > covered.last_column() ||
           box.low_row < covered.first_row || box.high_row > covered.last_row();
  });
}

}  // namespace scarp
