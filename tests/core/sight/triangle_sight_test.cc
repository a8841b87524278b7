#include "core/sight/triangle_sight.h"

#include <gtest/gtest.h>
// after gtest.h, which it extends
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>

#include "core/sight/line_of_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Barycentric denominators of the sampled points. Vertices are whole metres, so that such points
/// are lattice positions, exactly in the triangle's plane.
constexpr int kSamples = 32;

Position sample(const Tin& tin, TriangleIndex triangle, int i, int j) {
  const auto& [a, b, c] = tin.triangles[triangle];
  const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
  const auto mix = [&](double u, double v, double w) {
    return (u * i + v * j + w * (kSamples - i - j)) / kSamples;
  };
  return {mix(p.x_m, q.x_m, r.x_m), mix(p.y_m, q.y_m, r.y_m), mix(p.z_m, q.z_m, r.z_m)};
}

/// Whether any of the regularly spaced interior points is visible.
bool sees_a_sample(const TinIndex& index, const Position& eye, TriangleIndex triangle) {
  for (int i = 1; i < kSamples - 1; ++i)
    for (int j = 1; i + j < kSamples; ++j)
      if (!is_blocked(index, eye, sample(index.tin(), triangle, i, j))) return true;
  return false;
}

/// An eye at a place where degenerate things happen: on vertices, edges and planes, under ground,
/// over void, outside the data, high up.
Position awkward_eye(std::mt19937_64& random, const Tin& tin) {
  const auto t = static_cast<TriangleIndex>(random() % tin.triangles.size());
  const int i = static_cast<int>(random() % 5) * 8, j = static_cast<int>(random() % 5) * 8;
  Position eye = sample(tin, t, i, std::min(j, kSamples - i));
  switch (random() % 6) {
    case 0:
      break;
    case 1:
      eye.z_m += 2;
      break;
    case 2:
      eye.z_m -= static_cast<double>(random() % 5);
      break;
    case 3:
      eye = sample(tin, t, i - 200, j + 300);
      break;  // in the plane, far from the triangle
    case 4:
      eye.x_m -= 300;
      break;
    default:
      eye.z_m += static_cast<double>(random() % 200);
  }
  return eye;
}

RC_GTEST_PROP(TriangleSight, AgreesWithSampledPoints, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(1, 1'000'000);
  const Tin tin = test::triangulated(test::random_hills(9, 8, 16, seed, 48, 4, 0.1), seed);
  RC_PRE(!tin.triangles.empty());
  const TinIndex index(tin);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 4; ++i) {
    const Position eye = awkward_eye(random, tin);
    const std::vector<TriangleSight> sights = judge_all(index, eye);
    int narrow = 0;
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
      const bool sampled = sees_a_sample(index, eye, t);
      if (sampled) RC_ASSERT(sights[t] == TriangleSight::kVisible);
      narrow += !sampled && sights[t] == TriangleSight::kVisible;
    }
    // What is visible only between the samples is a small part.
    RC_ASSERT(narrow <= 4 + static_cast<int>(tin.triangles.size() / 8));
  }
}

RC_GTEST_PROP(TriangleSight, NothingIsLostFromHigher, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(1, 1'000'000);
  const Tin tin = test::triangulated(test::random_hills(24, 20, 16, seed, 80, 1, 0.05), seed);
  RC_PRE(!tin.triangles.empty());
  const TinIndex index(tin);
  std::mt19937_64 random(seed);
  Position eye = awkward_eye(random, tin);
  std::vector<TriangleSight> lower = judge_all(index, eye);
  for (int i = 0; i < 4; ++i) {
    eye.z_m += static_cast<double>(1 + random() % 30);
    const std::vector<TriangleSight> higher = judge_all(index, eye);
    for (std::size_t t = 0; t < lower.size(); ++t)
      if (lower[t] == TriangleSight::kVisible) RC_ASSERT(higher[t] == TriangleSight::kVisible);
    lower = higher;
  }
}

/// A profile of samples 100 m apart and three rows, so triangles 4 c .. 4 c + 3 fill step c of it.
std::string profile_seen_from(const std::vector<double>& heights_m, const Position& eye) {
  // One row of cells after the other; a step is seen when any of its triangles is.
  const SampleGrid grid = test::extruded_profile(heights_m, 128, 3);
  const Tin tin = test::triangulated(grid);
  const TinIndex index(tin);
  const std::vector<TriangleSight> sights = judge_all(index, eye);
  const std::size_t steps = heights_m.size() - 1;
  std::string seen(steps, 'h');
  for (std::size_t t = 0; t < sights.size(); ++t)
    if (sights[t] == TriangleSight::kVisible) seen[t / 2 % steps] = 'v';
  return seen;
}

TEST(TriangleSight, ProfilesFromTheWest) {
  EXPECT_EQ(profile_seen_from({0, 0, 40, 0, 0, 300}, {0, 128, 2}), "vvhhv");
  EXPECT_EQ(profile_seen_from({0, 0, 40, 0, 0, 0}, {0, 128, 2}), "vvhhh");
  // A plateau from exactly its own height: all of it is touched, none of it is blocked.
  EXPECT_EQ(profile_seen_from({5, 5, 5, 5}, {0, 128, 5}), "vvv");
  EXPECT_EQ(profile_seen_from({5, 5, 5, 5}, {-999, 128, 5}), "vvv");
  EXPECT_EQ(profile_seen_from({5, 5, 5, 5}, {-999, 128, 5 - kLatticeStepM}), "hhh");
  // The far slope lies in a plane that the eye is on, a step above and a step below.
  EXPECT_EQ(profile_seen_from({0, 128, 0}, {0, 128, 256}), "vv");
  EXPECT_EQ(profile_seen_from({0, 128, 0}, {0, 128, 256 - kLatticeStepM}), "vh");
  // The line over the crest reaches exactly the far edge of the last step, which is not interior.
  EXPECT_EQ(profile_seen_from({0, 64, 0, 0, 128, 192}, {-128, 128, 0}), "vhhhh");
  EXPECT_EQ(profile_seen_from({0, 64, 0, 0, 128, 192 + kLatticeStepM}, {-128, 128, 0}), "vhhhv");
}

TEST(TriangleSight, SeenThroughAGapNarrowerThanAnySample) {
  // A wall of two halves, one lattice step apart at the bottom of a notch; the ground behind it.
  Tin tin;
  const double gap_m = kLatticeStepM;
  tin.vertices = {{0, -64, 0},     {0, 64, 0}, {64, -64, 64}, {64, 64, 64}, {64, -gap_m, 64},
                  {64, gap_m, 64}, {64, 0, 0}, {128, -64, 0}, {128, 64, 0}, {256, 0, 0}};
  tin.triangles = {{0, 2, 4}, {0, 4, 6}, {0, 6, 1}, {1, 6, 5}, {1, 5, 3}, {2, 7, 4},
                   {4, 7, 6}, {6, 7, 8}, {6, 8, 5}, {5, 8, 3}, {7, 9, 8}};
  connect_neighbours(tin);
  ASSERT_EQ(check_tin(tin), std::nullopt);
  const TinIndex index(tin);
  EXPECT_EQ(judge_triangle(index, {0, 0, 2}, 10), TriangleSight::kVisible);
  EXPECT_EQ(judge_triangle(index, {0, 0, 0}, 10), TriangleSight::kVisible);
  // Lower than the notch: its bottom hides everything behind it.
  EXPECT_EQ(judge_triangle(index, {-64, 0, -1}, 10), TriangleSight::kHidden);
  EXPECT_EQ(judge_triangle(index, {0, 100, 2}, 10), TriangleSight::kHidden);
  EXPECT_FALSE(sees_a_sample(index, {0, 5, 6}, 10));
}

TEST(TriangleSight, VoidNeverBlocks) {
  const Tin tin = test::triangulated(test::drawn_grid("0 0 ? ? 0 0\n0 0 ? ? 0 0\n0 0 ? ? 0 0", 16));
  const TinIndex index(tin);
  for (const TriangleSight sight : judge_all(index, {4, 16, 2}))
    EXPECT_EQ(sight, TriangleSight::kVisible);
  // Below the ground between the two pieces, both are seen from underneath only.
  for (const TriangleSight sight : judge_all(index, {40, 16, -2}))
    EXPECT_EQ(sight, TriangleSight::kHidden);
}

TEST(TriangleSight, SameForAnyThreadCountAndOneByOne) {
  const Tin tin = test::triangulated(test::random_hills(40, 40, 16, 7, 120, 1, 0.05), 7);
  const TinIndex index(tin);
  const Position eye{200, 300, *index.ground_height_m(200, 300) + 2};
  const Position lattice_eye = round_to_lattice(eye);
  set_thread_count(1);
  const std::vector<TriangleSight> alone = judge_all(index, lattice_eye);
  set_thread_count(5);
  EXPECT_EQ(judge_all(index, lattice_eye), alone);
  set_thread_count(0);
  for (TriangleIndex t = 0; t < tin.triangles.size(); t += 3)
    EXPECT_EQ(judge_triangle(index, lattice_eye, t), alone[t]);
}

}  // namespace
}  // namespace scarp
