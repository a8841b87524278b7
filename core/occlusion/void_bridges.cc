#include "core/occlusion/void_bridges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace scarp {
namespace {

using Bridges = std::vector<std::pair<TriangleIndex, TriangleIndex>>;

/// Which part each triangle belongs to, and how large the parts are.
struct Parts {
  std::vector<std::uint32_t> part_of_triangle;
  std::vector<std::uint32_t> triangles;
};

Parts find_parts(const Tin& tin) {
  Parts parts{std::vector<std::uint32_t>(tin.triangles.size(), kNone), {}};
  std::vector<TriangleIndex> open;
  for (TriangleIndex first = 0; first < tin.triangles.size(); ++first) {
    if (parts.part_of_triangle[first] != kNone) continue;
    const auto part = static_cast<std::uint32_t>(parts.triangles.size());
    parts.triangles.push_back(0);
    open.push_back(first);
    parts.part_of_triangle[first] = part;
    while (!open.empty()) {
      const TriangleIndex t = open.back();
      open.pop_back();
      ++parts.triangles[part];
      for (const TriangleIndex n : tin.neighbours[t]) {
        if (n == kNone || parts.part_of_triangle[n] != kNone) continue;
        parts.part_of_triangle[n] = part;
        open.push_back(n);
      }
    }
  }
  return parts;
}

/// The wave that shares the nodes out.
class Wave {
 public:
  Wave(const Tin& tin, const Parts& parts, std::uint32_t small)
      : parts_(parts), small_triangles_(small) {
    const Bounds bounds = bounds_of(tin.vertices);
    const double width_m = bounds.high.x_m - bounds.low.x_m;
    const double height_m = bounds.high.y_m - bounds.low.y_m;
    const double cell_m = std::sqrt(width_m * height_m / static_cast<double>(tin.triangles.size()));
    columns_ = static_cast<std::size_t>(width_m / cell_m) + 1;
    rows_ = static_cast<std::size_t>(height_m / cell_m) + 1;
    owner_.assign(columns_ * rows_, kNone);
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
      double x_m = 0, y_m = 0;
      for (const VertexIndex v : tin.triangles[t]) {
        x_m += (tin.vertices[v].x_m - bounds.low.x_m) / 3;
        y_m += (tin.vertices[v].y_m - bounds.low.y_m) / 3;
      }
      reach(std::min(rows_ - 1, static_cast<std::size_t>(y_m / cell_m)) * columns_ +
                std::min(columns_ - 1, static_cast<std::size_t>(x_m / cell_m)),
            t);
    }
  }

  Bridges run() && {
    for (std::size_t next = 0; next < open_.size(); ++next) {
      const std::size_t node = open_[next], column = node % columns_, row = node / columns_;
      const TriangleIndex owner = owner_[node];
      if (column > 0) reach(node - 1, owner);
      if (column + 1 < columns_) reach(node + 1, owner);
      if (row > 0) reach(node - columns_, owner);
      if (row + 1 < rows_) reach(node + columns_, owner);
    }
    return std::move(bridges_);
  }

 private:
  void reach(std::size_t node, TriangleIndex t) {
    const TriangleIndex owner = owner_[node];
    if (owner == kNone) {
      owner_[node] = t;
      open_.push_back(node);
      return;
    }
    const std::uint32_t a = parts_.part_of_triangle[owner], b = parts_.part_of_triangle[t];
    if (a == b || std::min(parts_.triangles[a], parts_.triangles[b]) >= small_triangles_) return;
    if (met_.insert(std::minmax(a, b)).second) bridges_.emplace_back(owner, t);
  }

  const Parts& parts_;
  std::uint32_t small_triangles_;
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<TriangleIndex> owner_;  // [nodes], kNone before the wave has come
  std::vector<std::size_t> open_;     // first in, first out
  std::set<std::pair<std::uint32_t, std::uint32_t>> met_;
  Bridges bridges_;
};

}  // namespace

Bridges bridge_voids(const Tin& tin, std::uint32_t small_triangles) {
  const Parts parts = find_parts(tin);
  if (parts.triangles.size() < 2) return {};
  return Wave(tin, parts, small_triangles).run();
}

}  // namespace scarp
