#include "core/sight/ground_along.h"

#include <gtest/gtest.h>

#include <random>

#include "core/sight/line_of_sight.h"
#include "core/viewshed/grid_sight.h"
#include "tests/core/viewshed/random_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

using test::random_ground;
using test::Relief;

/// Ends on samples, between them, and outside the data, low and high.
Position random_end(const GroundGrid& grid, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::uniform_int_distribution<std::int32_t> column(0, grid.columns() - 1),
      row(0, grid.rows() - 1);
  Position p = grid.at(column(random), row(random));
  constexpr double kHeights[] = {0, 2, 15, 60, 300, -3};
  p.z_m += kHeights[static_cast<std::size_t>(6 * unit(random)) % 6];
  const double kind = unit(random);
  if (kind < 0.3) return p;
  const double reach_m = kind < 0.8 ? 25 : 900;
  p.x_m += (unit(random) - 0.5) * reach_m;
  p.y_m += (unit(random) - 0.5) * reach_m;
  return round_to_lattice(p);
}

bool any_blocks(const GroundAlong& along) {
  return std::any_of(along.crossings.begin(), along.crossings.end(),
                     [](const GroundCrossing& c) { return c.blocks; });
}

bool any_void(const GroundAlong& along) {
  return along.void_at_end || std::any_of(along.crossings.begin(), along.crossings.end(),
                                          [](const GroundCrossing& c) { return c.void_before; });
}

void expect_same_from_both_ends(const GroundAlong& there, const GroundAlong& back) {
  ASSERT_EQ(there.crossings.size(), back.crossings.size());
  for (std::size_t i = 0; i < there.crossings.size(); ++i) {
    const GroundCrossing& c = there.crossings[i];
    const GroundCrossing& d = back.crossings[back.crossings.size() - 1 - i];
    ASSERT_EQ(compare(c.at, {d.at.after, d.at.before}), 0);
    ASSERT_NEAR(c.ground_z_m, d.ground_z_m, 1e-9);
    ASSERT_EQ(c.blocks, d.blocks);
    if (i > 0) {
      ASSERT_LT(compare(there.crossings[i - 1].at, c.at), 0);
    }
  }
}

TEST(GridGroundAlong, AgreesWithTheJudgeAndWithItselfFromTheOtherEnd) {
  int hidden = 0, unknown = 0, visible = 0;
  for (int relief = 0; relief < static_cast<int>(Relief::kCount); ++relief) {
    for (const double bend : {0.0, 1.5}) {
      for (const double void_share : {0.0, 0.08}) {
        const GroundGrid grid =
            random_ground({static_cast<Relief>(relief), 24, 20, bend, void_share, 5});
        std::mt19937 random(static_cast<std::uint32_t>(relief));
        for (int i = 0; i < 300; ++i) {
          const Position a = random_end(grid, random), b = random_end(grid, random);
          if (a.x_m == b.x_m && a.y_m == b.y_m) continue;
          const GridSight from_a(grid, a);
          const Seen sight = from_a.judge(b);
          ASSERT_EQ(sight, sight_by_every_segment(grid, a, b));
          const GroundAlong along = from_a.ground_along(b);
          ASSERT_EQ(any_blocks(along), sight == Seen::kHidden);
          if (sight != Seen::kHidden) {
            ASSERT_EQ(any_void(along), sight == Seen::kUnknown);
          }
          expect_same_from_both_ends(along, GridSight(grid, b).ground_along(a));
          ++(sight == Seen::kHidden ? hidden : sight == Seen::kUnknown ? unknown : visible);
        }
      }
    }
  }
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(unknown, 100);
  EXPECT_GT(visible, 500);
}

TEST(GridGroundAlong, CrossesColumnsAndRowsWhereTheyAre) {
  SampleGrid samples;
  samples.columns = 4;
  samples.rows = 3;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) {
      samples.positions.push_back({c * 100.0, -r * 100.0, 10.0 * c + r});
      samples.known.push_back(1);
    }
  const GroundGrid grid(samples);
  // Along row 1, and across from the corner of one cell to the middle of the next.
  const auto row = GridSight(grid, {0, -100, 50}).ground_along({300, -100, 50}).crossings;
  ASSERT_EQ(row.size(), 2U);
  EXPECT_EQ(row[0].ground_z_m, 11);
  EXPECT_EQ(row[1].ground_z_m, 21);
  EXPECT_DOUBLE_EQ(to_double(row[1].at), 2.0 / 3);
  const auto across = GridSight(grid, {0, 0, 50}).ground_along({200, -100, 50}).crossings;
  ASSERT_EQ(across.size(), 1U);
  EXPECT_EQ(across[0].ground_z_m, 10.5);
  EXPECT_FALSE(across[0].blocks);
  const auto low = GridSight(grid, {0, 0, 10.25}).ground_along({200, -100, 10.5}).crossings;
  EXPECT_TRUE(low[0].blocks);  // the line is at 10.375 there
}

TEST(TinGroundAlong, AgreesWithTheJudgeAndWithItselfFromTheOtherEnd) {
  const Tin tin = test::triangulated(test::drawn_grid(
      "0 10 40 5 0 9\n8 2 3 50 7 1\n20 30 ? ? 6 2\n0 5 ? 10 60 9\n4 4 4 8 9 0", 100));
  const TinIndex index(tin);
  std::mt19937 random(4);
  std::uniform_int_distribution<int> x(-4, 24), y(-4, 20), z(-8, 320);
  int hidden = 0, unknown = 0;
  for (int i = 0; i < 4000; ++i) {
    // On a coarse raster, so that lines often pass over vertices and along edges.
    const Position a{25.0 * x(random), 25.0 * y(random), 0.25 * z(random)};
    const Position b{25.0 * x(random), 25.0 * y(random), 0.25 * z(random)};
    if (a.x_m == b.x_m && a.y_m == b.y_m) continue;
    const GroundAlong along = ground_along(index, a, b);
    expect_same_from_both_ends(along, ground_along(index, b, a));
    const auto blocker = first_blocker(index, a, b);
    const auto first = std::find_if(along.crossings.begin(), along.crossings.end(),
                                    [](const GroundCrossing& c) { return c.blocks; });
    const bool at_an_end = blocker && blocker->from == kNone;
    if (!at_an_end) {
      ASSERT_EQ(blocker.has_value(), first != along.crossings.end());
      if (blocker) {
        ASSERT_EQ(blocker->fraction, to_double(first->at));
      }
    }
    const Sight sight = line_of_sight(index, a, b);
    if (sight == Sight::kVisible) {
      ASSERT_FALSE(any_void(along)) << i;
    }
    hidden += sight == Sight::kHidden;
    unknown += sight == Sight::kUnknown && any_void(along);
  }
  EXPECT_GT(hidden, 500);
  EXPECT_GT(unknown, 50);
}

}  // namespace
}  // namespace scarp
