#include "core/occlusion/hidden_together.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "core/occlusion/growth_ground.h"
#include "core/occlusion/void_bridges.h"

namespace scarp {
namespace {

/// From soft to hard, so that groups first find their valleys and then settle.
constexpr std::array<ExchangeRound, 5> kRounds = {{{6, 3}, {4, 3}, {2, 3}, {1, 3}, {0, 6}}};

/// Rounds in which areas are smoothed: over about as many triangles as a small group has.
constexpr int kAreaRounds = 8;

/// Shares of the time after sampling and after coalescing: progress only.
constexpr double kSampled = 0.5, kCoalesced = 0.7;

void connect(const Tin& tin, std::uint32_t group_triangles, GrowthGround& ground) {
  const auto bridges = bridge_voids(tin, group_triangles);
  std::vector<std::uint32_t>& first = ground.first_neighbour;
  first.assign(tin.triangles.size() + 1, 0);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    for (const TriangleIndex n : tin.neighbours[t]) first[t + 1] += n != kNone ? 1 : 0;
  for (const auto& [a, b] : bridges) {
    ++first[a + 1];
    ++first[b + 1];
  }
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) first[t + 1] += first[t];
  ground.neighbours.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    for (const TriangleIndex n : tin.neighbours[t])
      if (n != kNone) ground.neighbours[next[t]++] = n;
  for (const auto& [a, b] : bridges) {
    ground.neighbours[next[a]++] = b;
    ground.neighbours[next[b]++] = a;
  }
}

/// Plan areas, each the mean of its surroundings: needles beside large triangles even out.
std::vector<double> typical_areas_m2(const Tin& tin, const GrowthGround& ground) {
  std::vector<double> areas_m2, means_m2(tin.triangles.size());
  areas_m2.reserve(tin.triangles.size());
  for (const auto& [a, b, c] : tin.triangles) {
    const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
    areas_m2.push_back(((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2);
  }
  for (int i = 0; i < kAreaRounds; ++i) {
    for (TriangleIndex t = 0; t < areas_m2.size(); ++t) {
      const auto neighbours = ground.neighbours_of(t);
      means_m2[t] = areas_m2[t];
      for (const TriangleIndex n : neighbours) means_m2[t] += areas_m2[n];
      means_m2[t] /= static_cast<double>(neighbours.size() + 1);
    }
    std::swap(areas_m2, means_m2);
  }
  return areas_m2;
}

void measure(const Tin& tin, std::uint32_t group_triangles, GrowthGround& ground) {
  const Position low = bounds_of(tin.vertices).low;
  const std::vector<double> areas_m2 = typical_areas_m2(tin, ground);
  ground.places.reserve(tin.triangles.size());
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    GrowthPlace place{0, 0, 1 / (group_triangles * areas_m2[t])};
    for (const VertexIndex v : tin.triangles[t]) {
      place.x_m += (tin.vertices[v].x_m - low.x_m) / 3;
      place.y_m += (tin.vertices[v].y_m - low.y_m) / 3;
    }
    ground.places.push_back(place);
  }
}

/// By rising first triangle again, and how often the groups meet.
LeafGroups leaves_of(const GrowthGround& ground, const Partition& partition) {
  LeafGroups leaves;
  leaves.passes = 1;
  std::vector<GroupIndex> number(partition.count, kNone);
  for (const GroupIndex group : partition.group_of_triangle) {
    if (number[group] == kNone) number[group] = leaves.count++;
    leaves.group_of_triangle.push_back(number[group]);
  }
  leaves.collisions.resize(leaves.count);
  for (TriangleIndex t = 0; t < leaves.group_of_triangle.size(); ++t)
    for (const TriangleIndex n : ground.neighbours_of(t))
      if (n > t && leaves.group_of_triangle[n] != leaves.group_of_triangle[t])
        count_collision(leaves.collisions, leaves.group_of_triangle[t],
                        leaves.group_of_triangle[n]);
  return leaves;
}

}  // namespace

LeafGroups grow_hidden_together(const Tin& tin, const HiddenTogetherOptions& options,
                                const Progress& progress) {
  assert(options.group_triangles > 0 && tin.neighbours.size() == tin.triangles.size());
  if (tin.triangles.empty()) return {};
  const auto all = static_cast<std::uint32_t>(tin.triangles.size());
  const std::uint32_t groups = std::max(1U, all / options.group_triangles);
  GrowthGround ground;
  ground.seen = sample_sight(tin, options.seed, options.eyes);
  if (progress) progress(kSampled);
  ground.spread_price = options.compactness * options.eyes;
  connect(tin, options.group_triangles, ground);
  measure(tin, options.group_triangles, ground);
  const std::uint32_t least = std::min(options.min_group_triangles, options.group_triangles);
  Partition partition = coalesce(ground, groups, least);
  if (progress) progress(kCoalesced);
  exchange(ground, kRounds, least, partition);
  if (progress) progress(1);
  return leaves_of(ground, partition);
}

}  // namespace scarp
