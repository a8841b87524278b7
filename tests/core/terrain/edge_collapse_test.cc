#include "core/terrain/edge_collapse.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/terrain/occluder.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

Tin hills(std::uint64_t seed, double void_share = 0) {
  return test::triangulated(
      test::random_hills(33, 29, 10, seed, 120, seed % 3 == 0 ? 15 : 0.01, void_share), seed);
}

double area_m2(const Tin& tin) {
  double sum = 0;
  for (const auto& [a, b, c] : tin.triangles) {
    const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
    sum += ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
  }
  return sum;
}

double greatest(const CollapseHistory& history, double Collapse::*bound_m) {
  double most = 0;
  for (const Collapse& collapse : history.collapses) most = std::max(most, collapse.*bound_m);
  return most;
}

TEST(EdgeCollapse, EverySurfaceOnTheWayIsProperAndCoversTheSameGround) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Tin tin = hills(seed, seed % 2 == 0 ? 0.1 : 0);
    for (const double share : {0.9, 0.5, 0.1, 0.0}) {
      CollapseOptions options;
      options.triangles_left =
          static_cast<std::size_t>(share * static_cast<double>(tin.triangles.size()));
      const CollapseHistory history = collapse_edges(tin, options);
      const Tin coarse = simplified(tin, history);
      ASSERT_EQ(check_tin(coarse), std::nullopt) << "seed " << seed << ", share " << share;
      EXPECT_NEAR(area_m2(coarse), area_m2(tin), 1e-6);
      EXPECT_EQ(std::count(history.removed_by.begin(), history.removed_by.end(), kNone),
                static_cast<std::ptrdiff_t>(coarse.triangles.size()));
      if (seed % 2 == 1) {
        EXPECT_LE(coarse.triangles.size(), options.triangles_left + 40);
      }
    }
  }
}

TEST(EdgeCollapse, BoundsHoldForTheWholeSurface) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Tin tin = hills(seed);
    CollapseOptions options;
    options.triangles_left = tin.triangles.size() / 8;
    if (seed % 2 == 0) options.cost = CollapseCost::kVolume;
    options.most_above_m = 30;
    const CollapseHistory history = collapse_edges(tin, options);
    const SurfaceGap gap = measure_gap(simplified(tin, history), tin);
    EXPECT_LE(gap.above_m, greatest(history, &Collapse::above_m) + kGapRoundingM);
    EXPECT_LE(gap.below_m, greatest(history, &Collapse::below_m) + kGapRoundingM);
    EXPECT_LE(greatest(history, &Collapse::above_m), 30);
    EXPECT_GT(gap.above_m, 1) << "and they are bounds of something";
  }
}

TEST(EdgeCollapse, APlaneNeedsTwoTriangles) {
  const Tin plane = test::triangulated(
      test::grid_of(17, 17, 10, [](int c, int r) { return 3.0 * c + 2.0 * r; }), 1);
  EXPECT_EQ(simplified(plane, collapse_edges(plane, {.most_above_m = 1, .most_below_m = 1}))
                .triangles.size(),
            2U);
}

TEST(EdgeCollapse, AShrunkBorderStaysWithinTheOld) {
  for (std::uint64_t seed = 2; seed <= 12; seed += 2) {
    const Tin tin = hills(seed, 0.15);
    CollapseOptions options;
    options.cost = CollapseCost::kVolume;
    options.may_shrink = true;
    options.triangles_left = tin.triangles.size() / 10;
    Tin coarse = simplified(tin, collapse_edges(tin, options));
    ASSERT_EQ(check_tin(coarse), std::nullopt);
    for (Position& p : coarse.vertices) p.z_m -= 1000;  // only the plane counts
    EXPECT_EQ(check_under(coarse, tin), std::nullopt);
    EXPECT_LT(area_m2(coarse), area_m2(tin));
  }
}

TEST(CheckUnder, IsExactToTheLattice) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Tin tin = hills(seed);
    CollapseOptions options;
    options.triangles_left = tin.triangles.size() / 5;
    Tin coarse = simplified(tin, collapse_edges(tin, options));
    EXPECT_TRUE(check_under(coarse, tin).has_value());
    // measure_gap adds kGapRoundingM, which is four steps of the lattice.
    const double above_m = measure_gap(coarse, tin).above_m - kGapRoundingM;
    Tin under = coarse, not_quite = coarse;
    const double steps = std::ceil(above_m / kLatticeStepM - 1e-6);
    for (Position& p : under.vertices) p.z_m -= steps * kLatticeStepM;
    for (Position& p : not_quite.vertices) p.z_m -= (steps - 1) * kLatticeStepM;
    EXPECT_EQ(check_under(under, tin), std::nullopt) << "seed " << seed;
    EXPECT_TRUE(check_under(not_quite, tin).has_value()) << "seed " << seed;
  }
}

TEST(CheckUnder, SeesGroundOverVoid) {
  const SampleGrid whole = test::grid_of(9, 9, 10, [](int, int) { return 5.0; });
  SampleGrid holed = whole;
  holed.known[holed.index(4, 4)] = 0;
  const Tin upper = test::triangulated(holed);
  Tin lower = test::triangulated(whole);
  for (Position& p : lower.vertices) p.z_m = 0;
  EXPECT_TRUE(check_under(lower, upper).has_value());
  Tin same = upper;
  EXPECT_EQ(check_under(same, upper), std::nullopt) << "touching is not above";
}

}  // namespace
}  // namespace scarp
