// Certified regions where their margins are all that keeps them right: few fans, so that rays
// spread far; many sectors, so that neighbours do not cover up for each other; a few small groups
// behind walls that are open in one place only, turned to every angle against the fans; and cameras
// that climb to where the answer is closest to being wrong. docs/stability.md tells which margin
// each of these scenes needs.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "tests/support/adversarial_check.h"
#include "tests/support/terrain.h"

namespace scarp::test {
namespace {

constexpr double kCellM = 10;

/// Times as many scenes as usual: SCARP_PROVE_SCENES, for the long proof.
std::uint64_t scaled(std::uint64_t scenes) {
  const char* asked = std::getenv("SCARP_PROVE_SCENES");
  return asked ? scenes * std::stoull(asked) : scenes;
}

/// A terrain and its few groups; most triangles are in none.
struct Arena {
  Tin tin;
  std::vector<GroupIndex> group_of_triangle;
  std::uint32_t groups = 0;
  /// The more sectors there are to a fan, the less do neighbours cover up for each other.
  std::int32_t least_fans = 8, least_sectors = 16;
};

/// Whole numbers in [low, high].
std::int32_t whole(SplitMix64& random, std::int32_t low, std::int32_t high) {
  return low + static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(high - low + 1)));
}

/// Some of the squares that the terrain is divided in.
Arena arena_of_squares(Tin tin, std::uint32_t group_triangles, double kept_share,
                       SplitMix64& random) {
  const LeafGroups squares = group_by_squares(tin, group_triangles);
  Arena arena{std::move(tin), {}, 0, 8, 16};
  std::vector<GroupIndex> kept(squares.count, kNone);
  for (GroupIndex& group : kept)
    if (random.unit() < kept_share) group = arena.groups++;
  for (const GroupIndex group : squares.group_of_triangle)
    arena.group_of_triangle.push_back(kept[group]);
  return arena;
}

/// Groups by the middle of a triangle, in cells: a function gives kNone or the group.
Arena arena_of(Tin tin, std::uint32_t groups,
               const std::function<GroupIndex(double column, double row)>& group_at) {
  Arena arena{std::move(tin), {}, groups, 8, 128};
  for (const auto& corners : arena.tin.triangles) {
    double x_m = 0, y_m = 0;
    for (const VertexIndex v : corners)
      x_m += arena.tin.vertices[v].x_m / 3, y_m += arena.tin.vertices[v].y_m / 3;
    arena.group_of_triangle.push_back(group_at(x_m / kCellM, y_m / kCellM));
  }
  return arena;
}

/// A long wall of posts with one or two gaps (of floor, or of void) on a rough floor; groups of few
/// triangles on both sides, on one side long ones, of which a gap shows a part only.
Arena fence(SplitMix64& random) {
  const std::int32_t columns = 14, rows = 32, at = whole(random, 4, 9);
  const double height_m = 10 + 90 * random.unit();
  const std::int32_t first = whole(random, 8, 23), second = random.below(2) ? first : 16;
  const double gap_m = random.below(4) == 0 ? std::nan("") : 0;
  const double rough_m = random.below(2) ? 1 : 0;
  Tin tin = triangulated(grid_of(columns, rows, kCellM,
                                 [&](std::int32_t column, std::int32_t row) {
                                   if (column == at)
                                     return row == first || row == second ? gap_m : height_m;
                                   return rough_m * random.unit();
                                 }),
                         1 + random.below(3));
  if (random.below(2) == 0) {
    const double wall_m = kCellM * (at - 1);
    for (Position& p : tin.vertices)
      if (p.x_m < wall_m) p.x_m = wall_m + 5 * (p.x_m - wall_m);
  }
  Arena arena = arena_of_squares(std::move(tin), random.below(2) ? 2 : 1, 0.02, random);
  arena.least_sectors = 64;
  return arena;
}

/// A plain with a ring of high ground around its middle, higher and lower by azimuth, sometimes
/// with a notch; the group is in the middle, so that every direction has its own horizon.
Arena crown(SplitMix64& random) {
  const std::int32_t side = 29;
  const double inner = 5 + 4 * random.unit(), outer = inner + 1 + 3 * random.unit();
  const double top_m = 30 + 60 * random.unit(), change_m = 0.6 * top_m * random.unit();
  const double waves = static_cast<double>(whole(random, 1, 5)), phase_rad = 7 * random.unit();
  const double notch_rad = 2 * std::numbers::pi * random.unit() - std::numbers::pi;
  const double half_notch_rad = random.below(3) ? 0.12 : 0;
  Tin tin = triangulated(
      grid_of(side, side, kCellM,
              [&](std::int32_t column, std::int32_t row) {
                const double x = column - 14, y = 14 - row;
                const double distance = std::hypot(x, y), azimuth_rad = std::atan2(y, x);
                if (distance < inner || distance > outer) return 0.0;
                if (std::abs(std::remainder(azimuth_rad - notch_rad, 2 * std::numbers::pi)) <
                    half_notch_rad)
                  return 0.0;
                return top_m + change_m * std::sin(waves * azimuth_rad + phase_rad);
              }),
      1 + random.below(3));
  Arena arena = arena_of(std::move(tin), 1, [](double column, double row) {
    return std::abs(column - 14.5) < 0.5 && std::abs(row - 14.5) < 0.5 ? 0 : kNone;
  });
  arena.least_fans = 16;
  return arena;
}

/// One large group on the floor of a court, a wall close around it with one gap, and cameras near:
/// rays pass the group's centre at every offset.
Arena court(SplitMix64& random) {
  const std::int32_t side = 17, half = whole(random, 3, 5);
  const double height_m = 20 + 80 * random.unit();
  const std::int32_t gap = whole(random, -half + 1, half - 1), gap_side = whole(random, 0, 3);
  Tin tin = triangulated(
      grid_of(side, side, kCellM,
              [&](std::int32_t column, std::int32_t row) {
                const std::int32_t x = column - 8, y = 8 - row;
                if (std::max(std::abs(x), std::abs(y)) != half) return 0.5 * random.unit();
                const std::int32_t along = gap_side % 2 == 0 ? y : x;
                const std::int32_t across = gap_side % 2 == 0 ? x : y;
                return along == gap && across == (gap_side < 2 ? half : -half) ? 0 : height_m;
              }),
      1 + random.below(3));
  const double reach = half - 1 - 0.01;
  const bool is_strip = random.below(2) == 0;
  const double strip = whole(random, 1 - half, half - 2) + 0.5;
  Arena arena = arena_of(std::move(tin), 1, [&](double column, double row) {
    const double x = column - 8, y = row - 8;
    const bool inside = std::max(std::abs(x), std::abs(y)) < reach;
    return inside && (!is_strip || std::abs(x - strip) < 0.5) ? 0 : kNone;
  });
  arena.least_sectors = 64;
  return arena;
}

/// Groups of two to four triangles that lie far apart in a maze, and cameras between and close
/// around them: rays pass the group's centre at every offset, and there are walls before and behind
/// the camera within the group's circle.
Arena maze(SplitMix64& random) {
  const std::int32_t side = 19;
  const double height_m = 10 + 60 * random.unit(), open_share = 0.05 + 0.2 * random.unit();
  const std::int32_t aisle = whole(random, 3, 6), cross = whole(random, 5, 20);
  Tin tin = triangulated(
      grid_of(side, side, kCellM,
              [&](std::int32_t column, std::int32_t row) {
                const bool is_wall = column % aisle == 1 || row % cross == 2;
                return is_wall && random.unit() > open_share ? height_m : 0.3 * random.unit();
              }),
      1 + random.below(3));
  const std::size_t triangles = tin.triangles.size();
  Arena arena = arena_of(std::move(tin), 3, [](double, double) { return kNone; });
  for (GroupIndex group = 0; group < arena.groups; ++group)
    for (std::uint64_t i = 0; i < 2 + random.below(3); ++i)
      arena.group_of_triangle[random.below(triangles)] = group;
  for (GroupIndex group = 0; group < arena.groups; ++group)  // no group is empty
    arena.group_of_triangle[random.below(triangles / 3) * 3 + group] = group;
  return arena;
}

/// A maze of narrow and broad cells, and groups of a few triangles near each other: a long border
/// with a short one behind it or before it, so that some rays over one cross the other and some
/// pass beside it.
Arena uneven_maze(SplitMix64& random) {
  Arena arena = maze(random);
  const double widths_m[] = {2, 5, 40};
  std::array<double, 20> column_m{}, row_m{};
  for (std::size_t i = 1; i < column_m.size(); ++i) {
    column_m[i] = column_m[i - 1] + widths_m[random.below(3)];
    row_m[i] = row_m[i - 1] + widths_m[random.below(3)];
  }
  for (Position& p : arena.tin.vertices) {
    p.x_m = column_m[static_cast<std::size_t>(p.x_m / kCellM)];
    p.y_m = row_m[static_cast<std::size_t>(p.y_m / kCellM)];
  }
  const auto& triangles = arena.tin.triangles;
  arena.group_of_triangle.assign(triangles.size(), kNone);
  for (GroupIndex group = 0; group < arena.groups; ++group) {
    const auto first = random.below(triangles.size());
    arena.group_of_triangle[first] = group;
    const Position& from = arena.tin.vertices[triangles[first][0]];
    for (int added = 0, tries = 0; added < 3 && tries < 400; ++tries) {
      const auto other = random.below(triangles.size());
      const Position& to = arena.tin.vertices[triangles[other][0]];
      if (arena.group_of_triangle[other] != kNone ||
          std::hypot(to.x_m - from.x_m, to.y_m - from.y_m) > 50)
        continue;
      arena.group_of_triangle[other] = group;
      ++added;
    }
  }
  for (GroupIndex group = 0; group < arena.groups; ++group)  // no group is empty
    arena.group_of_triangle[random.below(triangles.size() / 3) * 3 + group] = group;
  arena.least_fans = 16;
  arena.least_sectors = 256;
  return arena;
}

/// Groups of neighbouring triangles with much relief of their own, between walls: all the ground
/// that rays over a piece of the border come from has to count, however they come.
Arena rough_patches(SplitMix64& random) {
  const std::int32_t side = whole(random, 12, 18), aisle = whole(random, 3, 6);
  const double rough_m = 40 * random.unit(), wall_m = 30 + 60 * random.unit();
  const double open_share = 0.05 + 0.15 * random.unit();
  Tin tin = triangulated(grid_of(side, side, kCellM,
                                 [&](std::int32_t column, std::int32_t row) {
                                   const bool is_wall = column % aisle == 1 || row % aisle == 2;
                                   return rough_m * random.unit() +
                                          (is_wall && random.unit() > open_share ? wall_m : 0);
                                 }),
                         1 + random.below(3));
  Arena arena = arena_of(std::move(tin), 3, [](double, double) { return kNone; });
  const std::size_t triangles = arena.tin.triangles.size();
  for (GroupIndex group = 0; group < arena.groups; ++group) {
    auto at = static_cast<TriangleIndex>(random.below(triangles));
    for (std::uint64_t steps = 2 + random.below(20); steps > 0; --steps) {
      arena.group_of_triangle[at] = group;
      const TriangleIndex next = arena.tin.neighbours[at][random.below(3)];
      if (next != kNone) at = next;
    }
  }
  for (GroupIndex group = 0; group < arena.groups; ++group)  // no group is empty
    arena.group_of_triangle[random.below(triangles / 3) * 3 + group] = group;
  arena.least_sectors = 64;
  return arena;
}

/// A plateau with a few spikes, all of it one group, over low ground: from below, a spike is seen
/// over whatever part of the rim lies before it, however far to the side.
Arena plateau(SplitMix64& random) {
  const std::int32_t side = 15;
  const double half_columns = 1.5 + 3 * random.unit(), half_rows = 1.5 + 3 * random.unit();
  const double drop_m = 50 + 200 * random.unit(), spike_share = 0.03 + 0.1 * random.unit();
  const auto is_on_it = [&](double column, double row) {
    return std::abs(column - 7) <= half_columns && std::abs(row - 7) <= half_rows;
  };
  Tin tin = triangulated(grid_of(side, side, kCellM,
                                 [&](std::int32_t column, std::int32_t row) {
                                   if (!is_on_it(column, row)) return -drop_m;
                                   return random.unit() < spike_share ? 40 * random.unit()
                                                                      : random.unit();
                                 }),
                         1 + random.below(3));
  Arena arena = arena_of(std::move(tin), 1, [](double, double) { return kNone; });
  for (std::size_t t = 0; t < arena.tin.triangles.size(); ++t) {
    bool is_on_top = true;
    for (const VertexIndex v : arena.tin.triangles[t]) is_on_top &= arena.tin.vertices[v].z_m >= 0;
    if (is_on_top) arena.group_of_triangle[t] = 0;
  }
  return arena;
}

Arena posts(SplitMix64& random) {
  const std::int32_t side = whole(random, 10, 16);
  Tin tin = triangulated(
      grid_of(side, side, kCellM,
              [&](std::int32_t, std::int32_t) {
                const double kind = random.unit();
                return kind < 0.25 ? 150 * random.unit() : kind < 0.3 ? -60 : random.unit();
              }),
      1 + random.below(3));
  return arena_of_squares(std::move(tin), 1U << random.below(4), 0.2, random);
}

/// A slope with a ridge along it or across: targets are tilted, and so are the lines of sight.
Arena slope(SplitMix64& random) {
  const std::int32_t side = whole(random, 10, 16), ridge = whole(random, 2, side - 3);
  const double rise = 3 * random.unit() - 1.5, across = 3 * random.unit() - 1.5;
  const double crest_m = 80 * random.unit(), crest_rise = 4 * random.unit() - 2;
  Tin tin = triangulated(grid_of(side, side, kCellM,
                                 [&](std::int32_t column, std::int32_t row) {
                                   const double crest = column == ridge || column == ridge + 1;
                                   return kCellM * (rise * column + across * row) +
                                          crest * std::max(0.0, crest_m + crest_rise * row);
                                 }),
                         1 + random.below(3));
  return arena_of_squares(std::move(tin), 1U << random.below(4), 0.15, random);
}

Arena hills(SplitMix64& random) {
  const std::int32_t side = whole(random, 12, 18);
  Tin tin = triangulated(random_hills(side, side, kCellM, random.next(), 200,
                                      random.below(2) ? 0.01 : 20, random.below(3) ? 0 : 0.15),
                         1 + random.below(3));
  return arena_of_squares(std::move(tin), 1U << random.below(5), 0.2, random);
}

/// Posts on cells of 0.3 m, millions of metres from the origin, where a float is half a metre off.
Arena posts_far_away(SplitMix64& random) {
  Arena arena = posts(random);
  for (Position& p : arena.tin.vertices)
    p = round_to_lattice(Position{p.x_m / 32 + 4'200'000, p.y_m / 32 - 5'400'000, p.z_m / 32});
  return arena;
}

/// Turned to any angle and stretched, so that nothing lies along fans or sectors.
void turn(Tin& tin, SplitMix64& random) {
  const double angle_rad = 2 * std::numbers::pi * random.unit();
  const double stretch = std::exp2(2 * random.unit() - 1);
  const double cos = std::cos(angle_rad), sin = std::sin(angle_rad);
  for (Position& p : tin.vertices) {
    const double x_m = stretch * p.x_m;
    p = round_to_lattice(Position{cos * x_m - sin * p.y_m, sin * x_m + cos * p.y_m, p.z_m});
  }
}

using MakeArena = Arena (*)(SplitMix64&);

AdversarialReport search_arena(MakeArena make, std::uint64_t seed, std::size_t searches) {
  SplitMix64 random(seed);
  Arena arena = make(random);
  if (random.below(3) != 0) turn(arena.tin, random);
  if (arena.groups == 0 || arena.tin.triangles.empty() || check_tin(arena.tin)) return {};
  HidingOptions options;
  options.fans = arena.least_fans << random.below(3);
  options.sectors = arena.least_sectors << random.below(3);
  options.piece = 0.5;  // finer than usual: coarse bounds would hide what a margin is for
  const CertifiedRegions regions =
      certify_groups(arena.tin, arena.group_of_triangle, arena.groups, options);
  const AdversarialReport report =
      adversarial_check(arena.tin, arena.group_of_triangle, regions, seed, searches);
  if (report.false_culls == 0) return report;
  const BorderCamera& worst = *report.worst;
  ADD_FAILURE() << "seed " << seed << ", " << options.fans << " fans, " << options.sectors
                << " sectors: group " << worst.group << " is culled from " << worst.eye.x_m << " "
                << worst.eye.y_m << " " << worst.eye.z_m << ", which sees it; margin "
                << worst.margin;
  return report;
}

/// @return cameras judged, until something is wrong
std::uint64_t search_arenas(MakeArena make, std::uint64_t first_seed, std::uint64_t scenes,
                            std::size_t searches) {
  std::uint64_t cameras = 0;
  const std::uint64_t end = first_seed + scaled(scenes);
  for (std::uint64_t seed = first_seed; seed < end && !testing::Test::HasFailure(); ++seed)
    cameras += search_arena(make, seed, searches).cameras;
  testing::Test::RecordProperty("cameras", std::to_string(cameras));
  return cameras;
}

TEST(CertifiedMargins, FenceWithOneGap) {
  EXPECT_GT(search_arenas(fence, 1160, 40, 150), 10'000U);
}

TEST(CertifiedMargins, CrownHigherAndLowerByAzimuth) {
  EXPECT_GT(search_arenas(crown, 2000, 30, 80), 10'000U);
}

TEST(CertifiedMargins, CourtWithOneGap) {
  EXPECT_GT(search_arenas(court, 3000, 24, 40), 5'000U);
}

TEST(CertifiedMargins, GroupsFarApartInAMaze) {
  EXPECT_GT(search_arenas(maze, 7100, 40, 100), 10'000U);
}

TEST(CertifiedMargins, LongAndShortBordersInAnUnevenMaze) {
  EXPECT_GT(search_arenas(uneven_maze, 9090, 40, 100), 10'000U);
}

TEST(CertifiedMargins, RoughPatchesBetweenWalls) {
  EXPECT_GT(search_arenas(rough_patches, 10'000, 40, 100), 10'000U);
}

TEST(CertifiedMargins, PlateausWithSpikes) {
  EXPECT_GT(search_arenas(plateau, 11'000, 30, 60), 10'000U);
}

TEST(CertifiedMargins, Posts) {
  EXPECT_GT(search_arenas(posts, 4000, 20, 100), 5'000U);
}

TEST(CertifiedMargins, PostsFarAway) {
  EXPECT_GT(search_arenas(posts_far_away, 8000, 10, 100), 3'000U);
}

TEST(CertifiedMargins, SlopesWithARidge) {
  EXPECT_GT(search_arenas(slope, 5000, 30, 100), 5'000U);
}

TEST(CertifiedMargins, Hills) {
  EXPECT_GT(search_arenas(hills, 6000, 20, 100), 5'000U);
}

}  // namespace
}  // namespace scarp::test
