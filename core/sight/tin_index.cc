#include "core/sight/tin_index.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/geodesy/predicates.h"
#include "core/sight/lattice_algebra.h"
#include "core/sight/triangle_walk.h"

namespace scarp {
namespace {

/// Bins are chosen so that there are about this many per triangle: a sight line then tests few
/// edges per bin, and most bins fall to the height floor.
constexpr double kBinsPerTriangle = 1.0;

/// Widening of everything that is put into or looked up in bins: one lattice step, which is above
/// any rounding error of the interpolation there (2^-22 m at the lattice's reach).
constexpr double kBinMarginM = kLatticeStepM;

/// The next border edge around the same void: of the border edges that leave where `edge` ends,
/// the first one counter-clockwise from looking back along `edge`, because the void lies there.
std::uint32_t next_around_void(const Tin& tin, std::span<const MeshEdge> edges, std::uint32_t edge,
                               std::span<const std::uint32_t> leaving) {
  const Position& at = tin.vertices[edges[edge].to];
  const Position& back = tin.vertices[edges[edge].from];
  const auto is_before = [&](const Position& p, const Position& q) {
    const bool p_in_first_half = orient2d(at, back, p) > 0;
    const bool q_in_first_half = orient2d(at, back, q) > 0;
    if (p_in_first_half != q_in_first_half) return p_in_first_half;
    return orient2d(at, p, q) > 0;
  };
  return *std::min_element(leaving.begin(), leaving.end(), [&](std::uint32_t a, std::uint32_t b) {
    return is_before(tin.vertices[edges[a].to], tin.vertices[edges[b].to]);
  });
}

}  // namespace

HeightFloor::HeightFloor(const Position& eye, std::span<const Position> targets) : eye_(eye) {
  assert(!targets.empty());
  double sum_x = 0, sum_y = 0;
  rise_m_ = std::numeric_limits<double>::infinity();
  for (const Position& target : targets) {
    sum_x += target.x_m - eye.x_m;
    sum_y += target.y_m - eye.y_m;
    rise_m_ = std::min(rise_m_, target.z_m - eye.z_m);
  }
  const double length = std::hypot(sum_x, sum_y);
  if (length == 0) return;
  axis_x_ = sum_x / length;
  axis_y_ = sum_y / length;
  least_run_m_ = std::numeric_limits<double>::infinity();
  greatest_run_m_ = 0;
  for (const Position& target : targets) {
    const double run = (target.x_m - eye.x_m) * axis_x_ + (target.y_m - eye.y_m) * axis_y_;
    least_run_m_ = std::min(least_run_m_, run);
    greatest_run_m_ = std::max(greatest_run_m_, run);
  }
  active_ = least_run_m_ > 0 && std::abs(rise_m_) <= kSteepestFloor * least_run_m_;
}

bool HeightFloor::clears(double centre_x_m, double centre_y_m, double half_m,
                         double highest_m) const {
  if (!active_) return false;
  const double run = (centre_x_m - eye_.x_m) * axis_x_ + (centre_y_m - eye_.y_m) * axis_y_;
  const double half_run = half_m * (std::abs(axis_x_) + std::abs(axis_y_));
  // A line is at the height eye + share * (its target - eye): lowest for the lowest target, at the
  // near end of the box where that lies above the eye, at the far end where it lies below.
  const double share = rise_m_ >= 0 ? std::max(0.0, (run - half_run) / greatest_run_m_)
                                    : std::min(1.0, (run + half_run) / least_run_m_);
  return highest_m < eye_.z_m + share * rise_m_ - kHeightFloorMarginM;
}

TinIndex::TinIndex(const Tin& tin) : tin_(tin) {
  assert(tin.neighbours.size() == tin.triangles.size());
  list_edges();
  lay_out_bins();
  fill_bins();
  find_hole_edges();
}

void TinIndex::list_edges() {
  edges_.reserve(tin_.triangles.size() * 3 / 2 + 2);
  for (TriangleIndex t = 0; t < tin_.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const TriangleIndex across = tin_.neighbours[t][corner];
      if (across != kNone && across < t) continue;
      edges_.push_back(
          {tin_.triangles[t][(corner + 1) % 3], tin_.triangles[t][(corner + 2) % 3], t, across});
    }
  }
}

void TinIndex::lay_out_bins() {
  if (tin_.triangles.empty()) return;
  const Bounds bounds = bounds_of(tin_.vertices);
  low_x_m_ = bounds.low.x_m;
  low_y_m_ = bounds.low.y_m;
  const double width_m = bounds.high.x_m - bounds.low.x_m;
  const double height_m = bounds.high.y_m - bounds.low.y_m;
  const double bins = kBinsPerTriangle * static_cast<double>(tin_.triangles.size());
  // A long and narrow scene gets bins no smaller than its length over their number.
  bin_m_ = std::max({std::sqrt(width_m * height_m / bins), width_m / bins, height_m / bins});
  columns_ = static_cast<std::int32_t>(width_m / bin_m_) + 1;
  rows_ = static_cast<std::int32_t>(height_m / bin_m_) + 1;
}

std::int32_t TinIndex::column_of(double x_m) const {
  return static_cast<std::int32_t>(
      std::clamp(std::floor((x_m - low_x_m_) / bin_m_), -1.0, static_cast<double>(columns_)));
}

std::int32_t TinIndex::row_of(double y_m) const {
  return static_cast<std::int32_t>(
      std::clamp(std::floor((y_m - low_y_m_) / bin_m_), -1.0, static_cast<double>(rows_)));
}

TinIndex::RowRange TinIndex::columns_over(std::span<const Position> corners) const {
  double low = corners[0].x_m, high = low;
  for (const Position& p : corners) {
    low = std::min(low, p.x_m);
    high = std::max(high, p.x_m);
  }
  return {std::max(0, column_of(low - kBinMarginM)),
          std::min(columns_ - 1, column_of(high + kBinMarginM))};
}

TinIndex::RowRange TinIndex::rows_over(std::span<const Position> corners,
                                       std::int32_t column) const {
  const double left = low_x_m_ + column * bin_m_ - kBinMarginM;
  const double right = low_x_m_ + (column + 1) * bin_m_ + kBinMarginM;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = i + 1; k < corners.size(); ++k) {
      const Position& p = corners[i].x_m <= corners[k].x_m ? corners[i] : corners[k];
      const Position& q = corners[i].x_m <= corners[k].x_m ? corners[k] : corners[i];
      const double from = std::max(left, p.x_m), to = std::min(right, q.x_m);
      if (from > to) continue;
      const auto [least, greatest] = std::minmax(p.y_m, q.y_m);
      // Vertical in plan: the whole length. Otherwise the two ends within the column, kept inside
      // the segment's own range, so that the error is at most 4u of its length in y.
      const double slope = q.x_m > p.x_m ? (q.y_m - p.y_m) / (q.x_m - p.x_m) : 0;
      const double at_from = q.x_m > p.x_m ? p.y_m + (from - p.x_m) * slope : least;
      const double at_to = q.x_m > p.x_m ? p.y_m + (to - p.x_m) * slope : greatest;
      low = std::min(low, std::max(least, std::min(at_from, at_to)));
      high = std::max(high, std::min(greatest, std::max(at_from, at_to)));
    }
  }
  if (low > high) return {};
  return {std::max(0, row_of(low - kBinMarginM)), std::min(rows_ - 1, row_of(high + kBinMarginM))};
}

void TinIndex::fill_bins() {
  const std::size_t bins = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  bin_highest_m_.assign(bins, -std::numeric_limits<double>::infinity());
  bin_has_border_.assign(bins, 0);
  // Twice through everything: count, then write.
  const auto fill = [&](std::size_t items, auto corners_of, std::vector<std::uint32_t>& first,
                        std::vector<std::uint32_t>& content) {
    first.assign(bins + 1, 0);
    const auto each_bin = [&](auto body) {
      for (std::size_t item = 0; item < items; ++item)
        visit_bins(corners_of(item), [&](std::int32_t column, std::int32_t row) {
          body(bin(column, row), static_cast<std::uint32_t>(item));
          return false;
        });
    };
    each_bin([&](std::size_t b, std::uint32_t) { ++first[b + 1]; });
    for (std::size_t b = 0; b < bins; ++b) first[b + 1] += first[b];
    content.resize(first[bins]);
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    each_bin([&](std::size_t b, std::uint32_t item) { content[next[b]++] = item; });
  };
  fill(
      tin_.triangles.size(),
      [&](std::size_t t) {
        const auto& [a, b, c] = tin_.triangles[t];
        return std::array<Position, 3>{tin_.vertices[a], tin_.vertices[b], tin_.vertices[c]};
      },
      first_triangle_, bin_triangles_);
  fill(
      edges_.size(),
      [&](std::size_t e) {
        return std::array<Position, 2>{tin_.vertices[edges_[e].from], tin_.vertices[edges_[e].to]};
      },
      first_edge_, bin_edges_);
  for (std::size_t b = 0; b < bins; ++b) {
    for (std::uint32_t i = first_edge_[b]; i < first_edge_[b + 1]; ++i) {
      const MeshEdge& edge = edges_[bin_edges_[i]];
      bin_highest_m_[b] =
          std::max({bin_highest_m_[b], tin_.vertices[edge.from].z_m, tin_.vertices[edge.to].z_m});
      if (edge.is_border()) bin_has_border_[b] = 1;
    }
  }
}

void TinIndex::find_hole_edges() {
  // Border edges by the vertex that they leave.
  std::vector<std::uint32_t> first(tin_.vertices.size() + 1, 0);
  for (const MeshEdge& edge : edges_) first[edge.from + 1] += edge.is_border();
  for (std::size_t v = 0; v < tin_.vertices.size(); ++v) first[v + 1] += first[v];
  std::vector<std::uint32_t> leaving(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t e = 0; e < edges_.size(); ++e)
    if (edges_[e].is_border()) leaving[next[edges_[e].from]++] = e;

  // Walk around each void, which lies on the right: a loop that encloses its void runs clockwise.
  std::vector<bool> walked(edges_.size(), false);
  for (const std::uint32_t start : leaving) {
    if (walked[start]) continue;
    std::vector<std::uint32_t> loop;
    Int128 doubled_area = 0;
    for (std::uint32_t e = start; !walked[e];) {
      walked[e] = true;
      loop.push_back(e);
      const Position& origin = tin_.vertices[edges_[start].from];
      doubled_area += cross_in_plan(vector_from(origin, tin_.vertices[edges_[e].from]),
                                    vector_from(origin, tin_.vertices[edges_[e].to]));
      const VertexIndex at = edges_[e].to;
      assert(first[at] < first[at + 1]);
      e = next_around_void(tin_, edges_, e,
                           std::span(leaving).subspan(first[at], first[at + 1] - first[at]));
    }
    if (doubled_area < 0) hole_edges_.insert(hole_edges_.end(), loop.begin(), loop.end());
  }
}

bool TinIndex::contains(TriangleIndex triangle, const Position& p) const {
  const auto& [a, b, c] = tin_.triangles[triangle];
  return orient2d(tin_.vertices[a], tin_.vertices[b], p) >= 0 &&
         orient2d(tin_.vertices[b], tin_.vertices[c], p) >= 0 &&
         orient2d(tin_.vertices[c], tin_.vertices[a], p) >= 0;
}

TriangleIndex TinIndex::triangle_at(double x_m, double y_m) const {
  TriangleIndex found = kNone;
  visit_triangles_at(x_m, y_m, [&](TriangleIndex t) { found = std::min(found, t); });
  return found;
}

std::optional<int> TinIndex::above_ground(const Position& p) const {
  const TriangleIndex t = triangle_at(p.x_m, p.y_m);
  if (t == kNone) return {};
  const auto& [a, b, c] = tin_.triangles[t];
  return orient3d(tin_.vertices[a], tin_.vertices[b], tin_.vertices[c], p);
}

std::optional<double> TinIndex::ground_height_m(double x_m, double y_m) const {
  const TriangleIndex t = triangle_at(x_m, y_m);
  if (t == kNone) return {};
  return height_in_plane_m(tin_, t, x_m, y_m);
}

bool TinIndex::is_in_hole(double x_m, double y_m) const {
  // Winding number of the loops that enclose voids, by their crossings with the ray to +x.
  const Position p{x_m, y_m, 0};
  int winding = 0;
  for (const std::uint32_t e : hole_edges_) {
    const Position& from = tin_.vertices[edges_[e].from];
    const Position& to = tin_.vertices[edges_[e].to];
    if (from.y_m <= y_m && to.y_m > y_m && orient2d(from, to, p) > 0) ++winding;
    if (to.y_m <= y_m && from.y_m > y_m && orient2d(from, to, p) < 0) --winding;
  }
  return winding != 0;
}

}  // namespace scarp
