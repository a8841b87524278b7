#include "core/occlusion/group_tree.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "core/occlusion/circle.h"
#include "core/occlusion/region.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// The vertices of each leaf's triangles, rising, each once.
std::vector<std::vector<VertexIndex>> vertices_of_leaves(const Tin& tin, const LeafGroups& leaves) {
  std::vector<std::vector<VertexIndex>> vertices(leaves.count);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex group = leaves.group_of_triangle[t];
    if (group == kNone) continue;
    assert(group < leaves.count);
    vertices[group].insert(vertices[group].end(), tin.triangles[t].begin(), tin.triangles[t].end());
  }
  parallel_for(vertices.size(), [&](std::size_t g) {
    std::sort(vertices[g].begin(), vertices[g].end());
    vertices[g].erase(std::unique(vertices[g].begin(), vertices[g].end()), vertices[g].end());
  });
  return vertices;
}

double plan_area_m2(const Tin& tin) {
  double twice_m2 = 0;
  for (const auto& [a, b, c] : tin.triangles) {
    const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
    twice_m2 += (q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m);
  }
  return twice_m2 / 2;
}

/// The tree while it grows: nodes, their hulls, and who may still be merged with whom.
class Tree {
 public:
  Tree(const Tin& tin, const LeafGroups& leaves,
       const std::vector<std::vector<VertexIndex>>& vertices)
      : largest_circle_m2_(kTopLevelAreaShare * plan_area_m2(tin)),
        nodes_(leaves.count),
        hulls_(leaves.count),
        collisions_(leaves.collisions) {
    for (const GroupIndex group : leaves.group_of_triangle)
      if (group != kNone) ++nodes_[group].triangles;
    parallel_for(leaves.count, [&](std::size_t g) {
      std::vector<Position> positions;
      for (const VertexIndex v : vertices[g]) positions.push_back(tin.vertices[v]);
      enclose(g, std::move(positions));
    });
    for (GroupIndex g = 0; g < leaves.count; ++g) retire_if_large(g);
  }

  /// Merges one level. False: nothing could be merged.
  bool merge_level() {
    const std::vector<std::pair<GroupIndex, GroupIndex>> pairs = choose_pairs();
    const std::size_t first = nodes_.size();
    nodes_.resize(first + pairs.size());
    hulls_.resize(nodes_.size());
    collisions_.resize(nodes_.size());
    parallel_for(pairs.size(), [&](std::size_t i) {
      const auto [a, b] = pairs[i];
      std::vector<Position> corners = hulls_[a];
      corners.insert(corners.end(), hulls_[b].begin(), hulls_[b].end());
      enclose(first + i, std::move(corners));
      nodes_[first + i].children = {a, b};
      nodes_[first + i].triangles = nodes_[a].triangles + nodes_[b].triangles;
      nodes_[a].parent = nodes_[b].parent = static_cast<GroupIndex>(first + i);
      hulls_[a] = hulls_[b] = {};
    });
    for (std::size_t i = 0; i < pairs.size(); ++i)
      fuse_collisions(collisions_, pairs[i].first, pairs[i].second,
                      static_cast<GroupIndex>(first + i));
    for (std::size_t i = first; i < nodes_.size(); ++i) retire_if_large(static_cast<GroupIndex>(i));
    return !pairs.empty();
  }

  std::vector<GroupNode> take_nodes() && { return std::move(nodes_); }

 private:
  void enclose(std::size_t node, std::vector<Position> positions) {
    hulls_[node] = convex_hull(std::move(positions));
    const Circle circle = enclosing_circle(hulls_[node]);
    nodes_[node].centre_x_m = circle.x_m;
    nodes_[node].centre_y_m = circle.y_m;
    nodes_[node].radius_m = circle.radius_m;
  }

  /// Top-level nodes have no collisions left, so that nobody chooses them.
  void retire_if_large(GroupIndex node) {
    const double radius_m = nodes_[node].radius_m;
    if (std::numbers::pi * radius_m * radius_m > largest_circle_m2_)
      drop_collisions(collisions_, node);
  }

  /// Each node and the one that it met most often, most collisions first, none twice.
  std::vector<std::pair<GroupIndex, GroupIndex>> choose_pairs() const {
    std::vector<std::tuple<std::uint64_t, GroupIndex, GroupIndex>> wishes;
    for (GroupIndex g = 0; g < nodes_.size(); ++g) {
      const auto& met = collisions_[g];
      const auto best = std::max_element(
          met.begin(), met.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
      if (best != met.end()) wishes.emplace_back(best->second, g, best->first);
    }
    std::stable_sort(wishes.begin(), wishes.end(),
                     [](const auto& a, const auto& b) { return std::get<0>(a) > std::get<0>(b); });
    std::vector<bool> merged(nodes_.size(), false);
    std::vector<std::pair<GroupIndex, GroupIndex>> pairs;
    for (const auto& [times, a, b] : wishes) {
      if (merged[a] || merged[b]) continue;
      merged[a] = merged[b] = true;
      pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
    return pairs;
  }

  double largest_circle_m2_;
  std::vector<GroupNode> nodes_;
  std::vector<std::vector<Position>> hulls_;
  Collisions collisions_;
};

/// Intersection of the regions of some vertices in one sector.
Region common_region(const Tin& tin, const HorizonTable& horizon, std::int32_t sector,
                     const std::vector<VertexIndex>& vertices) {
  const SectorAxis axis = sector_axis(horizon.layout, sector);
  for (const VertexIndex v : vertices)
    if (horizon.at(v, sector) == kNone) return {};
  Region region, merged;
  for (const VertexIndex v : vertices) {
    const RayRegion ray =
        region_of_vertex(tin.vertices[v], tin.vertices[horizon.at(v, sector)], axis);
    if (region.points.empty()) {
      region = {{ray.start}, ray.slope};
      continue;
    }
    merge_regions(region.view(), ray.view(), merged);
    std::swap(region, merged);
  }
  return region;
}

/// Regions of all nodes, children before parents. One slot per node and sector.
std::vector<Region> regions_of(const Tin& tin, const HorizonTable& horizon,
                               const std::vector<GroupNode>& nodes,
                               const std::vector<std::vector<VertexIndex>>& leaf_vertices,
                               const Progress& progress) {
  const auto sectors = static_cast<std::size_t>(horizon.layout.count);
  std::vector<Region> regions(nodes.size() * sectors);
  for (std::size_t sector = 0; sector < sectors; ++sector) {
    parallel_for(leaf_vertices.size(), [&](std::size_t g) {
      regions[g * sectors + sector] =
          common_region(tin, horizon, static_cast<std::int32_t>(sector), leaf_vertices[g]);
    });
    if (progress) progress(static_cast<double>(sector + 1) / static_cast<double>(sectors));
  }
  parallel_for(sectors, [&](std::size_t sector) {
    for (std::size_t i = leaf_vertices.size(); i < nodes.size(); ++i) {
      const auto [a, b] = nodes[i].children;
      merge_regions(regions[a * sectors + sector].view(), regions[b * sectors + sector].view(),
                    regions[i * sectors + sector]);
    }
  });
  return regions;
}

Regions flatten(const SectorLayout& layout, const std::vector<Region>& rows) {
  Regions flat;
  flat.layout = layout;
  flat.first.reserve(rows.size() + 1);
  flat.end_slope.reserve(rows.size());
  flat.first.push_back(0);
  for (const Region& region : rows) {
    flat.points.insert(flat.points.end(), region.points.begin(), region.points.end());
    flat.first.push_back(static_cast<std::uint32_t>(flat.points.size()));
    flat.end_slope.push_back(region.end_slope);
  }
  return flat;
}

bool circle_holds(const GroupNode& node, const Position& p) {
  const double dx_m = p.x_m - node.centre_x_m, dy_m = p.y_m - node.centre_y_m;
  return std::sqrt(dx_m * dx_m + dy_m * dy_m) <= node.radius_m;
}

std::string named(GroupIndex node) {
  return "node " + std::to_string(node);
}

std::optional<std::string> check_nodes(const Groups& groups) {
  for (GroupIndex i = 0; i < groups.nodes.size(); ++i) {
    const GroupNode& node = groups.nodes[i];
    const auto [a, b] = node.children;
    if (node.parent != kNone) {
      if (node.parent >= groups.nodes.size()) return named(i) + " has a parent that does not exist";
      const auto& siblings = groups.nodes[node.parent].children;
      if (siblings[0] != i && siblings[1] != i) return named(i) + " is not a child of its parent";
    }
    if (i < groups.leaf_count) {
      if (a != kNone || b != kNone) return named(i) + " is a leaf with children";
      continue;
    }
    if (a >= i || b >= i || a == b) return named(i) + " has wrong children";
    for (const GroupIndex child : node.children)
      if (groups.nodes[child].parent != i) return named(child) + " does not name its parent";
    if (node.triangles != groups.nodes[a].triangles + groups.nodes[b].triangles)
      return named(i) + " has not the triangles of its children";
  }
  return {};
}

std::optional<std::string> check_triangles(const Tin& tin, const Groups& groups) {
  std::vector<std::uint32_t> counts(groups.leaf_count, 0);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex leaf = groups.group_of_triangle[t];
    if (leaf == kNone) continue;
    if (leaf >= groups.leaf_count)
      return "triangle " + std::to_string(t) + " is in a group that does not exist";
    ++counts[leaf];
    for (GroupIndex node = leaf; node != kNone; node = groups.nodes[node].parent)
      for (const VertexIndex v : tin.triangles[t])
        if (!circle_holds(groups.nodes[node], tin.vertices[v]))
          return "the circle of " + named(node) + " does not hold vertex " + std::to_string(v);
  }
  for (GroupIndex g = 0; g < groups.leaf_count; ++g)
    if (counts[g] != groups.nodes[g].triangles || counts[g] == 0)
      return named(g) + " has a wrong number of triangles";
  return {};
}

/// Enough at the inner region's points: between them it is straight, and the outer one concave.
bool lies_within(const RegionView& inner, const RegionView& outer) {
  if (inner.count == 0) return true;
  if (outer.count == 0 || inner.points[0].u_m < outer.points[0].u_m ||
      inner.end_slope > outer.end_slope)
    return false;
  return std::all_of(inner.points, inner.points + inner.count,
                     [&](const RegionPoint& p) { return p.z_m <= region_height_m(outer, p.u_m); });
}

}  // namespace

Groups build_group_tree(const Tin& tin, const HorizonTable& horizon, LeafGroups leaves,
                        const Progress& progress) {
  const std::vector<std::vector<VertexIndex>> leaf_vertices = vertices_of_leaves(tin, leaves);
  Tree tree(tin, leaves, leaf_vertices);
  while (tree.merge_level()) {
  }
  Groups groups;
  groups.leaf_count = leaves.count;
  groups.group_of_triangle = std::move(leaves.group_of_triangle);
  groups.nodes = std::move(tree).take_nodes();
  groups.regions =
      flatten(horizon.layout, regions_of(tin, horizon, groups.nodes, leaf_vertices, progress));
  return groups;
}

std::optional<std::string> check_groups(const Tin& tin, const Groups& groups) {
  if (groups.group_of_triangle.size() != tin.triangles.size())
    return "group_of_triangle does not fit the surface";
  if (groups.leaf_count > groups.nodes.size()) return "leaves are missing";
  if (auto broken = check_nodes(groups)) return broken;
  if (auto broken = check_triangles(tin, groups)) return broken;
  if (auto broken = check_regions(groups.regions, groups.nodes.size())) return broken;
  for (GroupIndex i = groups.leaf_count; i < groups.nodes.size(); ++i)
    for (const GroupIndex child : groups.nodes[i].children)
      for (std::int32_t sector = 0; sector < groups.regions.layout.count; ++sector)
        if (!lies_within(groups.regions.at(i, sector), groups.regions.at(child, sector)))
          return "the region of " + named(i) + " in sector " + std::to_string(sector) +
                 " reaches out of node " + std::to_string(child) + "'s";
  return {};
}

}  // namespace scarp
