#include "core/culling/selective_refinement.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/culling/drawn_outline.h"
#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

/// Bins a side: fine enough to tell triangles from their neighbours, few enough to be counted in a
/// millisecond.
constexpr double kMostBinsASide = 512;

/// Bins are taken a little larger than they are: far more than rounding.
constexpr double kBeyondBin = 1 + 0x1p-20;

/// Bins that are looked at one by one; where more are seen, the triangle is.
constexpr std::uint32_t kMostBinsLookedAt = 64;

/// What a picture shows of triangles that may be off by some metres up or down.
class ScreenError {
 public:
  ScreenError(const Shot& shot)
      : projection_(look_at(shot.view, shot.width_px, shot.height_px)),
        up_{projection_.rows[2], projection_.rows[6], projection_.rows[10], projection_.rows[14]} {
    const double half_tan = std::tan(shot.view.vertical_field_of_view_rad / 2);
    const double half_height_px = shot.height_px / 2.0, half_width_px = shot.width_px / 2.0;
    // A pixel in a corner of the picture is this much longer than one in the middle.
    const double corner = std::hypot(half_width_px, half_height_px) / half_height_px * half_tan;
    focal_px_ = half_height_px / half_tan * std::sqrt(1 + corner * corner);
  }

  const Projection& projection() const { return projection_; }

  bool may_show(std::span<const ClipPosition> places, const std::array<VertexIndex, 3>& triangle,
                double error_m) const {
    std::uint32_t outside = 0x3f;
    for (const VertexIndex v : triangle) {
      for (const double by_m : {-error_m, error_m}) {
        const double x = places[v].x + by_m * up_[0], y = places[v].y + by_m * up_[1];
        const double z = places[v].z + by_m * up_[2], w = places[v].w + by_m * up_[3];
        outside &= (x < -w ? 1U : 0U) | (x > w ? 2U : 0U) | (y < -w ? 4U : 0U) | (y > w ? 8U : 0U) |
                   (z > w ? 16U : 0U) | (w < 0 ? 32U : 0U);
        if (error_m == 0) break;
      }
    }
    return outside == 0;
  }

  /// Most pixels that a place of the triangle is off.
  double pixels(std::span<const ClipPosition> places, const std::array<VertexIndex, 3>& triangle,
                double error_m) const {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const VertexIndex v : triangle) nearest_m = std::min(nearest_m, places[v].w);
    nearest_m -= error_m * std::abs(up_[3]);
    if (error_m == 0) return 0;
    return nearest_m > 0 ? focal_px_ * error_m / nearest_m
                         : std::numeric_limits<double>::infinity();
  }

 private:
  Projection projection_;
  std::array<double, 4> up_;  // what a metre upwards adds
  double focal_px_;
};

}  // namespace

SelectiveRefinement::SelectiveRefinement(const Tin& tin, const Groups& groups)
    : tin_(tin), groups_(groups), history_(collapse_edges(tin, {})) {
  error_m_.assign(history_.triangles.size(), 0);
  made_by_.assign(history_.triangles.size(), kNone);
  for (std::uint32_t c = 0; c < history_.collapses.size(); ++c) {
    const Collapse& collapse = history_.collapses[c];
    for (TriangleIndex t = collapse.first_triangle; t < history_.end_of(c); ++t) {
      error_m_[t] = std::nextafter(static_cast<float>(std::max(collapse.above_m, collapse.below_m)),
                                   std::numeric_limits<float>::infinity());
      made_by_[t] = c;
    }
  }
  lay_out_bins();
}

SelectiveRefinement::BinRange SelectiveRefinement::bins_of(
    const std::array<VertexIndex, 3>& triangle) const {
  const auto range = [&](double Position::*c, double origin_m, std::uint32_t count) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const VertexIndex v : triangle) {
      low = std::min(low, tin_.vertices[v].*c);
      high = std::max(high, tin_.vertices[v].*c);
    }
    const auto bin = [&](double at_m) {
      return std::min(count - 1, static_cast<std::uint32_t>((at_m - origin_m) / bin_m_));
    };
    return std::array{bin(low), bin(high)};
  };
  const auto columns = range(&Position::x_m, low_x_m_, columns_);
  const auto rows = range(&Position::y_m, low_y_m_, rows_);
  return {columns[0], columns[1], rows[0], rows[1]};
}

/// Whether a triangle may meet a bin: no edge has all of the bin on its outer side.
bool SelectiveRefinement::touches(const std::array<VertexIndex, 3>& triangle, std::uint32_t column,
                                  std::uint32_t row) const {
  const double half_m = bin_m_ / 2, x_m = low_x_m_ + (column + 0.5) * bin_m_,
               y_m = low_y_m_ + (row + 0.5) * bin_m_;
  for (std::size_t i = 0; i < 3; ++i) {
    const Position &a = tin_.vertices[triangle[i]], &b = tin_.vertices[triangle[(i + 1) % 3]];
    const double dx_m = b.x_m - a.x_m, dy_m = b.y_m - a.y_m;
    const double reach_m2 = (std::abs(dx_m) + std::abs(dy_m)) * half_m * kBeyondBin;
    if (dx_m * (y_m - a.y_m) - dy_m * (x_m - a.x_m) < -reach_m2) return false;
  }
  return true;
}

void SelectiveRefinement::lay_out_bins() {
  const Bounds bounds = bounds_of(tin_.vertices);
  low_x_m_ = bounds.low.x_m;
  low_y_m_ = bounds.low.y_m;
  const double width_m = bounds.high.x_m - low_x_m_, height_m = bounds.high.y_m - low_y_m_;
  bin_m_ = std::max(width_m, height_m) / kMostBinsASide;
  columns_ = static_cast<std::uint32_t>(width_m / bin_m_) + 1;
  rows_ = static_cast<std::uint32_t>(height_m / bin_m_) + 1;

  std::vector<std::vector<std::uint32_t>> bins(groups_.leaf_count + 1);
  for (TriangleIndex t = 0; t < history_.original_triangles; ++t) {
    const GroupIndex group = groups_.group_of_triangle[t];
    const BinRange range = bins_of(history_.triangles[t]);
    for (std::uint32_t row = range.first_row; row <= range.last_row; ++row)
      for (std::uint32_t column = range.first_column; column <= range.last_column; ++column)
        if (touches(history_.triangles[t], column, row))
          bins[group == kNone ? groups_.leaf_count : group].push_back(row * columns_ + column);
  }
  first_bin_.push_back(0);
  for (std::vector<std::uint32_t>& of_group : bins) {
    std::sort(of_group.begin(), of_group.end());
    of_group.erase(std::unique(of_group.begin(), of_group.end()), of_group.end());
    group_bins_.insert(group_bins_.end(), of_group.begin(), of_group.end());
    first_bin_.push_back(static_cast<std::uint32_t>(group_bins_.size()));
  }
}

SelectiveRefinement::SeenGround SelectiveRefinement::seen_ground(
    std::span<const GroupIndex> visible_groups) const {
  SeenGround seen;
  seen.groups.assign(groups_.leaf_count, 0);
  seen.stride = columns_ + 1;
  std::vector<std::uint32_t>& count = seen.bins_before;
  count.assign(seen.stride * (rows_ + 1), 0);
  const auto mark = [&](std::size_t group) {
    for (std::uint32_t i = first_bin_[group]; i < first_bin_[group + 1]; ++i) {
      const std::uint32_t row = group_bins_[i] / columns_, column = group_bins_[i] % columns_;
      count[(row + 1) * seen.stride + column + 1] = 1;
    }
  };
  for (const GroupIndex group : visible_groups) {
    seen.groups[group] = 1;
    mark(group);
  }
  mark(groups_.leaf_count);
  for (std::size_t row = 1; row <= rows_; ++row) {
    std::uint32_t in_row = 0;
    for (std::size_t column = 1; column < seen.stride; ++column) {
      in_row += count[row * seen.stride + column];
      count[row * seen.stride + column] = count[(row - 1) * seen.stride + column] + in_row;
    }
  }
  return seen;
}

bool SelectiveRefinement::is_over_seen(const SeenGround& seen, TriangleIndex t) const {
  if (seen.bins_before.empty()) return true;
  if (t < history_.original_triangles) {
    const GroupIndex group = groups_.group_of_triangle[t];
    return group == kNone || seen.groups[group];
  }
  const BinRange range = bins_of(history_.triangles[t]);
  const std::uint32_t seen_bins = seen.bins_in(range);
  if (seen_bins == 0 || seen_bins > kMostBinsLookedAt) return seen_bins > 0;
  for (std::uint32_t row = range.first_row; row <= range.last_row; ++row)
    for (std::uint32_t column = range.first_column; column <= range.last_column; ++column)
      if (seen.bins_in({column, column, row, row}) > 0 &&
          touches(history_.triangles[t], column, row))
        return true;
  return false;
}

SelectiveRefinement::Drawing SelectiveRefinement::draw(
    const Shot& shot, double most_px,
    std::optional<std::span<const GroupIndex>> visible_groups) const {
  const ScreenError screen(shot);
  const std::vector<ClipPosition> places = project_all(screen.projection(), tin_.vertices);
  const SeenGround seen = visible_groups ? seen_ground(*visible_groups) : SeenGround();
  const auto is_too_coarse = [&](TriangleIndex t) {
    const auto& triangle = history_.triangles[t];
    const double error_m = static_cast<double>(error_m_[t]);
    return screen.pixels(places, triangle, error_m) > most_px &&
           screen.may_show(places, triangle, error_m) && is_over_seen(seen, t);
  };

  // What a collapse rests on comes before it. Undoing one undoes all that rests on it, at once.
  Drawing drawing;
  std::vector<std::uint8_t> is_undone(history_.collapses.size(), 0);
  std::vector<std::uint32_t> open;
  const auto undo = [&](std::uint32_t collapse) {
    is_undone[collapse] = 1;
    open.push_back(collapse);
    ++drawing.undone;
  };
  for (std::uint32_t c = 0; c < history_.collapses.size(); ++c) {
    for (TriangleIndex t = history_.collapses[c].first_triangle;
         t < history_.end_of(c) && !is_undone[c]; ++t)
      if (is_too_coarse(t)) undo(c);
    while (!open.empty()) {
      const std::uint32_t undone = open.back();
      open.pop_back();
      for (TriangleIndex t = history_.collapses[undone].first_triangle; t < history_.end_of(undone);
           ++t) {
        const std::uint32_t above = history_.removed_by[t];
        if (above != kNone && !is_undone[above]) undo(above);
      }
    }
  }
  const auto is_there = [&](TriangleIndex t) {
    const bool is_made = made_by_[t] == kNone || !is_undone[made_by_[t]];
    return is_made && (history_.removed_by[t] == kNone || is_undone[history_.removed_by[t]]);
  };
  for (TriangleIndex t = 0; t < history_.triangles.size(); ++t) {
    if (!is_there(t)) continue;
    drawing.active.push_back(t);
    if (!screen.may_show(places, history_.triangles[t], 0) || !is_over_seen(seen, t)) continue;
    drawing.triangles.push_back(history_.triangles[t]);
    drawing.objects.push_back(t);
  }
  return drawing;
}

bool SelectiveRefinement::is_over(const Position& eye, const Drawing& drawing) const {
  for (const TriangleIndex t : drawing.active) {
    const auto& [i, j, k] = history_.triangles[t];
    const Position &a = tin_.vertices[i], &b = tin_.vertices[j], &c = tin_.vertices[k];
    if (std::min({a.x_m, b.x_m, c.x_m}) > eye.x_m || std::max({a.x_m, b.x_m, c.x_m}) < eye.x_m ||
        std::min({a.y_m, b.y_m, c.y_m}) > eye.y_m || std::max({a.y_m, b.y_m, c.y_m}) < eye.y_m)
      continue;
    if (orient2d(a, b, eye) >= 0 && orient2d(b, c, eye) >= 0 && orient2d(c, a, eye) >= 0)
      return orient3d(a, b, c, eye) > 0;
  }
  return false;
}

void SelectiveRefinement::leave_out_hidden(const Shot& shot, Drawing& drawing) const {
  if (!is_over(round_to_lattice(shot.view.eye), drawing)) return;
  const std::vector<std::uint8_t> is_kept = over_outline(shot, tin_.vertices, drawing.triangles);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < is_kept.size(); ++i) {
    if (!is_kept[i]) continue;
    drawing.triangles[kept] = drawing.triangles[i];
    drawing.objects[kept++] = drawing.objects[i];
  }
  drawing.triangles.resize(kept);
  drawing.objects.resize(kept);
}

std::uint64_t SelectiveRefinement::bytes() const {
  return history_.triangles.size() * (12 + 4 + sizeof(float) + 4) +
         history_.collapses.size() * sizeof(Collapse) +
         (first_bin_.size() + group_bins_.size()) * 4;
}

}  // namespace scarp
