#include "tests/stability/compare_methods.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"

namespace scarp::test {
namespace {

/// Adds what a method culls from one eye.
void count(const GroupedScene& scene, const std::vector<TriangleSight>& sight,
           const std::vector<std::uint8_t>& group_seen, CullingMethod& method, const Position& eye,
           MethodCounts& counts) {
  const std::vector<std::uint8_t> culled =
      culled_triangles(scene.groups, method.visible({eye, {}}));
  for (std::size_t t = 0; t < sight.size(); ++t) {
    counts.falsely_culled += culled[t] && sight[t] == TriangleSight::kVisible;
    const GroupIndex group = scene.groups.group_of_triangle[t];
    counts.culled_of_hidden += culled[t] && group != kNone && !group_seen[group];
  }
}

/// The groups of all tiles one after the other, as if they were one scene's.
void group_tiles(const StabilityScene& scene, const HidingOptions& options, GroupedScene& grouped) {
  const TiledScene tiles = tiled(scene, options);
  LeafGroups leaves;
  leaves.group_of_triangle.assign(grouped.tin.triangles.size(), kNone);
  CertifiedRegions regions;
  for (const TileOfScene& tile : tiles.tiles) {
    for (const auto& members : tile.members) {
      for (const TriangleIndex t : members) leaves.group_of_triangle[t] = leaves.count;
      ++leaves.count;
    }
    assert(regions.groups.empty() || regions.layout == tile.regions.layout);
    regions.layout = tile.regions.layout;
    regions.groups.insert(regions.groups.end(), tile.regions.groups.begin(),
                          tile.regions.groups.end());
    regions.steps.insert(regions.steps.end(), tile.regions.steps.begin(), tile.regions.steps.end());
  }
  leaves.collisions.resize(leaves.count);
  for (std::size_t t = 0; t < leaves.group_of_triangle.size(); ++t)
    for (const TriangleIndex n : grouped.tin.neighbours[t]) {
      if (n == kNone || n < t) continue;
      const GroupIndex own = leaves.group_of_triangle[t], other = leaves.group_of_triangle[n];
      if (own != kNone && other != kNone && own != other)
        count_collision(leaves.collisions, own, other);
    }
  grouped.groups =
      build_group_tree(grouped.tin, stewart_horizons(grouped.tin.vertices, {}, {}), leaves);
  grouped.groups.certified = std::move(regions);
}

}  // namespace

GroupedScene group_scene(const StabilityScene& scene, const HidingOptions& options) {
  GroupedScene grouped{scene.tin, {}};
  if (scene.tin.triangles.empty()) return grouped;
  if (scene.tile_samples > 0) {
    group_tiles(scene, options, grouped);
    return grouped;
  }
  const LeafGroups leaves = group_by_squares(grouped.tin, scene.group_triangles);
  grouped.groups =
      build_group_tree(grouped.tin, stewart_horizons(grouped.tin.vertices, {}, {}), leaves);
  grouped.groups.certified =
      certify_groups(grouped.tin, leaves.group_of_triangle, leaves.count, options);
  return grouped;
}

std::vector<Position> eyes_of(const StabilityScene& scene, int scattered) {
  std::vector<Position> eyes;
  for (const NamedEye& eye : scene.eyes) eyes.push_back(eye.position);
  if (scene.tin.triangles.empty()) return eyes;
  const Bounds bounds = bounds_of(scene.tin.vertices);
  const TinIndex index(scene.tin);
  SplitMix64 random(1);
  const auto between = [&](double low, double high) {
    return low + (1.3 * random.unit() - 0.15) * (high - low);
  };
  const double relief_m = bounds.high.z_m - bounds.low.z_m + 1;
  for (int i = 0; i < scattered; ++i) {
    Position eye = round_to_lattice(Position{between(bounds.low.x_m, bounds.high.x_m),
                                             between(bounds.low.y_m, bounds.high.y_m), 0});
    const double heights_m[] = {0, 0.03 * relief_m, 0.03 * relief_m, 0.3 * relief_m, relief_m};
    eye.z_m = round_to_lattice(index.ground_height_m(eye.x_m, eye.y_m).value_or(bounds.low.z_m) +
                               heights_m[i % 5]);
    eyes.push_back(eye);
  }
  return eyes;
}

SceneCounts compare_methods(const StabilityScene& scene, const ComparisonOptions& options) {
  SceneCounts counts;
  const std::vector<Position> eyes = eyes_of(scene, options.scattered_eyes);
  counts.eyes = eyes.size();
  if (scene.tin.triangles.empty()) return counts;
  const GroupedScene grouped = group_scene(scene, options.hiding);
  const TinIndex index(grouped.tin);
  ThesisCulling thesis(grouped.groups);
  CertifiedCulling certified(grouped.groups.certified);
  for (const Position& eye : eyes) {
    const std::vector<TriangleSight> sight = judge_all(index, eye);
    std::vector<std::uint8_t> group_seen(grouped.groups.leaf_count, 0);
    const auto& group_of = grouped.groups.group_of_triangle;
    for (std::size_t t = 0; t < sight.size(); ++t)
      if (sight[t] == TriangleSight::kVisible) {
        ++counts.visible;
        if (group_of[t] != kNone) group_seen[group_of[t]] = 1;
      }
    for (const GroupIndex group : group_of)
      counts.in_hidden_groups += group != kNone && !group_seen[group];
    count(grouped, sight, group_seen, thesis, eye, counts.thesis);
    count(grouped, sight, group_seen, certified, eye, counts.certified);
  }
  const auto search = [&](std::size_t searches, const HidesGroup& hides) {
    return adversarial_check(index, grouped.groups.group_of_triangle, grouped.groups.leaf_count,
                             hides, 1, searches);
  };
  counts.thesis.search = search(options.thesis_searches, [&](GroupIndex group,
                                                             const Position& eye) {
    const CullingAnswer answer = visible_groups(grouped.groups, {eye, {}});
    return !std::binary_search(answer.visible_groups.begin(), answer.visible_groups.end(), group);
  });
  counts.certified.search = search(options.searches, [&](GroupIndex group, const Position& eye) {
    return hides_group(grouped.groups.certified, group, eye);
  });
  return counts;
}

}  // namespace scarp::test
