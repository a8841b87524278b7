#include "core/occlusion/hidden_together.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>

#include "core/occlusion/ground_cells.h"
#include "core/occlusion/growth_ground.h"
#include "core/occlusion/seen_sample.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/occlusion/void_bridges.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/support/horizon_scenes.h"

namespace scarp {
namespace {

double rolling_m(double x_m, double y_m) {
  return 60 * std::sin(x_m / 90) * std::cos(y_m / 70) + 25 * std::sin((x_m + y_m) / 37);
}

const Tin& rolling() {
  static const Tin tin = lattice_tin(60, 60, 10, rolling_m);
  return tin;
}

HiddenTogetherOptions small_groups() {
  HiddenTogetherOptions options;
  options.group_triangles = 50;
  options.min_group_triangles = 12;
  options.eyes = 128;
  return options;
}

std::vector<std::uint32_t> sizes_of(const LeafGroups& groups) {
  std::vector<std::uint32_t> sizes(groups.count, 0);
  for (const GroupIndex g : groups.group_of_triangle) ++sizes.at(g);
  return sizes;
}

/// A TIN of some of another's triangles.
Tin part_of(const Tin& whole, const std::function<bool(const Position& corner)>& keep) {
  Tin part;
  std::vector<VertexIndex> number(whole.vertices.size(), kNone);
  for (const auto& corners : whole.triangles) {
    if (!std::all_of(corners.begin(), corners.end(),
                     [&](VertexIndex v) { return keep(whole.vertices[v]); }))
      continue;
    part.triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      VertexIndex& v = number[corners[i]];
      if (v == kNone) {
        v = static_cast<VertexIndex>(part.vertices.size());
        part.vertices.push_back(whole.vertices[corners[i]]);
      }
      part.triangles.back()[i] = v;
    }
  }
  connect_neighbours(part);
  return part;
}

/// Number of parts of all groups, connected by edges and the pairs given.
std::size_t parts_of(const Tin& tin, const std::vector<GroupIndex>& groups,
                     const std::vector<std::pair<TriangleIndex, TriangleIndex>>& bridges = {}) {
  std::vector<TriangleIndex> into(tin.triangles.size());
  std::iota(into.begin(), into.end(), 0U);
  std::size_t parts = into.size();
  const auto root = [&](TriangleIndex t) {
    while (into[t] != t) t = into[t] = into[into[t]];
    return t;
  };
  const auto join = [&](TriangleIndex a, TriangleIndex b) {
    if (groups[a] != groups[b] || root(a) == root(b)) return;
    into[root(a)] = root(b);
    --parts;
  };
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
    for (const TriangleIndex n : tin.neighbours[t])
      if (n != kNone) join(t, n);
  for (const auto& [a, b] : bridges) join(a, b);
  return parts;
}

/// Share of triangles in hidden groups, over eyes that growth has not sampled.
double hidden_share(const Tin& tin, const LeafGroups& groups) {
  const TinIndex index(tin);
  SplitMix64 random(777);
  double hidden = 0;
  int eyes = 0;
  for (const double height_m : {2.0, 50.0})
    for (int i = 0; i < 20; ++i, ++eyes) {
      Position eye = tin.vertices[random.below(tin.vertices.size())];
      eye.z_m += height_m;
      const std::vector<TriangleSight> sight = judge_all(index, eye);
      std::vector<std::uint32_t> in_hidden = sizes_of(groups);
      for (TriangleIndex t = 0; t < sight.size(); ++t)
        if (sight[t] == TriangleSight::kVisible) in_hidden[groups.group_of_triangle[t]] = 0;
      hidden += std::accumulate(in_hidden.begin(), in_hidden.end(), 0.0);
    }
  return hidden / eyes / static_cast<double>(tin.triangles.size());
}

TEST(HiddenTogether, GroupsAreConnectedCompleteAndOfTheSizeAskedFor) {
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    HiddenTogetherOptions options = small_groups();
    options.seed = seed;
    const LeafGroups groups = grow_hidden_together(rolling(), options);
    const auto all = rolling().triangles.size();
    ASSERT_EQ(groups.group_of_triangle.size(), all);
    EXPECT_LE(groups.count, all / 50);
    EXPECT_GE(groups.count, all * 95 / 100 / 50);
    EXPECT_EQ(parts_of(rolling(), groups.group_of_triangle), groups.count);
    std::vector<std::uint32_t> sizes = sizes_of(groups);
    std::sort(sizes.begin(), sizes.end());
    EXPECT_GE(sizes.front(), options.min_group_triangles);
    EXPECT_GE(sizes[sizes.size() / 2], 25U);
    GroupIndex next = 0;  // numbered in the order of their first triangles
    for (const GroupIndex g : groups.group_of_triangle) {
      ASSERT_LE(g, next);
      next = std::max(next, g + 1);
    }
  }
}

TEST(HiddenTogether, CollisionsAreTheSharedEdges) {
  const LeafGroups groups = grow_hidden_together(rolling(), small_groups());
  ASSERT_EQ(groups.collisions.size(), groups.count);
  std::vector<std::map<GroupIndex, std::uint64_t>> shared(groups.count);
  for (TriangleIndex t = 0; t < rolling().triangles.size(); ++t)
    for (const TriangleIndex n : rolling().neighbours[t])
      if (n != kNone && groups.group_of_triangle[n] != groups.group_of_triangle[t])
        ++shared[groups.group_of_triangle[t]][groups.group_of_triangle[n]];
  EXPECT_EQ(groups.collisions, shared);
}

TEST(HiddenTogether, SameSeedSameGroupsForAnyThreadCountOtherSeedOthers) {
  HiddenTogetherOptions options = small_groups();
  const LeafGroups reference = grow_hidden_together(rolling(), options);
  for (const int threads : {1, 2, 7}) {
    set_thread_count(threads);
    const LeafGroups again = grow_hidden_together(rolling(), options);
    EXPECT_EQ(reference.group_of_triangle, again.group_of_triangle);
    EXPECT_EQ(reference.collisions, again.collisions);
  }
  set_thread_count(0);
  options.seed = 99;
  EXPECT_NE(reference.group_of_triangle,
            grow_hidden_together(rolling(), options).group_of_triangle);
}

/// The reason for all of it, on ground that growth has not seen from these eyes. Groups that may
/// reach a little farther for what is hidden with them hide more than compact ones.
TEST(HiddenTogether, HideMoreThanSquaresAndThanCompactGroups) {
  const LeafGroups groups = grow_hidden_together(rolling(), small_groups());
  const auto mean = static_cast<std::uint32_t>(rolling().triangles.size() / groups.count);
  const LeafGroups squares = group_by_squares(rolling(), mean);
  ASSERT_GE(squares.count, groups.count);
  HiddenTogetherOptions compact = small_groups();
  compact.compactness = 4;
  const double hidden = hidden_share(rolling(), groups);
  EXPECT_GT(hidden, 1.1 * hidden_share(rolling(), squares));
  EXPECT_GT(hidden, 1.02 * hidden_share(rolling(), grow_hidden_together(rolling(), compact)));
}

TEST(HiddenTogether, CompactGroupsReachLessFar) {
  const auto reach_m2 = [&](double compactness) {
    HiddenTogetherOptions options = small_groups();
    options.compactness = compactness;
    const LeafGroups groups = grow_hidden_together(rolling(), options);
    std::vector<Position> sums(groups.count);
    const std::vector<std::uint32_t> sizes = sizes_of(groups);
    const auto corner = [&](TriangleIndex t) {
      return rolling().vertices[rolling().triangles[t][0]];
    };
    for (TriangleIndex t = 0; t < rolling().triangles.size(); ++t) {
      sums[groups.group_of_triangle[t]].x_m += corner(t).x_m;
      sums[groups.group_of_triangle[t]].y_m += corner(t).y_m;
    }
    double sum_m2 = 0;
    for (TriangleIndex t = 0; t < rolling().triangles.size(); ++t) {
      const GroupIndex g = groups.group_of_triangle[t];
      sum_m2 += std::pow(corner(t).x_m - sums[g].x_m / sizes[g], 2) +
                std::pow(corner(t).y_m - sums[g].y_m / sizes[g], 2);
    }
    return sum_m2 / static_cast<double>(rolling().triangles.size());
  };
  const double free_m2 = reach_m2(0), usual_m2 = reach_m2(0.08), compact_m2 = reach_m2(4);
  EXPECT_GT(free_m2, usual_m2);
  EXPECT_GT(usual_m2, compact_m2);
  EXPECT_LT(compact_m2, 100.0 * 25 / 5);  // of a square: area / 6
}

/// Islands of two triangles in a wide gap belong to a group across the void, not to nobody.
TEST(HiddenTogether, IslandsJoinWhatIsNearest) {
  const Tin tin = part_of(lattice_tin(60, 30, 10, rolling_m), [](const Position& p) {
    const bool in_gap = p.x_m > 200 && p.x_m < 400;
    return !in_gap || (std::fmod(p.x_m, 40) < 15 && std::fmod(p.y_m, 40) < 15);
  });
  const HiddenTogetherOptions options = small_groups();
  const auto bridges = bridge_voids(tin, options.group_triangles);
  const LeafGroups groups = grow_hidden_together(tin, options);
  EXPECT_EQ(std::count(groups.group_of_triangle.begin(), groups.group_of_triangle.end(), kNone), 0);
  for (const std::uint32_t size : sizes_of(groups)) EXPECT_GE(size, options.min_group_triangles);
  EXPECT_GT(parts_of(tin, groups.group_of_triangle), groups.count + 10);
  EXPECT_EQ(parts_of(tin, groups.group_of_triangle, bridges), groups.count);
}

TEST(HiddenTogether, OneTriangleNoneAndFewerThanAGroup) {
  EXPECT_EQ(grow_hidden_together({}, {}).count, 0U);
  Tin one;
  one.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  one.triangles = {{0, 1, 2}};
  connect_neighbours(one);
  EXPECT_EQ(grow_hidden_together(one, {}).group_of_triangle, (std::vector<GroupIndex>{0}));
  const Tin few = lattice_tin(5, 5, 10, rolling_m);
  const LeafGroups all = grow_hidden_together(few, {});
  EXPECT_EQ(all.count, 1U);
  HiddenTogetherOptions single;
  single.group_triangles = 1;
  EXPECT_EQ(grow_hidden_together(few, single).count, few.triangles.size());
}

TEST(VoidBridges, NoneOnOnePartAndOneForEachTwoThatMeet) {
  EXPECT_TRUE(bridge_voids(rolling(), 1000).empty());
  const Tin tin = part_of(lattice_tin(30, 10, 10, rolling_m), [](const Position& p) {
    return p.x_m <= 60 || (p.x_m >= 100 && p.x_m <= 120) || p.x_m >= 200;
  });
  const auto bridges = bridge_voids(tin, 50);  // only the one in the middle is small
  ASSERT_EQ(bridges.size(), 2U);
  const auto x_m = [&](TriangleIndex t) { return tin.vertices[tin.triangles[t][0]].x_m; };
  for (const auto& [a, b] : bridges)
    EXPECT_NE(x_m(a) >= 100 && x_m(a) <= 120, x_m(b) >= 100 && x_m(b) <= 120);
  EXPECT_TRUE(bridge_voids(tin, 10).empty());
}

RC_GTEST_PROP(VoidBridges, ConnectEverySmallPart, ()) {
  const auto holes = *rc::gen::container<std::set<int>>(rc::gen::inRange(0, 20 * 20));
  const Tin tin = part_of(lattice_tin(20, 20, 10, rolling_m), [&](const Position& p) {
    return !holes.count(static_cast<int>(p.x_m / 10 + 2 * p.y_m));
  });
  RC_PRE(!tin.triangles.empty());
  const std::vector<GroupIndex> together(tin.triangles.size(), 0);
  RC_ASSERT(parts_of(tin, together, bridge_voids(tin, 1000)) == 1U);
}

TEST(GroundCells, HaveTheHeightsOfTheSurfaceAndVoid) {
  const auto plane_m = [](double x_m, double y_m) { return 3 + x_m / 4 - y_m / 8; };
  const Tin tin = part_of(lattice_tin(30, 30, 10, plane_m),
                          [](const Position& p) { return p.x_m <= 100 || p.y_m <= 100; });
  const GroundCells ground = sample_ground(tin, 3);
  std::size_t known = 0;
  for (std::int32_t row = 0; row < ground.rows; ++row)
    for (std::int32_t column = 0; column < ground.columns; ++column) {
      const double x_m = ground.low_x_m + column * ground.cell_m;
      const double y_m = ground.low_y_m + row * ground.cell_m;
      const float height_m = ground.height_m[ground.at(column, row)];
      const bool inside = x_m <= 290 && y_m <= 290 && (x_m <= 100 || y_m <= 100);
      ASSERT_EQ(height_m != kVoidHeightM, inside) << x_m << ' ' << y_m;
      if (!inside) continue;
      EXPECT_NEAR(height_m, plane_m(x_m, y_m), 1e-4);
      ++known;
    }
  EXPECT_NEAR(static_cast<double>(known) / static_cast<double>(tin.triangles.size()), 3, 0.3);
}

/// Along the axes and diagonals no interpolation is needed: the answer is that of the profile.
TEST(EstimatedViewshed, IsExactAlongTheEightPrincipalLines) {
  const GroundCells ground = sample_ground(rolling(), 0.5);
  Position eye;
  const std::int32_t from_column = ground.columns / 3, from_row = ground.rows / 2;
  eye.x_m = ground.low_x_m + from_column * ground.cell_m;
  eye.y_m = ground.low_y_m + from_row * ground.cell_m;
  eye.z_m = ground.height_m[ground.at(from_column, from_row)] + 2;
  std::vector<float> seen_above_m(ground.height_m.size());
  estimate_viewshed(ground, eye, seen_above_m);
  int hidden = 0, seen = 0;
  for (const int dx : {-1, 0, 1})
    for (const int dy : {-1, 0, 1}) {
      if (dx == 0 && dy == 0) continue;
      double steepest = -1e9;
      for (int i = 1;; ++i) {
        const std::int32_t column = from_column + i * dx, row = from_row + i * dy;
        if (column < 0 || row < 0 || column >= ground.columns || row >= ground.rows) break;
        const std::size_t node = ground.at(column, row);
        if (ground.height_m[node] == kVoidHeightM) break;
        const double slope = (ground.height_m[node] - eye.z_m) / i;
        steepest = std::max(steepest, slope);
        EXPECT_NEAR(seen_above_m[node], steepest * i, 1e-3);
        (slope < steepest - 1e-3 ? hidden : seen)++;
      }
    }
  EXPECT_GT(hidden, 20);
  EXPECT_GT(seen, 20);
}

TEST(SeenSample, AgreesWithTheJudgeButForFew) {
  constexpr std::uint32_t kEyes = 64;
  const SeenSample sample = sample_sight(rolling(), 5, kEyes);
  ASSERT_EQ(sample.words, 1U);
  const TinIndex index(rolling());
  SplitMix64 random(5);
  std::size_t wrong = 0, seen = 0;
  for (std::uint32_t k = 0; k < kEyes; ++k) {
    const std::size_t first = rolling().vertices.size() * k / kEyes;
    const std::size_t end = rolling().vertices.size() * (k + 1) / kEyes;
    Position eye = rolling().vertices[first + random.below(end - first)];
    eye.z_m += kSampledHeightsM[k % 4];
    const std::vector<TriangleSight> sight = judge_all(index, eye);
    for (TriangleIndex t = 0; t < sight.size(); ++t) {
      const bool is_seen = (sample.of(t)[0] >> k & 1) != 0;
      wrong += is_seen != (sight[t] == TriangleSight::kVisible) ? 1 : 0;
      seen += is_seen ? 1 : 0;
    }
  }
  const double all = kEyes * static_cast<double>(rolling().triangles.size());
  EXPECT_LT(static_cast<double>(wrong) / all, 0.01);
  EXPECT_GT(static_cast<double>(seen) / all, 0.2);
  EXPECT_LT(static_cast<double>(seen) / all, 0.8);
}

/// Growth's own scene: a strip whose triangles have the bits given, no price for distance.
GrowthGround strip(const std::vector<std::uint64_t>& bits) {
  GrowthGround ground;
  ground.seen = {64, 1, bits};
  ground.first_neighbour.push_back(0);
  for (TriangleIndex t = 0; t < bits.size(); ++t) {
    ground.places.push_back({static_cast<double>(t), 0, 1});
    if (t > 0) ground.neighbours.push_back(t - 1);
    if (t + 1 < bits.size()) ground.neighbours.push_back(t + 1);
    ground.first_neighbour.push_back(static_cast<std::uint32_t>(ground.neighbours.size()));
  }
  return ground;
}

double loss_of(const GrowthGround& ground, const Partition& partition) {
  std::vector<std::uint64_t> seen(partition.count, 0);
  std::vector<double> triangles(partition.count, 0);
  for (TriangleIndex t = 0; t < partition.group_of_triangle.size(); ++t) {
    seen[partition.group_of_triangle[t]] |= ground.seen.of(t)[0];
    ++triangles[partition.group_of_triangle[t]];
  }
  double loss = 0;
  for (GroupIndex g = 0; g < partition.count; ++g) loss += triangles[g] * std::popcount(seen[g]);
  return loss;
}

TEST(Coalesce, UnitesWhatIsSeenFromTheSameEyes) {
  const GrowthGround ground = strip({1, 1, 1, 6, 6, 8, 8, 8});
  const Partition partition = coalesce(ground, 3, 1);
  EXPECT_EQ(partition.group_of_triangle, (std::vector<GroupIndex>{0, 0, 0, 1, 1, 2, 2, 2}));
  EXPECT_EQ(partition.count, 3U);
  // The two in the middle are too few: they join those with which they lose less.
  EXPECT_EQ(coalesce(strip({1, 1, 1, 6, 6, 2, 2, 2}), 3, 3).group_of_triangle,
            (std::vector<GroupIndex>{0, 0, 0, 1, 1, 1, 1, 1}));
}

TEST(Exchange, SoftenedLossLeadsOverWhatPaysOnlyTogether) {
  // Two triangles seen by eye 0 spoil a group seen by eye 5. The first to go makes it worse.
  std::vector<std::uint64_t> bits = {31, 31, 1, 1};
  bits.insert(bits.end(), 12, 32);
  const GrowthGround ground = strip(bits);
  std::vector<GroupIndex> begun(bits.size(), 1), wanted(bits.size(), 1);
  begun[0] = begun[1] = 0;
  std::fill_n(wanted.begin(), 4, 0U);
  const ExchangeRound hard{0, 5}, soft{2, 5};
  Partition stuck{begun, 2}, freed{begun, 2};
  exchange(ground, {&hard, 1}, 1, stuck);
  EXPECT_EQ(stuck.group_of_triangle, begun);
  exchange(ground, {&soft, 1}, 1, freed);
  EXPECT_EQ(freed.group_of_triangle, wanted);
  EXPECT_LT(loss_of(ground, freed), loss_of(ground, stuck));
}

TEST(Exchange, DistanceAloneMakesEqualHalvesAndFollowsTheWeights) {
  GrowthGround ground = strip(std::vector<std::uint64_t>(12, 0));
  ground.spread_price = 1;
  const ExchangeRound hard{0, 9};
  Partition partition{{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1}, 2};
  exchange(ground, {&hard, 1}, 1, partition);
  const auto first = std::count(partition.group_of_triangle.begin(),
                                partition.group_of_triangle.end(), GroupIndex{0});
  EXPECT_NEAR(static_cast<double>(first), 6, 1);
  // Where distance weighs little, triangles may be far: the other half is the smaller one.
  for (TriangleIndex t = 0; t < 6; ++t) ground.places[t].weight = 1.0 / 64;
  exchange(ground, {&hard, 1}, 1, partition);
  EXPECT_GT(std::count(partition.group_of_triangle.begin(), partition.group_of_triangle.end(),
                       GroupIndex{0}),
            first);
}

RC_GTEST_PROP(Exchange, NeverLosesAndKeepsGroupsWhole, ()) {
  const auto bits = *rc::gen::container<std::vector<std::uint64_t>>(
      40, rc::gen::map(rc::gen::inRange<std::uint64_t>(0, 64),
                       [](std::uint64_t b) { return b & (b >> 1); }));
  const GrowthGround ground = strip(bits);
  Partition partition = coalesce(ground, 6, 3);
  RC_ASSERT(partition.count <= 6U);
  const double before = loss_of(ground, partition);
  const ExchangeRound hard{0, 5};
  exchange(ground, {&hard, 1}, 3, partition);
  RC_ASSERT(loss_of(ground, partition) <= before);
  std::vector<std::uint32_t> sizes(partition.count, 0);
  std::size_t borders = 0;
  for (std::size_t t = 0; t < bits.size(); ++t) {
    ++sizes[partition.group_of_triangle[t]];
    borders += t > 0 && partition.group_of_triangle[t] != partition.group_of_triangle[t - 1];
  }
  RC_ASSERT(borders + 1 == partition.count);
  for (const std::uint32_t size : sizes) RC_ASSERT(size >= 3U);
}

}  // namespace
}  // namespace scarp
