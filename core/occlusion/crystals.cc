#include "core/occlusion/crystals.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/occlusion/region.h"
#include "core/occlusion/sector_range.h"
#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

struct Crystal {
  VertexIndex lowest = kNone;
  std::uint32_t triangles = 0;
  std::vector<TriangleIndex> border;  // to be tried, first in, first out
  std::size_t next = 0;               // in border
};

class Growth {
 public:
  Growth(const Tin& tin, const HorizonTable& horizon) : tin_(tin), horizon_(horizon) {
    assert(tin.neighbours.size() == tin.triangles.size());
    assert(horizon.horizon_vertex.size() ==
           tin.vertices.size() * static_cast<std::size_t>(horizon.layout.count));
    for (std::int32_t sector = 0; sector < horizon.layout.count; ++sector)
      axes_.push_back(sector_axis(horizon.layout, sector));
    groups_.group_of_triangle.assign(tin.triangles.size(), kNone);
  }

  std::vector<TriangleIndex> orphans() const {
    std::vector<TriangleIndex> orphans;
    for (TriangleIndex t = 0; t < groups_.group_of_triangle.size(); ++t)
      if (groups_.group_of_triangle[t] == kNone) orphans.push_back(t);
    return orphans;
  }

  /// Plants a crystal on each seed and grows them all until none can grow further.
  void run_pass(const std::vector<TriangleIndex>& seeds) {
    const std::size_t first = crystals_.size();
    crystals_.resize(first + seeds.size());
    groups_.collisions.resize(crystals_.size());
    std::vector<GroupIndex> growing;
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      growing.push_back(static_cast<GroupIndex>(first + i));
      take(growing.back(), seeds[i]);
    }
    while (!growing.empty())
      std::erase_if(growing, [&](GroupIndex crystal) { return !take_one(crystal); });
    ++groups_.passes;
  }

  /// Most triangles of the crystals from an index on.
  std::uint32_t largest_from(std::size_t first) const {
    std::uint32_t largest = 0;
    for (std::size_t c = first; c < crystals_.size(); ++c)
      largest = std::max(largest, crystals_[c].triangles);
    return largest;
  }

  std::uint32_t count_of_at_least(std::uint32_t triangles) const {
    return static_cast<std::uint32_t>(
        std::count_if(crystals_.begin(), crystals_.end(),
                      [&](const Crystal& c) { return c.triangles >= triangles; }));
  }

  std::size_t crystal_count() const { return crystals_.size(); }

  /// Merges or frees the small crystals and numbers the rest without gaps.
  LeafGroups finish(const CrystalOptions& options) &&;

 private:
  /// Tries the border until a triangle is taken. False: there is none left.
  bool take_one(GroupIndex crystal) {
    Crystal& self = crystals_[crystal];
    while (self.next < self.border.size()) {
      const TriangleIndex t = self.border[self.next++];
      const GroupIndex owner = groups_.group_of_triangle[t];
      if (owner == crystal || beyond_horizon(self.lowest, t)) continue;
      if (owner == kNone) {
        take(crystal, t);
        return true;
      }
      count_collision(groups_.collisions, crystal, owner);
    }
    self.border = {};
    self.next = 0;
    return false;
  }

  void take(GroupIndex crystal, TriangleIndex t) {
    Crystal& self = crystals_[crystal];
    groups_.group_of_triangle[t] = crystal;
    ++self.triangles;
    for (const VertexIndex v : tin_.triangles[t])
      if (self.lowest == kNone || tin_.vertices[v].z_m < tin_.vertices[self.lowest].z_m)
        self.lowest = v;
    for (const TriangleIndex neighbour : tin_.neighbours[t])
      if (neighbour != kNone) self.border.push_back(neighbour);
  }

  bool beyond_horizon(VertexIndex lowest, TriangleIndex t) const {
    return std::any_of(tin_.triangles[t].begin(), tin_.triangles[t].end(),
                       [&](VertexIndex corner) { return hidden_from(lowest, corner); });
  }

  bool hidden_from(VertexIndex lowest, VertexIndex corner) const {
    if (corner == lowest) return false;
    const Position& from = tin_.vertices[lowest];
    const Position& to = tin_.vertices[corner];
    const SectorRange sectors =
        sectors_towards(horizon_.layout, to.x_m - from.x_m, to.y_m - from.y_m);
    for (std::int32_t i = 0; i < sectors.count; ++i) {
      const std::int32_t sector = (sectors.first + i) % horizon_.layout.count;
      const VertexIndex horizon = horizon_.at(lowest, sector);
      if (horizon == kNone) continue;
      const SectorAxis& axis = axes_[static_cast<std::size_t>(sector)];
      const RayRegion region = region_of_vertex(from, tin_.vertices[horizon], axis);
      if (hides(region.view(), distance_along(axis, to), to.z_m)) return true;
    }
    return false;
  }

  const Tin& tin_;
  const HorizonTable& horizon_;
  std::vector<SectorAxis> axes_;
  std::vector<Crystal> crystals_;
  LeafGroups groups_;
};

/// The crystal under `small` triangles that this one met most often, lowest index on ties.
GroupIndex small_partner(const Collisions& collisions, const std::vector<std::uint32_t>& triangles,
                         GroupIndex crystal, std::uint32_t small) {
  GroupIndex best = kNone;
  std::uint64_t most = 0;
  for (const auto& [other, times] : collisions[crystal]) {
    if (triangles[other] >= small || times <= most) continue;
    best = other;
    most = times;
  }
  return best;
}

LeafGroups Growth::finish(const CrystalOptions& options) && {
  const std::uint32_t small = options.min_group_triangles;
  std::uint32_t large = count_of_at_least(small);
  std::vector<GroupIndex> merged_into(crystals_.size());
  std::vector<std::uint32_t> triangles(crystals_.size());
  for (GroupIndex c = 0; c < crystals_.size(); ++c) {
    merged_into[c] = c;
    triangles[c] = crystals_[c].triangles;
  }
  for (GroupIndex c = 0; c < crystals_.size(); ++c) {
    if (merged_into[c] != c || triangles[c] >= small) continue;
    while (options.merge_small && large < options.max_groups && triangles[c] < small) {
      const GroupIndex partner = small_partner(groups_.collisions, triangles, c, small);
      if (partner == kNone) break;
      fuse_collisions(groups_.collisions, c, partner, c);
      merged_into[partner] = c;
      triangles[c] += std::exchange(triangles[partner], 0);
    }
    if (triangles[c] >= small) ++large;
  }

  std::vector<GroupIndex> number(crystals_.size(), kNone);
  Collisions kept;
  for (GroupIndex c = 0; c < crystals_.size(); ++c) {
    if (merged_into[c] == c && triangles[c] >= small)
      number[c] = groups_.count++;
    else
      drop_collisions(groups_.collisions, c);
  }
  for (GroupIndex c = 0; c < crystals_.size(); ++c) {
    if (number[c] == kNone) continue;
    kept.emplace_back();
    for (const auto& [other, times] : groups_.collisions[c]) kept.back()[number[other]] = times;
  }
  groups_.collisions = std::move(kept);
  for (GroupIndex& group : groups_.group_of_triangle) {
    // A crystal with a lower index may have been merged on: follow to the end.
    while (group != kNone && merged_into[group] != group) group = merged_into[group];
    if (group != kNone) group = number[group];
  }
  return std::move(groups_);
}

/// The first k of a random order.
std::vector<TriangleIndex> scatter(std::vector<TriangleIndex> from, std::size_t k,
                                   SplitMix64& random) {
  for (std::size_t i = 0; i < k; ++i) std::swap(from[i], from[i + random.below(from.size() - i)]);
  from.resize(k);
  return from;
}

}  // namespace

LeafGroups grow_crystals(const Tin& tin, const HorizonTable& horizon, const CrystalOptions& options,
                         const Progress& progress) {
  assert(options.group_triangles > 0 && options.max_passes > 0);
  const std::size_t all = tin.triangles.size();
  const std::size_t first_seeds =
      options.seeds > 0 ? options.seeds : std::max<std::size_t>(1, all / options.group_triangles);
  SplitMix64 random(options.seed);
  Growth growth(tin, horizon);
  std::vector<TriangleIndex> orphans = growth.orphans();
  for (std::uint32_t pass = 0; pass < options.max_passes && !orphans.empty(); ++pass) {
    const std::uint32_t large = growth.count_of_at_least(options.min_group_triangles);
    if (large >= options.max_groups) break;
    const std::size_t in_proportion = (first_seeds * orphans.size() + all - 1) / all;
    const std::size_t seeds =
        std::min({in_proportion, orphans.size(), std::size_t{options.max_groups - large}});
    const std::size_t before = growth.crystal_count();
    growth.run_pass(scatter(std::move(orphans), seeds, random));
    orphans = growth.orphans();
    if (progress) progress(1 - static_cast<double>(orphans.size()) / static_cast<double>(all));
    if (growth.largest_from(before) < options.min_group_triangles) break;
  }
  return std::move(growth).finish(options);
}

}  // namespace scarp
