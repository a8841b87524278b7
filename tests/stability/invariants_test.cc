// What any terrain must satisfy, whatever it looks like: on random terrain and on windows of real
// DEMs, of the judge exactly, and of certified regions that nothing they cull is visible before or
// after.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/horizon/stewart.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/squares.h"
#include "core/sight/line_of_sight.h"
#include "core/sight/triangle_sight.h"
#include "core/terrain/ground_grid.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ray_horizon.h"
#include "tests/judge/dem_window.h"
#include "tests/support/adversarial_check.h"
#include "tests/support/shared_data.h"
#include "tests/support/terrain.h"

namespace scarp::test {
namespace {

/// Middles of edges and of triangles are on the lattice when all positions are multiples of this.
constexpr double kDivisible = 4;

/// Relative rounding of a slope between two of the places compared here.
constexpr double kSlopeRounding = 0x1p-30;

struct Ground {
  std::string name;
  SampleGrid grid;
  Tin tin;
};

Ground ground_of(std::string name, SampleGrid grid) {
  for (Position& p : grid.positions)
    p = {p.x_m * kDivisible, p.y_m * kDivisible, p.z_m * kDivisible};
  Tin tin = triangulated(grid, 17);
  return {std::move(name), std::move(grid), std::move(tin)};
}

std::vector<Ground> random_grounds() {
  constexpr std::int32_t kSide = 13;
  SplitMix64 random(12);
  std::vector<Ground> grounds;
  grounds.push_back(ground_of("hills", random_hills(kSide, kSide, 10, 1, 120, 0.01)));
  grounds.push_back(ground_of("terraces", random_hills(kSide, kSide, 10, 2, 80, 20)));
  grounds.push_back(ground_of("voids", random_hills(kSide, kSide, 10, 3, 120, 0.01, 0.2)));
  grounds.push_back(ground_of("spikes", grid_of(kSide, kSide, 10, [&](std::int32_t, std::int32_t) {
                                return random.below(8) == 0 ? 150 * random.unit() - 30
                                                            : random.unit();
                              })));
  return grounds;
}

/// Nothing where the shared data are not there.
std::vector<Ground> real_grounds() {
  struct Window {
    const char* file;
    std::int32_t column, row;
    double cell_m;
  };
  std::vector<Ground> grounds;
  for (const Window& w : {Window{"projected/bigtujunga_srtm30m_utm11.tif", 300, 200, 30},
                          Window{"projected/mt_st_helens_usgs30m.dem", 150, 230, 30},
                          Window{"geographic/N27E086_everest_srtm3_voids.tif", 424, 64, 80},
                          Window{"projected/gabilan_lidar1m.bil", 250, 300, 1}})
    if (const auto path = shared_data(w.file))
      grounds.push_back(ground_of(w.file, dem_window(*path, w.column, w.row, 13, 13, w.cell_m)));
  return grounds;
}

struct Certified {
  LeafGroups groups;
  CertifiedRegions regions;
};

Certified certify(const Tin& tin, LeafGroups groups) {
  HidingOptions options;
  options.fans = 16;
  options.sectors = 16;
  Certified certified{std::move(groups), {}};
  certified.regions =
      certify_groups(tin, certified.groups.group_of_triangle, certified.groups.count, options);
  return certified;
}

Certified certify(const Tin& tin) {
  return certify(tin, group_by_squares(tin, 6));
}

/// Nothing that is culled from an eye is visible.
void expect_safe(const Certified& certified, const Position& eye,
                 const std::vector<TriangleSight>& sight) {
  for (std::size_t t = 0; t < sight.size(); ++t) {
    const GroupIndex group = certified.groups.group_of_triangle[t];
    if (sight[t] == TriangleSight::kHidden || group == kNone) continue;
    ASSERT_FALSE(hides_group(certified.regions, group, eye))
        << "triangle " << t << " of group " << group << " from " << eye.x_m << " " << eye.y_m << " "
        << eye.z_m;
  }
}

bool is_visible(TriangleSight sight) {
  return sight == TriangleSight::kVisible;
}

/// Places on, a little above and far above the ground, in the air around it and under it.
std::vector<Position> places_around(const Tin& tin, std::uint64_t seed, int count) {
  SplitMix64 random(seed);
  const Bounds bounds = bounds_of(tin.vertices);
  const TinIndex index(tin);
  const double relief_m = bounds.high.z_m - bounds.low.z_m + 1;
  std::vector<Position> places;
  for (int i = 0; i < count; ++i) {
    Position p = tin.vertices[random.below(tin.vertices.size())];
    if (i % 2 == 0) {
      p.x_m = bounds.low.x_m + (1.4 * random.unit() - 0.2) * (bounds.high.x_m - bounds.low.x_m);
      p.y_m = bounds.low.y_m + (1.4 * random.unit() - 0.2) * (bounds.high.y_m - bounds.low.y_m);
      p = round_to_lattice(p);
      p.z_m = index.ground_height_m(p.x_m, p.y_m).value_or(bounds.low.z_m);
    }
    const double heights_m[] = {
        0, kLatticeStepM, 0.02 * relief_m, 0.3 * relief_m, 3 * relief_m, -0.1 * relief_m};
    p.z_m += heights_m[random.below(6)];
    places.push_back(round_to_lattice(p));
  }
  return places;
}

/// Every position through a function that keeps the lattice.
Tin moved(Tin tin, const std::function<Position(const Position&)>& move) {
  for (Position& p : tin.vertices) p = move(p);
  return tin;
}

enum class Source { kRandom, kReal };

class Invariants : public testing::TestWithParam<Source> {
 protected:
  void SetUp() override {
    if (grounds().empty())
      GTEST_SKIP() << "left out, shared data not found: windows of four real DEMs";
  }

  static const std::vector<Ground>& grounds() {
    static const std::vector<Ground> random = random_grounds(), real = real_grounds();
    return GetParam() == Source::kRandom ? random : real;
  }

  /// Of the ground as it is, made once.
  static const Certified& certified(const Ground& ground) {
    static std::map<std::string, Certified> made;
    const auto found = made.find(ground.name);
    if (found != made.end()) return found->second;
    return made.emplace(ground.name, certify(ground.tin)).first->second;
  }

  /// That a change of the terrain which keeps its triangles changes nothing that is seen.
  static void expect_no_change(const std::function<Position(const Position&)>& move) {
    for (const Ground& ground : grounds()) {
      SCOPED_TRACE(ground.name);
      const Tin there = moved(ground.tin, move);
      ASSERT_EQ(check_tin(there), std::nullopt);
      const TinIndex index(ground.tin), index_there(there);
      const Certified certified_there = certify(there);
      for (const Position& eye : places_around(ground.tin, 5, 12)) {
        const std::vector<TriangleSight> sight = judge_all(index, eye);
        ASSERT_EQ(sight, judge_all(index_there, move(eye)));
        expect_safe(certified(ground), eye, sight);
        expect_safe(certified_there, move(eye), sight);
      }
    }
  }
};

TEST_P(Invariants, EyeAndTargetSwap) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    ASSERT_EQ(check_tin(ground.tin), std::nullopt);
    const TinIndex index(ground.tin);
    const std::vector<Position> places = places_around(ground.tin, 1, 400);
    std::size_t blocked = 0;
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
      const Sight there = line_of_sight(index, places[i], places[i + 1]);
      blocked += there == Sight::kHidden;
      ASSERT_EQ(there, line_of_sight(index, places[i + 1], places[i]));
    }
    EXPECT_GT(blocked, 50U);
    EXPECT_LT(blocked, 390U);
  }
}

TEST_P(Invariants, NoPlaceInAHiddenTriangleSeesTheEye) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const TinIndex index(ground.tin);
    std::size_t culled = 0;
    for (const Position& eye : places_around(ground.tin, 2, 25)) {
      const std::vector<TriangleSight> sight = judge_all(index, eye);
      expect_safe(certified(ground), eye, sight);
      for (TriangleIndex t = 0; t < sight.size(); ++t) {
        const GroupIndex group = certified(ground).groups.group_of_triangle[t];
        const bool is_culled = hides_group(certified(ground).regions, group, eye);
        culled += is_culled;
        const auto& [a, b, c] = ground.tin.triangles[t];
        const Position &p = ground.tin.vertices[a], &q = ground.tin.vertices[b],
                       &r = ground.tin.vertices[c];
        const Position inside{(p.x_m + q.x_m) / 4 + r.x_m / 2, (p.y_m + q.y_m) / 4 + r.y_m / 2,
                              (p.z_m + q.z_m) / 4 + r.z_m / 2};
        const bool blocked = is_blocked(index, inside, eye);
        ASSERT_TRUE(blocked || (!is_culled && is_visible(sight[t]))) << "triangle " << t;
        ASSERT_EQ(blocked, is_blocked(index, eye, inside)) << "triangle " << t;
      }
    }
    EXPECT_GT(culled, 100U);
  }
}

TEST_P(Invariants, SearchFindsNoFalseCull) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const AdversarialReport report = adversarial_check(
        ground.tin, certified(ground).groups.group_of_triangle, certified(ground).regions, 11, 100);
    EXPECT_EQ(report.false_culls, 0U);
    EXPECT_GT(report.cameras, 100U);
  }
}

TEST_P(Invariants, RaisedEyeLosesNothing) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const TinIndex index(ground.tin);
    const Certified& regions = certified(ground);
    for (const Position& low : places_around(ground.tin, 3, 12)) {
      std::vector<TriangleSight> before = judge_all(index, low);
      for (const double rise_m : {kLatticeStepM, 1.0, 25.0, 400.0}) {
        const Position eye{low.x_m, low.y_m, low.z_m + rise_m};
        const std::vector<TriangleSight> after = judge_all(index, eye);
        for (std::size_t t = 0; t < after.size(); ++t)
          ASSERT_TRUE(is_visible(after[t]) || !is_visible(before[t])) << "triangle " << t;
        for (GroupIndex g = 0; g < regions.groups.count; ++g)
          ASSERT_TRUE(hides_group(regions.regions, g, low) ||
                      !hides_group(regions.regions, g, eye));
        expect_safe(regions, eye, after);
        before = after;
      }
    }
  }
}

TEST_P(Invariants, RaisedTargetIsNotLost) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const TinIndex index(ground.tin);
    const std::vector<Position> places = places_around(ground.tin, 4, 300);
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
      Position target = places[i + 1];
      bool was_blocked = true;
      for (const double rise_m : {0.0, kLatticeStepM, 3.0, 100.0}) {
        target.z_m += rise_m;
        const bool blocked = is_blocked(index, places[i], target);
        ASSERT_TRUE(was_blocked || !blocked);
        was_blocked = blocked;
      }
    }
  }
}

/// Slopes of the ground's horizon around an eye, one for each of some directions.
std::vector<double> horizon_slopes(const TinIndex& index, const Position& eye) {
  constexpr int kDirections = 24;
  std::vector<double> slopes;
  for (int i = 0; i < kDirections; ++i) {
    const Position end = ray_end(eye, 0.1 + 2 * std::numbers::pi * i / kDirections, 1e5);
    const auto horizon = ray_horizon(eye, end, ground_along(index, eye, end));
    slopes.push_back(horizon
                         ? (horizon->place.z_m - eye.z_m) / std::hypot(horizon->place.x_m - eye.x_m,
                                                                       horizon->place.y_m - eye.y_m)
                         : -HUGE_VAL);
  }
  return slopes;
}

/// Slopes of the horizons that stewart finds, with one subsector in each sector.
std::vector<double> stewart_slopes(const Tin& tin) {
  const SectorLayout layout{16, 1};
  const HorizonTable table = stewart_horizons(tin.vertices, layout, {});
  std::vector<double> slopes;
  for (VertexIndex v = 0; v < tin.vertices.size(); ++v)
    for (std::int32_t s = 0; s < layout.count; ++s) {
      const VertexIndex h = table.at(v, s);
      const SectorAxis axis = sector_axis(layout, s);
      const Position& from = tin.vertices[v];
      const Position& to = tin.vertices[h == kNone ? v : h];
      slopes.push_back(h == kNone ? -HUGE_VAL
                                  : (to.z_m - from.z_m) / (axis.x * (to.x_m - from.x_m) +
                                                           axis.y * (to.y_m - from.y_m)));
    }
  return slopes;
}

bool falls(double before, double after) {
  return after < before - std::abs(before) * kSlopeRounding;
}

TEST_P(Invariants, RaisedGroundLowersNoHorizon) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    SplitMix64 random(6);
    const auto raised = static_cast<VertexIndex>(random.below(ground.tin.vertices.size()));
    Tin higher = ground.tin;
    higher.vertices[raised].z_m += 128;
    const TinIndex index(ground.tin), index_higher(higher);
    const Certified certified_higher = certify(higher);
    const std::vector<double> before = stewart_slopes(ground.tin), after = stewart_slopes(higher);
    for (std::size_t i = 0; i < before.size(); ++i)
      ASSERT_TRUE(i / 16 == raised || !falls(before[i], after[i])) << "vertex " << i / 16;
    const std::vector<Position> places = places_around(ground.tin, 7, 40);
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
      const Position& eye = places[i];
      ASSERT_TRUE(!is_blocked(index, eye, places[i + 1]) ||
                  is_blocked(index_higher, eye, places[i + 1]));
      const auto height_m = index.ground_height_m(eye.x_m, eye.y_m);
      if (height_m != index_higher.ground_height_m(eye.x_m, eye.y_m)) continue;
      const std::vector<double> low = horizon_slopes(index, eye),
                                high = horizon_slopes(index_higher, eye);
      for (std::size_t k = 0; k < low.size(); ++k) ASSERT_FALSE(falls(low[k], high[k]));
      expect_safe(certified_higher, eye, judge_all(index_higher, eye));
    }
  }
}

TEST_P(Invariants, AddedTerrainRevealsNothing) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    // What is added: a strip at the western end, and a patch in the middle.
    const Bounds bounds = bounds_of(ground.tin.vertices);
    const double width_m = bounds.high.x_m - bounds.low.x_m;
    Tin part;
    std::vector<TriangleIndex> kept;
    std::vector<VertexIndex> vertex(ground.tin.vertices.size(), kNone);
    for (TriangleIndex t = 0; t < ground.tin.triangles.size(); ++t) {
      const Position& p = ground.tin.vertices[ground.tin.triangles[t][0]];
      const double share = (p.x_m - bounds.low.x_m) / width_m;
      const double share_y = (p.y_m - bounds.low.y_m) / (bounds.high.y_m - bounds.low.y_m);
      if (share < 0.2 || (std::abs(share - 0.55) < 0.1 && std::abs(share_y - 0.5) < 0.2)) continue;
      kept.push_back(t);
      part.triangles.push_back(ground.tin.triangles[t]);
      for (VertexIndex& v : part.triangles.back()) {
        if (vertex[v] == kNone) {
          vertex[v] = static_cast<VertexIndex>(part.vertices.size());
          part.vertices.push_back(ground.tin.vertices[v]);
        }
        v = vertex[v];
      }
    }
    connect_neighbours(part);
    ASSERT_EQ(check_tin(part), std::nullopt);
    ASSERT_LT(kept.size(), ground.tin.triangles.size());
    const TinIndex index(ground.tin), index_part(part);
    const Certified certified_part = certify(part);
    for (const Position& eye : places_around(ground.tin, 8, 20)) {
      const std::vector<TriangleSight> before = judge_all(index_part, eye);
      const std::vector<TriangleSight> after = judge_all(index, eye);
      for (std::size_t i = 0; i < kept.size(); ++i)
        ASSERT_TRUE(is_visible(before[i]) || !is_visible(after[kept[i]])) << "triangle " << i;
      expect_safe(certified_part, eye, before);
      expect_safe(certified(ground), eye, after);
    }
  }
}

TEST_P(Invariants, QuarterTurnsChangeNothing) {
  expect_no_change([](const Position& p) { return Position{-p.y_m, p.x_m, p.z_m}; });
}

TEST_P(Invariants, ShiftsChangeNothing) {
  expect_no_change([](const Position& p) {
    return Position{p.x_m + 4'321'987.25, p.y_m - 5'678'901.5 + kLatticeStepM, p.z_m - 987.75};
  });
}

TEST_P(Invariants, ScalingChangesNothing) {
  // Powers of two keep the lattice.
  expect_no_change([](const Position& p) { return Position{p.x_m * 8, p.y_m * 8, p.z_m * 8}; });
}

TEST_P(Invariants, HeightsAloneMayBeScaled) {
  // Sight lines stay straight when heights are doubled.
  expect_no_change([](const Position& p) { return Position{p.x_m, p.y_m, p.z_m * 8}; });
}

/// Every triangle in four through the middles of its edges, the last one the middle one; children
/// of triangle t are 4 t to 4 t + 3.
Tin split_in_four(const Tin& tin) {
  Tin fine;
  fine.vertices = tin.vertices;
  std::map<std::pair<VertexIndex, VertexIndex>, VertexIndex> middles;
  const auto middle = [&](VertexIndex a, VertexIndex b) {
    const auto [at, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<VertexIndex>(fine.vertices.size()));
    if (is_new) {
      const Position &p = tin.vertices[a], &q = tin.vertices[b];
      fine.vertices.push_back({(p.x_m + q.x_m) / 2, (p.y_m + q.y_m) / 2, (p.z_m + q.z_m) / 2});
    }
    return at->second;
  };
  for (const auto& [a, b, c] : tin.triangles) {
    const VertexIndex ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.push_back({a, ab, ca});
    fine.triangles.push_back({ab, b, bc});
    fine.triangles.push_back({ca, bc, c});
    fine.triangles.push_back({ab, bc, ca});
  }
  connect_neighbours(fine);
  return fine;
}

TEST_P(Invariants, SplittingTrianglesInTheirPlanesChangesNothing) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const Tin fine = split_in_four(ground.tin);
    ASSERT_EQ(check_tin(fine), std::nullopt);
    const TinIndex index(ground.tin), index_fine(fine);
    LeafGroups groups = certified(ground).groups;
    std::vector<GroupIndex> group_of_fine;
    for (const GroupIndex group : groups.group_of_triangle)
      group_of_fine.insert(group_of_fine.end(), 4, group);
    groups.group_of_triangle = group_of_fine;
    const Certified certified_fine = certify(fine, groups);
    for (const Position& eye : places_around(ground.tin, 9, 12)) {
      const std::vector<TriangleSight> whole = judge_all(index, eye);
      const std::vector<TriangleSight> parts = judge_all(index_fine, eye);
      for (std::size_t t = 0; t < whole.size(); ++t) {
        const bool some = std::any_of(&parts[4 * t], &parts[4 * t] + 4, is_visible);
        ASSERT_EQ(some, is_visible(whole[t])) << "triangle " << t;
      }
      expect_safe(certified(ground), eye, whole);
      expect_safe(certified_fine, eye, parts);
    }
    // Along an edge the line touches the ground in new vertices, too.
    for (const auto& [a, b, c] : ground.tin.triangles)
      for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, a}})
        ASSERT_FALSE(is_blocked(index_fine, ground.tin.vertices[from], ground.tin.vertices[to]));
    const std::vector<Position> places = places_around(ground.tin, 10, 200);
    for (std::size_t i = 0; i + 1 < places.size(); ++i)
      ASSERT_EQ(line_of_sight(index, places[i], places[i + 1]),
                line_of_sight(index_fine, places[i], places[i + 1]));
  }
}

TEST_P(Invariants, NeighbourSamplesAreVisibleOnAGrid) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const GroundGrid grid(ground.grid);
    std::size_t asked = 0;
    for (std::int32_t row = 0; row < grid.rows(); ++row)
      for (std::int32_t column = 0; column < grid.columns(); ++column) {
        if (!grid.is_known(column, row)) continue;
        for (const double height_m : {0.0, 2.0}) {
          const GridSight sight(grid, grid.raised(column, row, height_m));
          for (std::int32_t r = std::max(0, row - 1); r <= std::min(grid.rows() - 1, row + 1); ++r)
            for (std::int32_t c = std::max(0, column - 1);
                 c <= std::min(grid.columns() - 1, column + 1); ++c) {
              if (!grid.is_known(c, r) || (c == column && r == row)) continue;
              ++asked;
              ASSERT_EQ(sight.judge(grid.at(c, r), c, r), Seen::kVisible)
                  << "from " << column << " " << row << " to " << c << " " << r;
            }
        }
      }
    EXPECT_GT(asked, 1000U);
  }
}

TEST_P(Invariants, TrianglesAroundAnEyeOnTheGroundAreVisible) {
  for (const Ground& ground : grounds()) {
    SCOPED_TRACE(ground.name);
    const TinIndex index(ground.tin);
    const Certified& regions = certified(ground);
    for (TriangleIndex t = 0; t < ground.tin.triangles.size(); ++t)
      for (const VertexIndex v : ground.tin.triangles[t]) {
        Position eye = ground.tin.vertices[v];
        for (const VertexIndex w : ground.tin.triangles[t])
          ASSERT_TRUE(w == v || !is_blocked(index, eye, ground.tin.vertices[w]));
        for (const double height_m : {kLatticeStepM, 2.0}) {
          eye.z_m = ground.tin.vertices[v].z_m + height_m;
          ASSERT_EQ(judge_triangle(index, eye, t), TriangleSight::kVisible);
          ASSERT_FALSE(hides_group(regions.regions, regions.groups.group_of_triangle[t], eye));
        }
      }
  }
}

INSTANTIATE_TEST_SUITE_P(Terrain, Invariants, testing::Values(Source::kRandom, Source::kReal),
                         [](const auto& of) {
                           return of.param == Source::kRandom ? "random" : "real";
                         });

}  // namespace
}  // namespace scarp::test
