#include "core/sight/line_of_sight.h"

#include <gtest/gtest.h>
// after gtest.h, which it extends
#include <rapidcheck/gtest.h>

#include <random>
#include <sstream>
#include <string>

#include "core/geodesy/predicates.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr double kStepM = kLatticeStepM;

/// A profile of samples 100 m apart, three rows wide, and lines along its middle row.
class Profile {
 public:
  explicit Profile(const std::string& heights)
      : tin_(test::triangulated(test::drawn_grid(heights + "\n" + heights + "\n" + heights, 100))),
        index_(tin_) {}

  /// One letter per sample, for targets on the ground: v visible, h hidden, ? unknown, . the eye.
  std::string seen_from(int column, double height_m) const {
    const Position eye{column * 100.0, 100, ground(column) + height_m};
    std::string seen;
    for (int c = 0; c * 100.0 <= bounds_of(tin_.vertices).high.x_m; ++c) {
      const Sight sight = line_of_sight(index_, eye, {c * 100.0, 100, ground(c)});
      seen += c == column                ? '.'
              : sight == Sight::kVisible ? 'v'
              : sight == Sight::kHidden  ? 'h'
                                         : '?';
    }
    return seen;
  }

  double ground(int column) const { return index_.ground_height_m(column * 100, 100).value_or(0); }

 private:
  Tin tin_;
  TinIndex index_;
};

TEST(LineOfSight, TwoRidges) {
  // The nearer, lower ridge hides the valley but not the summit behind it.
  EXPECT_EQ(Profile("0 0 40 0 0 300").seen_from(0, 2), ".vvhhv");
  EXPECT_EQ(Profile("0 0 40 0 0 300").seen_from(5, 2), "vvvvv.");
}

TEST(LineOfSight, TouchingIsNotBlocking) {
  // From 0 over 10 to 20: the crest is touched exactly; a step lower target is hidden.
  const Tin tin = test::triangulated(test::drawn_grid("0 10 0\n0 10 0\n0 10 0", 100));
  const TinIndex index(tin);
  const Position eye{0, 100, 0};
  EXPECT_EQ(line_of_sight(index, eye, {200, 100, 20}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, eye, {200, 100, 20 - kStepM}), Sight::kHidden);
  EXPECT_EQ(line_of_sight(index, eye, {200, 150, 20}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, eye, {200, 150, 20 - kStepM}), Sight::kHidden);
  // Along the crest, on it and a step under it.
  EXPECT_EQ(line_of_sight(index, {100, 0, 10}, {100, 200, 10}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, {100, 0, 10}, {100, 200, 10 - kStepM}), Sight::kHidden);
  EXPECT_EQ(line_of_sight(index, {100, -50, 10 - kStepM}, {100, 250, 10 - kStepM}), Sight::kHidden);
}

TEST(LineOfSight, PlateauIsSeenAlongItself) {
  EXPECT_EQ(Profile("5 5 5 5 5").seen_from(0, 0), ".vvvv");
  EXPECT_EQ(Profile("5 5 6 5 5").seen_from(0, 0), ".vvhh");
  EXPECT_EQ(Profile("-7 -5 -5 -5 -9").seen_from(3, 0), "hvv.v");
}

TEST(LineOfSight, CliffHidesItsFoot) {
  EXPECT_EQ(Profile("200 200 0 0 0 0").seen_from(0, 100), ".vhvvv");
  EXPECT_EQ(Profile("200 200 0 0 0 0").seen_from(0, 2), ".vhhhh");
  EXPECT_EQ(Profile("200 200 0 0 0 0").seen_from(2, 2), "hv.vvv");
}

TEST(LineOfSight, VoidIsUnknownOnlyBetweenGroundAndWhereNothingBlocks) {
  // A strait: its far shore is unknown, but what the mountain hides is hidden in any case. The
  // strait itself is outside the data as far as the triangles tell.
  EXPECT_EQ(Profile("0 0 ? ? 0 0 90 0 0").seen_from(0, 2), ".vvv???hh");
  const Tin tin = test::triangulated(test::drawn_grid(R"(
      0 0 0 0 0 0
      0 0 0 0 0 0
      0 0 ? 0 0 0
      0 0 0 0 0 0
      0 0 0 0 0 0)",
                                                      10));
  const TinIndex index(tin);
  // Over the hole, into it, out of it; past it; along its border.
  EXPECT_EQ(line_of_sight(index, {0, 20, 2}, {50, 20, 2}), Sight::kUnknown);
  EXPECT_EQ(line_of_sight(index, {0, 20, 2}, {20, 20, 2}), Sight::kUnknown);
  EXPECT_EQ(line_of_sight(index, {20, 20, 2}, {-70, 20, 2}), Sight::kUnknown);
  EXPECT_EQ(line_of_sight(index, {20, 20, 2}, {20, 20, 90}), Sight::kUnknown);
  EXPECT_EQ(line_of_sight(index, {0, 0, 2}, {50, 0, 2}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, {0, 30, 2}, {50, 30, 2}), Sight::kVisible);
  // From outside the data, over it, and outside it altogether.
  EXPECT_EQ(line_of_sight(index, {-90, 0, 2}, {50, 0, 0}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, {-90, 0, 2}, {90, 0, 2}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, {-90, 0, 2}, {90, 0, -2}), Sight::kHidden);
  EXPECT_EQ(line_of_sight(index, {-90, 0, 2}, {-90, 70, 2}), Sight::kVisible);
  EXPECT_EQ(line_of_sight(index, {-90, 20, 2}, {90, 20, 2}), Sight::kUnknown);
}

TEST(LineOfSight, UnderGround) {
  const Tin tin = test::triangulated(test::drawn_grid("0 0 0\n0 0 0\n0 0 0", 10));
  const TinIndex index(tin);
  for (const Position& eye : {Position{3, 4, -kStepM}, {5, 5, -kStepM}, {10, 10, -kStepM}}) {
    EXPECT_TRUE(is_blocked(index, eye, {3, 4, 50}));
    EXPECT_TRUE(is_blocked(index, {3, 4, 50}, eye));
    EXPECT_TRUE(is_blocked(index, eye, {-30, 4, 50}));
    EXPECT_TRUE(is_blocked(index, eye, eye));
  }
  // Under the border of the data: free outwards, blocked inwards, along and upwards.
  const Position at_border{0, 10, -1};
  EXPECT_FALSE(is_blocked(index, at_border, {-10, 3, 0}));
  EXPECT_TRUE(is_blocked(index, at_border, {10, 3, 50}));
  EXPECT_TRUE(is_blocked(index, at_border, {0, 30, -1}));
  EXPECT_TRUE(is_blocked(index, at_border, {0, 10, 30}));
  // Below the ground, but beside it.
  EXPECT_FALSE(is_blocked(index, {-1, 0, -9}, {-1, 20, -9}));
  EXPECT_TRUE(is_blocked(index, {-1, 0, -9}, {21, 20, -9}));
}

TEST(LineOfSight, StraightUpAndDistanceZero) {
  const Tin tin = test::triangulated(test::drawn_grid("0 8 0\n0 8 0\n0 8 0", 10));
  const TinIndex index(tin);
  for (const double x_m : {5.0, 10.0}) {
    const Position ground{x_m, 7, *index.ground_height_m(x_m, 7)};
    EXPECT_EQ(line_of_sight(index, ground, ground), Sight::kVisible);
    EXPECT_EQ(line_of_sight(index, ground, {x_m, 7, 100}), Sight::kVisible);
    EXPECT_EQ(line_of_sight(index, {x_m, 7, 100}, ground), Sight::kVisible);
    EXPECT_EQ(line_of_sight(index, {x_m, 7, 100}, {x_m, 7, -5}), Sight::kHidden);
    // Touching from below is under ground all the way.
    EXPECT_EQ(line_of_sight(index, ground, {x_m, 7, -5}), Sight::kHidden);
  }
}

TEST(LineOfSight, FirstBlockerIsTheNearestToTheFirstEnd) {
  const Tin tin = test::triangulated(test::drawn_grid("0 0 9 0 9 0\n0 0 9 0 9 0", 10));
  const TinIndex index(tin);
  const auto there = first_blocker(index, {0, 4, 1}, {50, 4, 1});
  const auto back = first_blocker(index, {50, 4, 1}, {0, 4, 1});
  ASSERT_TRUE(there && back);
  // The diagonals of the slopes stand above the line before the crests do.
  EXPECT_GT(there->fraction, 0.2);
  EXPECT_LT(there->fraction, 0.4 + 1e-12);
  EXPECT_LT(back->fraction, 0.2 + 1e-12);
  EXPECT_EQ(first_blocker(index, {0, 4, 9}, {50, 4, 9}), std::nullopt);
  EXPECT_EQ(first_blocker(index, {20, 4, 1}, {50, 4, 1})->fraction, 0);
  EXPECT_EQ(first_blocker(index, {0, 4, 9}, {20, 4, 8})->from, kNone);
}

/// A lattice position that often coincides with a vertex, lies on an edge, or on a triangle's
/// plane.
Position awkward_position(std::mt19937_64& random, const Tin& tin) {
  const auto& [a, b, c] = tin.triangles[random() % tin.triangles.size()];
  const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
  const double s = static_cast<double>(random() % 9) / 8,
               t = (1 - s) * static_cast<double>(random() % 9) / 8;
  const auto mix = [&](double u, double v, double w) { return u + s * (v - u) + t * (w - u); };
  Position at{mix(p.x_m, q.x_m, r.x_m), mix(p.y_m, q.y_m, r.y_m), mix(p.z_m, q.z_m, r.z_m)};
  if (random() % 4 == 0) at.z_m += static_cast<double>(random() % 64) - 4;
  if (random() % 16 == 0) at.x_m -= 150;
  return round_to_lattice(at);
}

RC_GTEST_PROP(LineOfSight, IsSymmetricAndNothingIsLostFromHigher, ()) {
  const auto seed = *rc::gen::inRange<std::uint64_t>(1, 1'000'000);
  const Tin tin = test::triangulated(test::random_hills(14, 11, 16, seed, 40, 4, 0.1), seed);
  RC_PRE(!tin.triangles.empty());
  const TinIndex index(tin);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 200; ++i) {
    const Position a = awkward_position(random, tin), b = awkward_position(random, tin);
    const Sight sight = line_of_sight(index, a, b);
    RC_ASSERT(line_of_sight(index, b, a) == sight);
    RC_ASSERT(first_blocker(index, a, b).has_value() == (sight == Sight::kHidden));
    Position higher = a;
    higher.z_m += static_cast<double>(random() % 20);
    if (sight == Sight::kVisible) RC_ASSERT(line_of_sight(index, higher, b) == Sight::kVisible);
  }
}

TEST(LineOfSight, ConeIsSeenToItsTangents) {
  // From far away at the foot's height, the flank is seen as far round as the tangent touches.
  const Tin tin = test::triangulated(test::cone(65, 65, 16, 256, 0.5));
  const TinIndex index(tin);
  const Position eye{-4096, 512, 0};
  const Position top{512, 512, 256};
  EXPECT_FALSE(is_blocked(index, eye, top));
  EXPECT_FALSE(is_blocked(index, eye, {256, 512, 128}));
  EXPECT_TRUE(is_blocked(index, eye, {768, 512, 128}));
  // An eye on the prolonged flank sees all of the opposite flank's line, one step under it none.
  EXPECT_FALSE(is_blocked(index, {0, 512, 512}, {768, 512, 128}));
  EXPECT_FALSE(is_blocked(index, {256, 512, 384}, {768, 512, 128}));
  EXPECT_TRUE(is_blocked(index, {256, 512, 384 - kStepM}, {768, 512, 128}));
}

/// Places along lines of whole steps, so that each is a lattice position and triangle_at judges it.
TEST(LineOfSight, VoidBetweenGroundIsUnknownAndNothingElseIs) {
  std::mt19937_64 random(5);
  int with_void = 0, without = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Tin tin = test::triangulated(test::random_hills(14, 11, 8, seed, 1, 1, 0.2), seed);
    const TinIndex index(tin);
    const Bounds bounds = bounds_of(tin.vertices);
    for (int line = 0; line < 400; ++line) {
      // From above everything, so that nothing blocks; steps of 1/16 m, 512 of them.
      constexpr int kSteps = 512;
      const auto pick = [&](double low, double high) {
        return std::floor(low + (high - low) * static_cast<double>(random() % 1000) / 1000);
      };
      const Position a{pick(bounds.low.x_m, bounds.high.x_m), pick(bounds.low.y_m, bounds.high.y_m),
                       100};
      const double dx = static_cast<double>(static_cast<int>(random() % 7) - 3) / 16;
      const double dy = static_cast<double>(static_cast<int>(random() % 7) - 3) / 16;
      if (dx == 0 && dy == 0) continue;
      const Position b{a.x_m + kSteps * dx, a.y_m + kSteps * dy, 100};
      int changes = 0;  // ground, void, ground is two
      bool was_ground = false;
      bool touches = false;  // places on the border: what lies just beside them is not sampled
      for (int i = 0; i <= kSteps; ++i) {
        const double x_m = a.x_m + i * dx, y_m = a.y_m + i * dy;
        const bool ground = index.triangle_at(x_m, y_m) != kNone;
        changes += ground != was_ground && !(changes == 0 && !ground);
        was_ground = ground;
        for (const MeshEdge& edge : index.edges()) {
          const Position &u = tin.vertices[edge.from], &v = tin.vertices[edge.to];
          touches |= edge.is_border() && orient2d(u, v, {x_m, y_m, 0}) == 0 &&
                     x_m >= std::min(u.x_m, v.x_m) && x_m <= std::max(u.x_m, v.x_m) &&
                     y_m >= std::min(u.y_m, v.y_m) && y_m <= std::max(u.y_m, v.y_m);
        }
      }
      const bool void_between = changes >= 3 || (changes == 2 && was_ground);
      const Sight sight = line_of_sight(index, a, b);
      if (void_between) {
        EXPECT_EQ(sight, Sight::kUnknown) << "seed " << seed << " line " << line;
        ++with_void;
      } else if (!touches && index.triangle_at(a.x_m, a.y_m) != kNone &&
                 index.triangle_at(b.x_m, b.y_m) != kNone) {
        EXPECT_EQ(sight, Sight::kVisible) << "seed " << seed << " line " << line;
        ++without;
      }
    }
  }
  EXPECT_GT(with_void, 100);
  EXPECT_GT(without, 20);
}

}  // namespace
}  // namespace scarp
