#include "core/horizon/certified/wall.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/occlusion/splitmix64.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// How far under the planes a camera is.
constexpr double kUnderM = 1e-4;

/// Whether the line from p to q runs under an edge of the surface.
bool is_blocked(const Tin& tin, const FanView& view, const FanPlace& p, const FanPlace& q) {
  const double du = q.u_m - p.u_m, dv = q.v_m - p.v_m;
  for (const auto& corners : tin.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const FanPlace &a = view.vertices[corners[i]], &b = view.vertices[corners[(i + 1) % 3]];
      const double at_a = du * (a.v_m - p.v_m) - dv * (a.u_m - p.u_m);
      const double at_b = du * (b.v_m - p.v_m) - dv * (b.u_m - p.u_m);
      if ((at_a < 0) == (at_b < 0)) continue;
      const FanPlace over = between(a, b, at_a / (at_a - at_b));
      const double share =
          ((over.u_m - p.u_m) * du + (over.v_m - p.v_m) * dv) / (du * du + dv * dv);
      if (share > 0 && share < 1 && p.z_m + share * (q.z_m - p.z_m) < over.z_m) return true;
    }
  return false;
}

/// Rays from between four targets, over a piece that lies across the fan or aslant.
struct Scene {
  Tin tin;
  FanView view;
  FanPlace low, high;  // ends of the piece
  std::array<FanPlace, 4> targets;
  Beam beam;

  explicit Scene(SplitMix64& random)
      : tin(test::triangulated(
            test::grid_of(12, 12, 10,
                          [&](int column, int) { return column > 3 ? 50 * random.unit() : 0; }),
            1 + random.below(3))) {
    if (random.below(2) == 0)  // edges that lie along a fan
      for (Position& p : tin.vertices) p.x_m *= 4;
    const std::int32_t fans = 8 << random.below(4);
    view_along(
        fan_of(fans, static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(fans)))),
        tin, 40, 110 * random.unit(), view);
    const double way_m = 5 + 20 * random.unit(), tan_half = view.fan.tan_half;
    low = {0, 10 * random.unit() - 10, 0}, high = {0, 10 * random.unit(), 0};
    // As far aslant as all rays still cross it one way.
    if (random.below(2) == 0)
      high.u_m = (1.98 * random.unit() - 0.99) * std::min(30.0, (high.v_m - low.v_m) / tan_half);
    targets = {low,
               high,
               {low.u_m - way_m, low.v_m - way_m * tan_half, 30 * random.unit()},
               {high.u_m - way_m, high.v_m + way_m * tan_half, 30 * random.unit()}};
    const double length_m = std::hypot(high.u_m - low.u_m, high.v_m - low.v_m);
    const double nu = (high.v_m - low.v_m) / length_m, nv = -(high.u_m - low.u_m) / length_m;
    beam = {{-low.v_m - low.u_m * tan_half, tan_half, 1},
            {high.v_m - high.u_m * tan_half, tan_half, -1},
            {-nu * low.u_m - nv * low.v_m, nu, nv},
            low,
            high};
  }

  /// A place between the targets, and one on the piece that a ray from it can cross.
  std::optional<std::array<FanPlace, 2>> ray(SplitMix64& random) const {
    const FanPlace far = between(targets[2], targets[3], random.unit());
    const FanPlace near = between(low, high, random.unit());
    const FanPlace from = between(far, near, 0.99 * random.unit());
    // The ends of the piece and of the fan are where something may be missed.
    double share = random.unit();
    const double turn = (1 - 1e-9) * view.fan.tan_half * (random.below(2) ? 1 : -1);
    switch (random.below(4)) {
      case 0:
        share = random.below(2) ? 0 : 1;
        break;
      case 1: {
        const double at_low = low.v_m - from.v_m - turn * (low.u_m - from.u_m);
        const double at_high = high.v_m - from.v_m - turn * (high.u_m - from.u_m);
        share = std::clamp(at_low / (at_low - at_high), 0.0, 1.0);
        break;
      }
      default:
        break;
    }
    const FanPlace over = between(low, high, share);
    if (!(over.u_m > from.u_m) ||
        std::abs(over.v_m - from.v_m) > view.fan.tan_half * (over.u_m - from.u_m))
      return {};
    return std::array{from, over};
  }
};

/// Where cameras are beyond all edges of a wall.
double beyond_m(const std::vector<SkyPlane>& planes) {
  double most_m = -HUGE_VAL;
  for (const SkyPlane& plane : planes) most_m = std::max(most_m, plane.beyond_m);
  return most_m;
}

/// Height at a place beyond the wall that is under all of its planes, or under all of its lines.
double under_m(const std::vector<SkyPlane>& planes, const FanPlace& place, bool lines) {
  double least_m = HUGE_VAL;
  for (const SkyPlane& plane : planes)
    least_m = std::min(least_m, lines ? plane.line_m + plane.line_slope * place.u_m
                                      : plane.height_m + plane.ahead * (place.u_m - plane.u_m) +
                                            plane.left * (place.v_m - plane.v_m));
  return least_m - kUnderM;
}

TEST(Wall, HidesAllTargetsFromBeyondUnderItsPlanes) {
  std::size_t walls = 0, chains = 0, rays = 0;
  for (std::uint64_t seed = 0; seed < 1000 && !HasFailure(); ++seed) {
    SplitMix64 random(seed);
    const Scene scene(random);
    const RidgeEdges ridges = ridge_edges_of(scene.tin);
    Wall wall;
    for (std::uint32_t edge = 0; edge < ridges.edges.size(); ++edge) {
      const double slope = 4 * random.unit() - 2;
      if (!raise_wall(ridges, scene.view, scene.beam, Places(scene.targets), edge, slope, wall))
        continue;
      ++walls;
      chains += wall.planes.size() > 1;
      for (int i = 0; i < 8; ++i) {
        const auto ray = scene.ray(random);
        if (!ray) continue;
        const auto& [from, over] = *ray;
        const double u_m = beyond_m(wall.planes) +
                           std::ldexp(random.unit(), static_cast<int>(random.below(12)) - 4);
        const double share = (u_m - from.u_m) / (over.u_m - from.u_m);
        for (const bool lines : {false, true}) {
          FanPlace camera = between(from, over, share);
          camera.z_m = under_m(wall.planes, camera, lines);
          EXPECT_TRUE(is_blocked(scene.tin, scene.view, from, camera)) << "seed " << seed;
          ++rays;
        }
      }
    }
  }
  EXPECT_GT(walls, 1'000U);
  EXPECT_GT(chains, 300U);
  EXPECT_GT(rays, 5'000U);
}

TEST(Wall, HidesAllTargetsBeyondThePlanesThatARayCanComeThrough) {
  std::size_t parts = 0, nearer = 0;
  for (std::uint64_t seed = 0; seed < 1000 && !HasFailure(); ++seed) {
    SplitMix64 random(seed);
    const Scene scene(random);
    const RidgeEdges ridges = ridge_edges_of(scene.tin);
    Wall wall;
    for (std::uint32_t edge = 0; edge < ridges.edges.size(); ++edge) {
      const double slope = 4 * random.unit() - 2;
      if (!raise_wall(ridges, scene.view, scene.beam, Places(scene.targets), edge, slope, wall))
        continue;
      for (int i = 0; i < 8; ++i) {
        const auto ray = scene.ray(random);
        if (!ray) continue;
        const auto& [from, over] = *ray;
        const double turn = (over.v_m - from.v_m) / (over.u_m - from.u_m);
        std::vector<SkyPlane> met;
        for (const SkyPlane& plane : wall.planes)
          if (turn >= plane.low_turn && turn <= plane.high_turn) met.push_back(plane);
        ASSERT_FALSE(met.empty()) << "seed " << seed;
        parts += met.size() < wall.planes.size();
        nearer += beyond_m(met) < beyond_m(wall.planes);
        const double u_m = beyond_m(met) + std::ldexp(random.unit(), -4);
        for (const bool lines : {false, true}) {
          FanPlace camera = between(from, over, (u_m - from.u_m) / (over.u_m - from.u_m));
          camera.z_m = under_m(met, camera, lines);
          EXPECT_TRUE(is_blocked(scene.tin, scene.view, from, camera)) << "seed " << seed;
        }
      }
    }
  }
  EXPECT_GT(parts, 500U);
  EXPECT_GT(nearer, 100U);
}

}  // namespace
}  // namespace scarp
