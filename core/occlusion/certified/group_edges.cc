#include "core/occlusion/certified/group_edges.h"

#include <numeric>

namespace scarp {
namespace {

/// Calls visit(group, edge, is_border) for each border of a group, directed with the group on the
/// left, and once for each edge within one that bends downwards.
template <class Visit>
void visit_edges(const Tin& tin, std::span<const GroupIndex> group_of_triangle, Visit visit) {
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex group = group_of_triangle[t];
    if (group == kNone) continue;
    const auto& corners = tin.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexIndex from = corners[(i + 1) % 3], to = corners[(i + 2) % 3];
      const TriangleIndex other = tin.neighbours[t][i];
      if (other == kNone || group_of_triangle[other] != group) {
        visit(group, GroupEdges::Edge{from, to}, true);
      } else if (t < other && bends_downwards(tin, t, i)) {
        visit(group, GroupEdges::Edge{from, to}, false);
      }
    }
  }
}

}  // namespace

GroupEdges edges_of_groups(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                           std::uint32_t groups) {
  GroupEdges edges;
  edges.first_border.assign(groups + 1, 0);
  edges.first_crest.assign(groups + 1, 0);
  visit_edges(tin, group_of_triangle, [&](GroupIndex group, const auto&, bool is_border) {
    edges.first_border[group + 1] += is_border;
    ++edges.first_crest[group + 1];
  });
  std::partial_sum(edges.first_border.begin(), edges.first_border.end(),
                   edges.first_border.begin());
  std::partial_sum(edges.first_crest.begin(), edges.first_crest.end(), edges.first_crest.begin());
  edges.borders.resize(edges.first_border.back());
  edges.crests.resize(edges.first_crest.back());
  std::vector<std::size_t> next_border = edges.first_border, next_crest = edges.first_crest;
  visit_edges(tin, group_of_triangle, [&](GroupIndex group, const auto& edge, bool is_border) {
    if (is_border) edges.borders[next_border[group]++] = edge;
    edges.crests[next_crest[group]++] = edge;
  });
  return edges;
}

}  // namespace scarp
