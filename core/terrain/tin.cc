#include "core/terrain/tin.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

/// An edge of a triangle, least vertex first, with the corner that it lies opposite to.
struct EdgeUse {
  VertexIndex low, high;
  TriangleIndex triangle;
  int corner;
  bool forward;  // the triangle runs from low to high

  bool same_edge(const EdgeUse& other) const { return low == other.low && high == other.high; }
};

std::vector<EdgeUse> sorted_edge_uses(const Tin& tin) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * tin.triangles.size());
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const VertexIndex from = tin.triangles[t][static_cast<std::size_t>((corner + 1) % 3)];
      const VertexIndex to = tin.triangles[t][static_cast<std::size_t>((corner + 2) % 3)];
      uses.push_back({std::min(from, to), std::max(from, to), t, corner, from < to});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    return a.triangle < b.triangle;
  });
  return uses;
}

bool on_lattice(double value_m) {
  return std::abs(value_m) <= kLatticeReachM && round_to_lattice(value_m) == value_m;
}

std::optional<std::string> check_vertices(const Tin& tin) {
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    const Position& p = tin.vertices[v];
    if (!on_lattice(p.x_m) || !on_lattice(p.y_m) || !on_lattice(p.z_m))
      return "vertex " + std::to_string(v) + " is not on the lattice";
  }
  std::vector<VertexIndex> order(tin.vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&](VertexIndex v) {
    return std::pair(tin.vertices[v].x_m, tin.vertices[v].y_m);
  };
  std::sort(order.begin(), order.end(),
            [&](VertexIndex a, VertexIndex b) { return place(a) < place(b); });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (place(order[i - 1]) == place(order[i]))
      return "vertices " + std::to_string(std::min(order[i - 1], order[i])) + " and " +
             std::to_string(std::max(order[i - 1], order[i])) + " are at the same place";
  }
  return {};
}

std::optional<std::string> check_triangles(const Tin& tin) {
  std::vector<bool> used(tin.vertices.size(), false);
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    const auto& [a, b, c] = tin.triangles[t];
    const std::string name = "triangle " + std::to_string(t);
    for (const VertexIndex v : {a, b, c}) {
      if (v >= tin.vertices.size()) return name + " has a vertex that does not exist";
      used[v] = true;
    }
    if (orient2d(tin.vertices[a], tin.vertices[b], tin.vertices[c]) <= 0)
      return name + " is not counter-clockwise";
  }
  const auto unused = std::find(used.begin(), used.end(), false);
  if (unused != used.end())
    return "vertex " + std::to_string(unused - used.begin()) + " has no triangle";
  return {};
}

std::optional<std::string> check_edges(const Tin& tin) {
  if (tin.neighbours.size() != tin.triangles.size()) return "neighbours are missing";
  const std::vector<EdgeUse> uses = sorted_edge_uses(tin);
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].same_edge(uses[i])) ++end;
    const std::string name =
        "edge " + std::to_string(uses[i].low) + "-" + std::to_string(uses[i].high);
    if (end - i > 2) return name + " has more than two triangles";
    if (end - i == 2 && uses[i].forward == uses[i + 1].forward)
      return name + " is used twice in one direction";
    for (std::size_t k = i; k < end; ++k) {
      const TriangleIndex across = end - i == 2 ? uses[k == i ? i + 1 : i].triangle : kNone;
      if (tin.neighbours[uses[k].triangle][static_cast<std::size_t>(uses[k].corner)] != across)
        return name + " names a wrong neighbour";
    }
    i = end;
  }
  return {};
}

}  // namespace

void connect_neighbours(Tin& tin) {
  tin.neighbours.assign(tin.triangles.size(), {kNone, kNone, kNone});
  const std::vector<EdgeUse> uses = sorted_edge_uses(tin);
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) {
    if (!uses[i].same_edge(uses[i + 1])) continue;
    assert(i + 2 >= uses.size() || !uses[i].same_edge(uses[i + 2]));
    const auto link = [&](const EdgeUse& from, const EdgeUse& to) {
      tin.neighbours[from.triangle][static_cast<std::size_t>(from.corner)] = to.triangle;
    };
    link(uses[i], uses[i + 1]);
    link(uses[i + 1], uses[i]);
  }
}

std::optional<std::string> check_tin(const Tin& tin) {
  if (auto broken = check_triangles(tin)) return broken;
  if (auto broken = check_vertices(tin)) return broken;
  return check_edges(tin);
}

bool bends_downwards(const Tin& tin, TriangleIndex triangle, std::size_t corner) {
  const auto& corners = tin.triangles[triangle];
  const auto& beyond = tin.triangles[tin.neighbours[triangle][corner]];
  const auto apex = std::find_if(beyond.begin(), beyond.end(), [&](VertexIndex v) {
    return v != corners[(corner + 1) % 3] && v != corners[(corner + 2) % 3];
  });
  assert(apex != beyond.end());
  return orient3d(tin.vertices[corners[0]], tin.vertices[corners[1]], tin.vertices[corners[2]],
                  tin.vertices[*apex]) < 0;
}

Bounds bounds_of(std::span<const Position> positions) {
  assert(!positions.empty());
  Bounds bounds{positions[0], positions[0]};
  for (const Position& p : positions) {
    bounds.low = {std::min(bounds.low.x_m, p.x_m), std::min(bounds.low.y_m, p.y_m),
                  std::min(bounds.low.z_m, p.z_m)};
    bounds.high = {std::max(bounds.high.x_m, p.x_m), std::max(bounds.high.y_m, p.y_m),
                   std::max(bounds.high.z_m, p.z_m)};
  }
  return bounds;
}

}  // namespace scarp
