#include "core/culling/group_batches.h"

#include <algorithm>
#include <cmath>

namespace scarp {
namespace {

std::array<Position, 8> corners_of(const Bounds& box) {
  std::array<Position, 8> corners;
  for (std::size_t i = 0; i < 8; ++i)
    corners[i] = {(i & 1) != 0 ? box.high.x_m : box.low.x_m,
                  (i & 2) != 0 ? box.high.y_m : box.low.y_m,
                  (i & 4) != 0 ? box.high.z_m : box.low.z_m};
  return corners;
}

}  // namespace

GroupBatches::GroupBatches(const Tin& tin, const Groups& groups) {
  const std::uint32_t batches = groups.leaf_count + 1;
  const auto batch_of = [&](TriangleIndex t) {
    return groups.group_of_triangle[t] == kNone ? groups.leaf_count : groups.group_of_triangle[t];
  };
  const auto triangles = static_cast<TriangleIndex>(tin.triangles.size());
  first_triangle_.assign(batches + 1, 0);
  for (TriangleIndex t = 0; t < triangles; ++t) ++first_triangle_[batch_of(t) + 1];
  for (std::uint32_t b = 0; b < batches; ++b) first_triangle_[b + 1] += first_triangle_[b];
  triangles_.resize(triangles);
  std::vector<std::uint32_t> next(first_triangle_.begin(), first_triangle_.end() - 1);
  for (TriangleIndex t = 0; t < triangles; ++t) triangles_[next[batch_of(t)]++] = t;

  first_vertex_.assign(1, 0);
  corners_.reserve(triangles);
  std::vector<VertexIndex> local(tin.vertices.size(), kNone);
  std::vector<VertexIndex> used;
  for (std::uint32_t b = 0; b < batches; ++b) {
    used.clear();
    for (const TriangleIndex t : this->triangles(b)) {
      std::array<VertexIndex, 3> corners;
      for (std::size_t i = 0; i < 3; ++i) {
        const VertexIndex v = tin.triangles[t][i];
        if (local[v] == kNone) {
          local[v] = static_cast<VertexIndex>(used.size());
          used.push_back(v);
        }
        corners[i] = local[v];
      }
      corners_.push_back(corners);
    }
    for (const VertexIndex v : used) {
      vertices_.push_back(tin.vertices[v]);
      local[v] = kNone;
    }
    first_vertex_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    if (b == groups.leaf_count) break;
    const Bounds bounds = bounds_of(std::span(vertices_).subspan(first_vertex_[b]));
    boxes_.push_back({bounds.low, bounds.high});
  }
}

void GroupBatches::add_to(GroupIndex group, Drawing& drawing) const {
  const auto base = static_cast<VertexIndex>(drawing.vertices.size());
  drawing.vertices.insert(drawing.vertices.end(), vertices_.begin() + first_vertex_[group],
                          vertices_.begin() + first_vertex_[group + 1]);
  for (std::uint32_t i = first_triangle_[group]; i < first_triangle_[group + 1]; ++i) {
    const auto& [a, b, c] = corners_[i];
    drawing.triangles.push_back({base + a, base + b, base + c});
    drawing.objects.push_back(triangles_[i]);
  }
}

Frustum::Frustum(const Projection& projection) : projection_(projection) {
  // Left, right, below, above, too near, behind.
  constexpr int kAxis[] = {0, 0, 1, 1, 2, 3}, kSign[] = {1, -1, 1, -1, -1, 0};
  const auto row = [&](int axis, int i) {
    return projection.rows[static_cast<std::size_t>(4 * axis + i)];
  };
  for (std::size_t p = 0; p < planes_.size(); ++p) {
    const auto at = [&](int i) { return row(3, i) + kSign[p] * row(kAxis[p], i); };
    planes_[p] = {at(0), at(1), at(2), at(3)};
  }
}

bool Frustum::may_show(const Bounds& box) const {
  // A box is beside the picture when even the corner that is farthest inwards is beyond a plane.
  for (const Plane& p : planes_) {
    const double x = p.a * (p.a > 0 ? box.high.x_m : box.low.x_m);
    const double y = p.b * (p.b > 0 ? box.high.y_m : box.low.y_m);
    const double z = p.c * (p.c > 0 ? box.high.z_m : box.low.z_m);
    // Rounding is of the largest term; a box is not left out for it.
    constexpr double kRounding = 0x1p-49;
    const double margin = (std::abs(x) + std::abs(y) + std::abs(z) + std::abs(p.d)) * kRounding;
    if (x + y + z + p.d < -margin) return false;
  }
  return true;
}

bool place_on_screen(const Projection& projection, const Bounds& box, int width_px, int height_px,
                     ScreenBox& on_screen) {
  on_screen = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL, 0};
  for (const Position& corner : corners_of(box)) {
    const ClipPosition p = projection.project(corner);
    if (!(p.w > 0) || p.z > p.w) return false;
    const double x_px = (p.x / p.w + 1) * width_px / 2, y_px = (1 - p.y / p.w) * height_px / 2;
    on_screen.left = std::min(on_screen.left, x_px);
    on_screen.right = std::max(on_screen.right, x_px);
    on_screen.top = std::min(on_screen.top, y_px);
    on_screen.bottom = std::max(on_screen.bottom, y_px);
    on_screen.nearest = std::max(on_screen.nearest, p.z / p.w);
  }
  return true;
}

}  // namespace scarp
