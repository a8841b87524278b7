#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>

#include "core/geodesy/predicates.h"
#include "core/sight/line_of_sight.h"
#include "core/sight/triangle_sight.h"
#include "tests/judge/dem_window.h"
#include "tests/judge/sight_twin.h"
#include "tests/support/shared_data.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Sight lines per terrain. SCARP_PROVE_LINES sets their number over all three; the full proof is a
/// million.
std::size_t lines_per_terrain() {
  const char* asked = std::getenv("SCARP_PROVE_LINES");
  return (asked ? std::stoul(asked) : 20'000) / 3;
}

double unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

struct Line {
  Position a, b;
};

/// Sight lines over a TIN: two thirds as they come, one third made to touch something exactly or
/// to miss it by one lattice step.
class Lines {
 public:
  Lines(const Tin& tin, std::uint64_t seed)
      : tin_(tin), bounds_(bounds_of(tin.vertices)), random_(seed) {}

  Line next() {
    Line line = ++count_ % 3 == 0 ? touching() : plain();
    return {round_to_lattice(line.a), round_to_lattice(line.b)};
  }

 private:
  std::int64_t whole(std::int64_t low, std::int64_t high) {
    return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
  }
  const Position& vertex() { return tin_.vertices[random_() % tin_.vertices.size()]; }

  /// p + i u + j v with whole i, j: exact on the lattice.
  static Position combination(const Position& p, const Position& q, std::int64_t i,
                              const Position& r, std::int64_t j) {
    const auto mix = [&](double at_p, double at_q, double at_r) {
      return at_p + static_cast<double>(i) * (at_q - at_p) + static_cast<double>(j) * (at_r - at_p);
    };
    return {mix(p.x_m, q.x_m, r.x_m), mix(p.y_m, q.y_m, r.y_m), mix(p.z_m, q.z_m, r.z_m)};
  }

  Position anywhere() {
    const auto between = [&](double low, double high, double beyond) {
      return low + ((1 + 2 * beyond) * unit(random_) - beyond) * (high - low);
    };
    return {between(bounds_.low.x_m, bounds_.high.x_m, 0.1),
            between(bounds_.low.y_m, bounds_.high.y_m, 0.1),
            between(bounds_.low.z_m, bounds_.high.z_m, 0.3)};
  }

  Line plain() {
    Line line{vertex(), vertex()};
    if (whole(0, 3) == 0) line.a = anywhere();
    if (whole(0, 3) == 0) line.b = anywhere();
    const double heights_m[] = {0, 2, 50, 300};
    line.a.z_m += heights_m[whole(0, 3)];
    line.b.z_m += heights_m[whole(0, 1)];
    if (whole(0, 39) == 0) line.b = {line.a.x_m, line.a.y_m, line.b.z_m};  // straight up or down
    return line;
  }

  Line touching() {
    const auto& [p, q, r] = tin_.triangles[random_() % tin_.triangles.size()];
    const Position &u = tin_.vertices[p], &v = tin_.vertices[q], &w = tin_.vertices[r];
    Line line;
    switch (whole(0, 4)) {
      case 0:  // through a vertex: from somewhere near the ground to its mirror image
        line.a = round_to_lattice(near(u));
        line.b = combination(line.a, u, 2, u, 0);
        break;
      case 1:  // through the middle of an edge
        line.a = round_to_lattice(near(u));
        line.b = combination(line.a, u, 1, v, 1);
        break;
      case 2:  // within the plane of a triangle
        line.a = combination(u, v, whole(-9, 9), w, whole(-9, 9));
        line.b = combination(u, v, whole(-9, 9), w, whole(-9, 9));
        break;
      case 3:  // along an edge and beyond
        line.a = combination(u, v, whole(-5, 0), v, 0);
        line.b = combination(u, v, whole(1, 5), v, 0);
        break;
      default:  // from vertex to vertex
        line.a = u;
        line.b = whole(0, 1) == 0 ? v : vertex();
    }
    const double nudge_m = kLatticeStepM * static_cast<double>(whole(-1, 1));
    line.a.z_m += nudge_m;
    line.b.z_m += whole(0, 1) == 0 ? nudge_m : 0;
    return line;
  }

  /// A place some triangles away from p, about as high.
  Position near(const Position& p) {
    const double reach_m = 0.1 * (bounds_.high.x_m - bounds_.low.x_m);
    return {p.x_m + reach_m * (2 * unit(random_) - 1), p.y_m + reach_m * (2 * unit(random_) - 1),
            p.z_m + 0.2 * reach_m * (2 * unit(random_) - 1)};
  }

  const Tin& tin_;
  const Bounds bounds_;
  std::mt19937_64 random_;
  std::size_t count_ = 0;
};

/// A share of the grid's known samples, as an irregular mesh.
Tin scattered(const SampleGrid& grid, double share, double void_share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Position> points;
  for (std::size_t i = 0; i < grid.positions.size(); ++i)
    if (grid.known[i] != 0 && unit(random) < share) points.push_back(grid.positions[i]);
  return test::delaunay_tin(points, void_share, seed);
}

void expect_agreement(const Tin& tin, std::uint64_t seed) {
  ASSERT_EQ(check_tin(tin), std::nullopt);
  const TinIndex index(tin);
  const test::SightTwin twin(tin);
  Lines lines(tin, seed);
  const unsigned long exact_before = exact_predicate_count();
  std::size_t blocked = 0, disagreements = 0;
  const std::size_t count = lines_per_terrain();
  for (std::size_t i = 0; i < count; ++i) {
    const Line line = lines.next();
    const bool judged = is_blocked(index, line.a, line.b);
    blocked += judged;
    if (judged == twin.is_blocked(line.a, line.b)) continue;
    ++disagreements;
    ADD_FAILURE() << "line " << i << " (" << line.a.x_m << " " << line.a.y_m << " " << line.a.z_m
                  << ") - (" << line.b.x_m << " " << line.b.y_m << " " << line.b.z_m
                  << "): blocked according to the " << (judged ? "judge" : "twin") << " only";
    if (disagreements == 10) break;
  }
  ::testing::Test::RecordProperty("lines", static_cast<int>(count));
  EXPECT_EQ(disagreements, 0);
  // The lines are no mere formality: many of each answer, and many that need exact arithmetic.
  EXPECT_GT(blocked, count / 10);
  EXPECT_LT(blocked, count - count / 10);
  EXPECT_GT(exact_predicate_count() - exact_before, count / 10);
}

TEST(SightTwin, AgreesOnAGridOfMountains) {
  SCARP_SHARED_OR_SKIP(dem, "projected/bigtujunga_srtm30m_utm11.tif");
  expect_agreement(test::triangulated(test::dem_window(dem, 100, 100, 160, 160, 30), 1), 1);
}

TEST(SightTwin, AgreesOnAnIrregularMesh) {
  SCARP_SHARED_OR_SKIP(dem, "projected/mandakini_srtm90_utm44.bil");
  expect_agreement(scattered(test::dem_window(dem, 50, 50, 250, 250, 90), 0.3, 0, 2), 2);
}

TEST(SightTwin, AgreesOnAMeshFullOfHoles) {
  SCARP_SHARED_OR_SKIP(dem, "projected/vinschgau_alps_250m_utm32.tif");
  expect_agreement(scattered(test::dem_window(dem, 0, 0, 200, 200, 250), 0.5, 0.05, 3), 3);
}

/// Every triangle, from eyes of all kinds.
void expect_triangle_agreement(const Tin& tin, std::uint64_t seed, int eyes) {
  ASSERT_EQ(check_tin(tin), std::nullopt);
  const TinIndex index(tin);
  const test::SightTwin twin(tin);
  Lines lines(tin, seed);
  std::size_t hidden = 0, compared = 0;
  for (int i = 0; i < eyes; ++i) {
    const Position eye = lines.next().a;
    const std::vector<TriangleSight> sights = judge_all(index, eye);
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
      const std::optional<bool> expected = twin.is_hidden(eye, t);
      if (!expected) continue;
      ++compared;
      hidden += *expected;
      ASSERT_EQ(sights[t] == TriangleSight::kHidden, *expected)
          << "triangle " << t << " from " << eye.x_m << " " << eye.y_m << " " << eye.z_m;
    }
  }
  EXPECT_GT(compared, 200);
  EXPECT_GT(hidden, compared / 10);
  EXPECT_LT(hidden, compared - compared / 10);
}

TEST(SightTwin, AgreesOnTrianglesOfAGrid) {
  SCARP_SHARED_OR_SKIP(dem, "projected/bigtujunga_srtm30m_utm11.tif");
  expect_triangle_agreement(test::triangulated(test::dem_window(dem, 200, 150, 11, 11, 30), 4), 4,
                            6);
}

TEST(SightTwin, AgreesOnTrianglesOfAnIrregularMeshWithHoles) {
  SCARP_SHARED_OR_SKIP(dem, "projected/mandakini_srtm90_utm44.bil");
  expect_triangle_agreement(scattered(test::dem_window(dem, 280, 300, 20, 20, 90), 0.3, 0.05, 5), 5,
                            10);
}

TEST(SightTwin, AgreesOnTrianglesOfTerraces) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    expect_triangle_agreement(
        test::triangulated(test::random_hills(9, 8, 16, seed, 48, 8, 0.1), seed), seed, 4);
}

}  // namespace
}  // namespace scarp
