#include "core/terrain/weld.h"

#include <algorithm>
#include <cassert>

namespace scarp {
namespace {

struct BorderVertex {
  double x_m, y_m;
  std::size_t vertex;  // among those of all parts
};

struct BorderEdge {
  VertexIndex low, high;
  TriangleIndex triangle;
  std::size_t corner;
};

/// Calls visit(triangle, corner) for each border edge.
template <class Visit>
void visit_borders(const Tin& tin, Visit visit) {
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      if (tin.neighbours[t][i] == kNone) visit(t, i);
}

/// For each vertex of all parts the first one over the same place, itself where it is that.
std::vector<std::size_t> first_of_same_place(std::span<const Tin* const> parts,
                                             std::size_t vertices) {
  std::vector<BorderVertex> border;
  std::size_t offset = 0;
  for (const Tin* part : parts) {
    std::vector<bool> listed(part->vertices.size(), false);
    visit_borders(*part, [&](TriangleIndex t, std::size_t i) {
      for (const std::size_t k : {(i + 1) % 3, (i + 2) % 3}) {
        const VertexIndex v = part->triangles[t][k];
        if (listed[v]) continue;
        listed[v] = true;
        border.push_back({part->vertices[v].x_m, part->vertices[v].y_m, offset + v});
      }
    });
    offset += part->vertices.size();
  }
  std::sort(border.begin(), border.end(), [](const BorderVertex& a, const BorderVertex& b) {
    if (a.x_m != b.x_m) return a.x_m < b.x_m;
    return a.y_m != b.y_m ? a.y_m < b.y_m : a.vertex < b.vertex;
  });
  std::vector<std::size_t> first(vertices);
  for (std::size_t v = 0; v < vertices; ++v) first[v] = v;
  for (std::size_t i = 1; i < border.size(); ++i)
    if (border[i].x_m == border[i - 1].x_m && border[i].y_m == border[i - 1].y_m)
      first[border[i].vertex] = first[border[i - 1].vertex];
  return first;
}

/// Links border edges that two triangles have.
void link_borders(Tin& tin) {
  std::vector<BorderEdge> edges;
  visit_borders(tin, [&](TriangleIndex t, std::size_t i) {
    const VertexIndex a = tin.triangles[t][(i + 1) % 3], b = tin.triangles[t][(i + 2) % 3];
    edges.push_back({std::min(a, b), std::max(a, b), t, i});
  });
  std::sort(edges.begin(), edges.end(), [](const BorderEdge& a, const BorderEdge& b) {
    if (a.low != b.low) return a.low < b.low;
    return a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
  });
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const BorderEdge &p = edges[i], &q = edges[i + 1];
    if (p.low != q.low || p.high != q.high) continue;
    tin.neighbours[p.triangle][p.corner] = q.triangle;
    tin.neighbours[q.triangle][q.corner] = p.triangle;
  }
}

}  // namespace

Welded weld(std::span<const Tin* const> parts) {
  std::size_t vertices = 0, triangles = 0;
  for (const Tin* part : parts) {
    assert(part->neighbours.size() == part->triangles.size());
    vertices += part->vertices.size();
    triangles += part->triangles.size();
  }
  const std::vector<std::size_t> first = first_of_same_place(parts, vertices);
  Welded welded;
  welded.vertex_of.resize(vertices);
  welded.tin.vertices.reserve(vertices);
  welded.tin.triangles.reserve(triangles);
  welded.tin.neighbours.reserve(triangles);
  std::size_t offset = 0;
  for (const Tin* part : parts) {
    for (std::size_t v = 0; v < part->vertices.size(); ++v) {
      VertexIndex& to = welded.vertex_of[offset + v];
      if (first[offset + v] == offset + v) {
        to = static_cast<VertexIndex>(welded.tin.vertices.size());
        welded.tin.vertices.push_back(part->vertices[v]);
      } else {
        to = welded.vertex_of[first[offset + v]];
        double& z_m = welded.tin.vertices[to].z_m;
        z_m = std::min(z_m, part->vertices[v].z_m);
      }
    }
    const auto first_triangle = static_cast<TriangleIndex>(welded.tin.triangles.size());
    for (std::size_t t = 0; t < part->triangles.size(); ++t) {
      auto corners = part->triangles[t];
      auto across = part->neighbours[t];
      for (VertexIndex& v : corners) v = welded.vertex_of[offset + v];
      for (TriangleIndex& other : across)
        if (other != kNone) other += first_triangle;
      welded.tin.triangles.push_back(corners);
      welded.tin.neighbours.push_back(across);
    }
    offset += part->vertices.size();
  }
  link_borders(welded.tin);
  return welded;
}

}  // namespace scarp
