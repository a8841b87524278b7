#include "ingest/mesh/plane_traits.h"

#include <gtest/gtest.h>

#include <random>

namespace scarp {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

TEST(PlaneTraits, AgreesWithCgalAtEverySizeAndOnCircles) {
  std::mt19937_64 random(3);
  int on_circle = 0;
  for (int i = 0; i < 200'000; ++i) {
    const auto reach = std::int64_t{1} << (1 + random() % 25);
    const auto coordinate = [&] {
      return static_cast<double>(
          static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(reach)));
    };
    std::array<Kernel::Point_2, 4> p;
    for (auto& q : p) q = {coordinate(), coordinate()};
    if (i % 3 == 0) {  // a rectangle turned on its corner, and one point moved by one at times
      const double ax = coordinate(), ay = coordinate();
      p[1] = {p[0].x() + ax, p[0].y() + ay};
      p[3] = {p[0].x() - ay, p[0].y() + ax};
      p[2] = {p[1].x() - ay, p[1].y() + ax + (i % 2)};
    }
    if (Kernel().orientation_2_object()(p[0], p[1], p[2]) == CGAL::COLLINEAR) continue;
    ASSERT_EQ(PlaneTraits().orientation_2_object()(p[0], p[1], p[2]),
              Kernel().orientation_2_object()(p[0], p[1], p[2]));
    const auto expected = Kernel().side_of_oriented_circle_2_object()(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(PlaneTraits().side_of_oriented_circle_2_object()(p[0], p[1], p[2], p[3]), expected);
    on_circle += expected == CGAL::ON_ORIENTED_BOUNDARY;
  }
  EXPECT_GT(on_circle, 1000);
}

}  // namespace
}  // namespace scarp
