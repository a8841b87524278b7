#include "core/viewshed/ground_tops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/viewshed/least_tops.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

using test::GroundRecipe;
using test::random_ground;
using test::Relief;

/// Ground with a plain corner, and voids elsewhere.
GroundGrid patchy_ground(std::int32_t columns, std::int32_t rows) {
  GroundGrid grid = random_ground({Relief::kRough, columns, rows, 0, 0, 9});
  std::mt19937 random(4);
  std::uniform_int_distribution<std::int32_t> column(columns / 2, columns - 1), row(0, rows - 1);
  for (int i = 0; i < 4; ++i) grid.set_void(column(random), row(random));
  return grid;
}

TEST(GroundTops, AreTheHighestOfEachTileAndTheRingAroundIt) {
  for (const std::int32_t columns : {16, 47, 64}) {
    const std::int32_t rows = columns + 5;
    const GroundGrid grid = patchy_ground(columns, rows);
    const GroundTops tops(grid);
    int unknown = 0;
    for (std::int32_t down = 0; down < tops.tiles_down(); ++down) {
      for (std::int32_t across = 0; across < tops.tiles_across(); ++across) {
        std::int32_t expected = std::numeric_limits<std::int32_t>::min();
        for (std::int32_t r = down * GroundTops::kSide - 1; r <= (down + 1) * GroundTops::kSide;
             ++r)
          for (std::int32_t c = across * GroundTops::kSide - 1;
               c <= (across + 1) * GroundTops::kSide; ++c)
            if (c >= 0 && r >= 0 && c < columns && r < rows)
              expected = std::max(
                  expected, grid.is_known(c, r) ? grid.row_steps(r)[c] : GroundTops::kUnknown);
        EXPECT_EQ(tops.of_tile(across, down), expected) << across << ' ' << down;
        unknown += expected == GroundTops::kUnknown ? 1 : 0;
      }
    }
    EXPECT_GT(unknown, 0);
  }
}

TEST(GroundTops, OfTwoGroundsAreTheHigherOnes) {
  const GroundGrid low = random_ground({Relief::kSmooth, 40, 40, 0, 0, 2});
  GroundGrid high = random_ground({Relief::kSmooth, 40, 40, 0, 0, 2});
  high.set_z(20, 3, 500);
  const GroundTops tops(low, high), swapped(high, low);
  EXPECT_EQ(tops.of_tile(1, 0), static_cast<std::int32_t>(500 / kLatticeStepM));
  EXPECT_EQ(swapped.of_tile(1, 0), tops.of_tile(1, 0));
}

TEST(LeastTops, FollowTheHeightsThatWereLowered) {
  const GroundGrid grid = patchy_ground(40, 33);
  LeastTops tops(grid);
  std::vector<float> least_m(40 * 33, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(tops.of_tile(0, 0), std::numeric_limits<double>::infinity());
  for (std::int32_t r = 0; r < 16; ++r)
    for (std::int32_t c = 0; c < 16; ++c) least_m[static_cast<std::size_t>(r * 40 + c)] = 7;
  tops.touch(3, 3);
  tops.renew(grid, least_m);
  double highest_m = -1e9;
  for (std::int32_t r = 0; r < 16; ++r)
    for (std::int32_t c = 0; c < 16; ++c) highest_m = std::max(highest_m, grid.at(c, r).z_m + 7);
  EXPECT_DOUBLE_EQ(tops.of_tile(0, 0), highest_m);
  // What is lowered without being touched stays as it was, which is on the safe side.
  least_m[0] = 0;
  tops.renew(grid, least_m);
  EXPECT_DOUBLE_EQ(tops.of_tile(0, 0), highest_m);
  EXPECT_EQ(tops.of_tile(1, 0), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace scarp
