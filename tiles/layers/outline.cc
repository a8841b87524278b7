#include "tiles/layers/outline.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace scarp {
namespace {

/// The edge of a triangle opposite to a corner, with the triangle on its left.
struct HalfEdge {
  TriangleIndex triangle;
  std::size_t corner;  // 0 to 2

  friend bool operator==(const HalfEdge&, const HalfEdge&) = default;
};

class Tracer {
 public:
  Tracer(const Tin& tin, std::span<const GroupIndex> group_of_triangle)
      : tin_(tin),
        group_of_(group_of_triangle),
        is_in_part_(tin.triangles.size(), false),
        is_traced_(3 * tin.triangles.size(), false),
        place_on_path_(tin.vertices.size(), kNone) {}

  bool is_done(TriangleIndex triangle) const { return is_in_part_[triangle]; }

  /// The part that a triangle belongs to, as a polygon.
  VertexPolygon trace_part(TriangleIndex seed) {
    collect_part(seed);
    VertexPolygon polygon;
    for (const TriangleIndex triangle : part_) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        if (is_border({triangle, corner}) && !is_traced_[3 * triangle + corner])
          trace_walk({triangle, corner}, polygon);
      }
    }
    // A part hangs together by edges, so all its rings but one go round holes.
    const auto outer = std::ranges::find_if(
        polygon, [&](const VertexRing& ring) { return doubled_area(tin_, ring) > 0; });
    assert(outer != polygon.end());
    std::rotate(polygon.begin(), outer, outer + 1);
    return polygon;
  }

 private:
  VertexIndex start_of(HalfEdge edge) const {
    return tin_.triangles[edge.triangle][(edge.corner + 1) % 3];
  }
  VertexIndex end_of(HalfEdge edge) const {
    return tin_.triangles[edge.triangle][(edge.corner + 2) % 3];
  }

  bool is_border(HalfEdge edge) const {
    const TriangleIndex across = tin_.neighbours[edge.triangle][edge.corner];
    return across == kNone || group_of_[across] != group_of_[edge.triangle];
  }

  void collect_part(TriangleIndex seed) {
    part_.assign(1, seed);
    is_in_part_[seed] = true;
    for (std::size_t i = 0; i < part_.size(); ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        if (is_border({part_[i], corner})) continue;
        const TriangleIndex across = tin_.neighbours[part_[i]][corner];
        if (is_in_part_[across]) continue;
        is_in_part_[across] = true;
        part_.push_back(across);
      }
    }
    std::sort(part_.begin(), part_.end());  // the result does not depend on the walk above
  }

  /// The border edge that follows, reached through the part's own triangles around the end point:
  /// where the part touches itself in a point, the walk stays with the triangles it came with.
  HalfEdge next_border(HalfEdge edge) const {
    const VertexIndex pivot = end_of(edge);
    HalfEdge next = {edge.triangle, (edge.corner + 1) % 3};
    while (!is_border(next)) {
      const TriangleIndex across = tin_.neighbours[next.triangle][next.corner];
      const auto& corners = tin_.triangles[across];
      const auto at = static_cast<std::size_t>(std::find(corners.begin(), corners.end(), pivot) -
                                               corners.begin());
      next = {across, (at + 2) % 3};
    }
    return next;
  }

  /// Follows the border until it closes. Each time it comes back to a vertex that it has been at,
  /// the loop between is cut off as a ring of its own: so no ring touches itself.
  void trace_walk(HalfEdge first, VertexPolygon& polygon) {
    path_.clear();
    HalfEdge edge = first;
    do {
      is_traced_[3 * edge.triangle + edge.corner] = true;
      const VertexIndex vertex = start_of(edge);
      if (place_on_path_[vertex] != kNone) cut_ring(place_on_path_[vertex], polygon);
      place_on_path_[vertex] = static_cast<std::uint32_t>(path_.size());
      path_.push_back(vertex);
      edge = next_border(edge);
    } while (edge != first);
    cut_ring(0, polygon);
  }

  void cut_ring(std::uint32_t start, VertexPolygon& polygon) {
    VertexRing ring(path_.begin() + start, path_.end());
    for (const VertexIndex vertex : ring) place_on_path_[vertex] = kNone;
    path_.resize(start);
    polygon.push_back(std::move(ring));
  }

  const Tin& tin_;
  std::span<const GroupIndex> group_of_;
  std::vector<bool> is_in_part_;
  std::vector<bool> is_traced_;  // by half edge
  std::vector<std::uint32_t> place_on_path_;
  std::vector<VertexIndex> path_;
  std::vector<TriangleIndex> part_;
};

}  // namespace

WideArea doubled_area(const Tin& tin, const VertexRing& ring) {
  WideArea sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Position& a = tin.vertices[ring[i]];
    const Position& b = tin.vertices[ring[i + 1 < ring.size() ? i + 1 : 0]];
    sum += WideArea{lattice_steps(a.x_m)} * lattice_steps(b.y_m) -
           WideArea{lattice_steps(b.x_m)} * lattice_steps(a.y_m);
  }
  return sum;
}

std::vector<GroupOutline> trace_groups(const Tin& tin,
                                       std::span<const GroupIndex> group_of_triangle) {
  assert(group_of_triangle.size() == tin.triangles.size());
  std::vector<TriangleIndex> order(tin.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](TriangleIndex a, TriangleIndex b) {
    return group_of_triangle[a] < group_of_triangle[b];
  });
  Tracer tracer(tin, group_of_triangle);
  std::vector<GroupOutline> outlines;
  for (const TriangleIndex triangle : order) {
    const GroupIndex group = group_of_triangle[triangle];
    if (group == kNone || tracer.is_done(triangle)) continue;
    if (outlines.empty() || outlines.back().group != group) outlines.push_back({group, {}});
    outlines.back().polygons.push_back(tracer.trace_part(triangle));
  }
  return outlines;
}

}  // namespace scarp
