#include "core/occlusion/certified/piece_targets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "core/occlusion/certified/group_edges.h"
#include "core/occlusion/splitmix64.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Far more than the rounding of places some hundred metres from the origin.
constexpr double kRoundingM = 1e-7;

/// Rough ground, a patch of it that is a group, and a fan.
struct Patch {
  Tin tin;
  std::vector<GroupIndex> group_of_triangle;
  FanView view;
  std::vector<FanCrests::Ends> ends;
  FanCrests crests;  // every vertex is a corner
  std::vector<FanEdge> borders;

  explicit Patch(SplitMix64& random)
      : tin(test::triangulated(
            test::grid_of(9, 9, 10, [&](int, int) { return 60 * random.unit(); }),
            1 + random.below(3))),
        group_of_triangle(tin.triangles.size(), kNone) {
    const double angle_rad = random.below(2) ? 7 * random.unit() : 0;
    const double stretch = random.below(2) ? 5 : 1;
    for (Position& p : tin.vertices)
      p = round_to_lattice(
          Position{std::cos(angle_rad) * p.x_m * stretch - std::sin(angle_rad) * p.y_m,
                   std::sin(angle_rad) * p.x_m * stretch + std::cos(angle_rad) * p.y_m, p.z_m});
    for (int part = 0; part < 2; ++part) {
      auto at = static_cast<TriangleIndex>(random.below(tin.triangles.size()));
      for (int step = 0; step < 12; ++step) {
        group_of_triangle[at] = 0;
        const TriangleIndex next = tin.neighbours[at][random.below(3)];
        if (next != kNone) at = next;
      }
    }
    const std::int32_t fans = 8 << random.below(3);
    view_along(
        fan_of(fans, static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(fans)))),
        tin, 40, 40, view);
    const GroupEdges edges = edges_of_groups(tin, group_of_triangle, 1);
    const auto in_fan = [&](const GroupEdges::Edge& edge) {
      return FanEdge{view.vertices[edge[0]], view.vertices[edge[1]], edge[0], edge[1]};
    };
    std::vector<VertexIndex> corners(tin.vertices.size());
    std::iota(corners.begin(), corners.end(), 0U);
    crests.place_corners(view, corners);
    for (const auto& edge : edges.crests_of(0)) ends.push_back({edge[0], edge[1]});
    crests.ends = ends;
    for (const auto& edge : edges.borders_of(0)) borders.push_back(in_fan(edge));
  }

  /// The group's ground at a place.
  std::optional<double> ground_m(double u_m, double v_m) const {
    for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
      if (group_of_triangle[t] == kNone) continue;
      double shares[3], area = 0, z_m = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const FanPlace& p = view.vertices[tin.triangles[t][(i + 1) % 3]];
        const FanPlace& q = view.vertices[tin.triangles[t][(i + 2) % 3]];
        shares[i] = (q.u_m - p.u_m) * (v_m - p.v_m) - (q.v_m - p.v_m) * (u_m - p.u_m);
        area += shares[i];
        z_m += shares[i] * view.vertices[tin.triangles[t][i]].z_m;
      }
      if (shares[0] > 0 && shares[1] > 0 && shares[2] > 0) return z_m / area;
    }
    return {};
  }
};

TEST(PieceTargets, AnyPlaneOverThePlacesIsOverAllGroundThatRaysOverThePieceComeFrom) {
  std::size_t rays = 0, planes = 0, tangential = 0;
  for (std::uint64_t seed = 0; seed < 150 && !HasFailure(); ++seed) {
    SplitMix64 random(seed);
    const Patch patch(random);
    std::vector<std::uint32_t> all(patch.crests.ends.size());
    std::iota(all.begin(), all.end(), 0U);
    PieceTargets targets;
    for (const FanEdge& border : patch.borders) {
      const double first = random.below(2) ? 0 : random.unit();
      const double last = random.below(2) ? 1 : first + (1 - first) * random.unit();
      const ExitPiece piece{between(border.a, border.b, first), between(border.a, border.b, last),
                            &border};
      const bool is_proper = is_exit(patch.view, border);
      find_targets(patch.view, piece, patch.crests, all, targets);
      for (int i = 0; i < 60; ++i) {
        const double turn_rad =
            patch.view.fan.half_rad * (random.below(3) == 0   ? -1
                                       : random.below(2) == 0 ? 1
                                                              : 2 * random.unit() - 1);
        const double du = std::cos(turn_rad), dv = std::sin(turn_rad);
        if (!((border.b.u_m - border.a.u_m) * dv - (border.b.v_m - border.a.v_m) * du < -1e-9)) {
          EXPECT_FALSE(is_proper);
          continue;
        }
        EXPECT_FALSE(is_entry(patch.view, border));
        const FanPlace over = between(piece.a, piece.b, random.unit());
        const double way_m = 100 * random.unit() * random.unit();
        const FanPlace beyond{over.u_m + way_m * du, over.v_m + way_m * dv, 0};
        EXPECT_GE(targets.beam.low.at(beyond), 0);
        EXPECT_GE(targets.beam.high.at(beyond), 0);
        const double u_m = over.u_m - way_m * du, v_m = over.v_m - way_m * dv;
        const auto z_m = patch.ground_m(u_m, v_m);
        if (!z_m) continue;
        ++rays;
        tangential += !is_proper;
        for (int k = 0; k < 8; ++k) {
          const double ahead = std::tan(3 * random.unit() - 1.5);
          const double left = std::tan(3 * random.unit() - 1.5);
          double base_m = -HUGE_VAL;
          for (std::size_t j = 0; j < targets.places.size(); ++j) {
            const FanPlace place = targets.places[j];
            base_m = std::max(base_m, place.z_m - ahead * place.u_m - left * place.v_m);
          }
          EXPECT_LE(*z_m - ahead * u_m - left * v_m, base_m + kRoundingM) << "seed " << seed;
        }
        if (!targets.plane) continue;
        ++planes;
        const SkyPlane& plane = *targets.plane;
        EXPECT_LE(*z_m, plane.height_m + plane.ahead * (u_m - plane.u_m) +
                            plane.left * (v_m - plane.v_m) + kRoundingM)
            << "seed " << seed;
      }
    }
  }
  EXPECT_GT(rays, 20'000U);
  EXPECT_GT(planes, 10'000U);
  EXPECT_GT(tangential, 2'000U);
}

}  // namespace
}  // namespace scarp
