#include "tiles/culling/least_heights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/sight/tin_index.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Ground at random places is nowhere under the height of its cell, and a cell with a height has
/// ground all over.
TEST(LeastHeights, AreNowhereAboveTheGround) {
  for (const double cell_m : {3.7, 9.0, 16.0}) {
    const Tin tin = test::triangulated(test::random_hills(30, 26, 10, 8, 200, 0.01, 0.1), 4);
    const TinIndex index(tin);
    const LeastHeights least = least_heights(tin, cell_m);
    std::mt19937_64 random(6);
    const auto part = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    double gap_m = 0;
    std::size_t known = 0, over = 0;
    for (std::int32_t row = 0; row < least.rows; ++row)
      for (std::int32_t column = 0; column < least.columns; ++column) {
        const auto height_m = static_cast<double>(least.height_m[least.at(column, row)]);
        for (int i = 0; i < 30; ++i) {
          const double x_m =
              round_to_lattice((least.first_column + column + part()) * least.cell_m);
          const double y_m = round_to_lattice((least.first_row + row + part()) * least.cell_m);
          const auto ground_m = index.ground_height_m(x_m, y_m);
          over += ground_m.has_value();
          if (!std::isfinite(height_m)) continue;
          ++known;
          ASSERT_TRUE(ground_m) << column << ' ' << row;
          ASSERT_GE(*ground_m, height_m) << column << ' ' << row;
          gap_m += *ground_m - height_m;
        }
      }
    EXPECT_GT(known, over / 8);
    EXPECT_LT(gap_m / static_cast<double>(known), cell_m * 2.5);
  }
}

TEST(LeastHeights, OfAPlaneAreItsLowestCorners) {
  // z = x / 2 over 8 x 8 cells of 10 m.
  const Tin tin = test::triangulated(
      test::grid_of(9, 9, 10, [](std::int32_t column, std::int32_t) { return column * 5.0; }), 0);
  const LeastHeights least = least_heights(tin, 20);
  for (std::int32_t column = 1; column < 3; ++column)
    EXPECT_NEAR(static_cast<double>(
                    least.height_m[least.at(column - least.first_column, 1 - least.first_row)]),
                column * 10.0, 0.02);
}

}  // namespace
}  // namespace scarp
