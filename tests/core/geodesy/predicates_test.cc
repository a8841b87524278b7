#include "core/geodesy/predicates.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <random>

namespace scarp {
namespace {

using Exact = boost::multiprecision::int512_t;

int sign(const Exact& value) {
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}
Exact steps(double to, double from) {
  return Exact(lattice_steps(to)) - Exact(lattice_steps(from));
}

int orient2d_judge(const Position& a, const Position& b, const Position& c) {
  return sign(steps(b.x_m, a.x_m) * steps(c.y_m, a.y_m) -
              steps(b.y_m, a.y_m) * steps(c.x_m, a.x_m));
}

int orient3d_judge(const Position& a, const Position& b, const Position& c, const Position& d) {
  const Exact bx = steps(b.x_m, a.x_m), by = steps(b.y_m, a.y_m), bz = steps(b.z_m, a.z_m);
  const Exact cx = steps(c.x_m, a.x_m), cy = steps(c.y_m, a.y_m), cz = steps(c.z_m, a.z_m);
  const Exact dx = steps(d.x_m, a.x_m), dy = steps(d.y_m, a.y_m), dz = steps(d.z_m, a.z_m);
  return sign((by * cz - bz * cy) * dx + (bz * cx - bx * cz) * dy + (bx * cy - by * cx) * dz);
}

/// Positions at every scale up to the reach of the lattice, with many coincidences among them.
Position random_position(std::mt19937_64& random) {
  const int bits = static_cast<int>(random() % 40);
  const auto coordinate = [&] {
    const auto steps =
        static_cast<std::int64_t>(random() >> (63 - bits)) - (std::int64_t{1} << bits);
    return static_cast<double>(steps) * kLatticeStepM;
  };
  return {coordinate(), coordinate(), coordinate()};
}

TEST(Predicates, AgreeWithWideIntegersOnRandomPositions) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100'000; ++i) {
    const Position a = random_position(random), b = random_position(random),
                   c = random_position(random), d = random_position(random);
    ASSERT_EQ(orient2d(a, b, c), orient2d_judge(a, b, c));
    ASSERT_EQ(orient3d(a, b, c, d), orient3d_judge(a, b, c, d));
  }
}

TEST(Predicates, NearlyFlatNeedsTheExactPathAndGetsItRight) {
  std::mt19937_64 random(2);
  const unsigned long before = exact_predicate_count();
  for (int i = 0; i < 100'000; ++i) {
    const Position a = random_position(random), b = random_position(random),
                   c = random_position(random);
    // d = a + s (b - a) + t (c - a), rounded: on the plane, or a fraction of a step off it.
    const double s = static_cast<double>(random() >> 11) * 0x1p-54;
    const double t = static_cast<double>(random() >> 11) * 0x1p-54;
    const Position d =
        round_to_lattice(Position{a.x_m + s * (b.x_m - a.x_m) + t * (c.x_m - a.x_m),
                                  a.y_m + s * (b.y_m - a.y_m) + t * (c.y_m - a.y_m),
                                  a.z_m + s * (b.z_m - a.z_m) + t * (c.z_m - a.z_m)});
    ASSERT_EQ(orient3d(a, b, c, d), orient3d_judge(a, b, c, d));
    ASSERT_EQ(orient2d(a, b, d), orient2d_judge(a, b, d));
  }
  EXPECT_GT(exact_predicate_count(), before);
}

TEST(Predicates, ExtremesOfTheLatticeDoNotOverflow) {
  const double r = kLatticeReachM;
  const Position corners[] = {{-r, -r, -r}, {r, -r, r},  {r, r, -r},  {-r, r, r},
                              {r, r, r},    {-r, -r, r}, {-r, r, -r}, {r, -r, -r}};
  for (const Position& a : corners)
    for (const Position& b : corners)
      for (const Position& c : corners)
        for (const Position& d : corners)
          ASSERT_EQ(orient3d(a, b, c, d), orient3d_judge(a, b, c, d));
}

TEST(Predicates, SignsAreAsDocumented) {
  const Position a{0, 0, 0}, b{10, 0, 0}, c{0, 10, 0};
  EXPECT_EQ(orient2d(a, b, c), 1);
  EXPECT_EQ(orient2d(a, c, b), -1);
  EXPECT_EQ(orient3d(a, b, c, {3, 3, 1}), 1);
  EXPECT_EQ(orient3d(a, b, c, {3, 3, -1}), -1);
  EXPECT_EQ(orient3d(a, b, c, {30, -3, 0}), 0);
  EXPECT_EQ(above_line(a, {0, -10, -10}, {0, -5, -5}), 0);
  EXPECT_EQ(above_line(a, {0, -10, -10}, {0, -5, -4}), 1);
  EXPECT_EQ(above_line({0, -10, -10}, a, {0, -5, -4}), 1);
  EXPECT_EQ(above_line(a, b, {20, 0, -1}), -1);
}

}  // namespace
}  // namespace scarp
