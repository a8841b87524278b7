#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "core/viewshed/thinned_ground.h"
#include "core/viewshed/viewshed.h"

namespace scarp {
namespace {

constexpr std::int32_t kSide = 96;
constexpr double kCellM = 30;

/// Waves of several lengths, from a seed.
GroundGrid waves(std::uint32_t seed) {
  SeparablePlacement placement;
  for (std::int32_t i = 0; i < kSide; ++i) {
    placement.x_of_column_m.push_back(kCellM * i);
    placement.y_of_row_m.push_back(-kCellM * i);
  }
  GroundGrid grid(kSide, kSide, placement);
  const double turn = 0.1 * (seed % 60);
  for (std::int32_t row = 0; row < kSide; ++row)
    for (std::int32_t column = 0; column < kSide; ++column)
      grid.set_z(column, row,
                 round_to_lattice(150 * std::sin(0.11 * column + turn) * std::cos(0.13 * row) +
                                  25 * std::sin(0.7 * column + 0.5 * row + turn)));
  return grid;
}

double share_different(std::span<const Seen> a, std::span<const Seen> b) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < a.size(); ++i) different += a[i] != b[i];
  return static_cast<double>(different) / static_cast<double>(a.size());
}

struct Views {
  std::vector<Seen> exact, by_bounds, thinned;
};

Views views_of(const GroundGrid& grid, const Position& eye) {
  constexpr std::size_t kSamples = std::size_t{kSide} * kSide;
  Views views{std::vector<Seen>(kSamples), std::vector<Seen>(kSamples),
              std::vector<Seen>(kSamples)};
  ViewGround ground(grid);
  view_from(ground, {}, {eye, 0, {}}, views.exact);
  ground.deciding = Deciding::kByBounds;
  view_from(ground, {}, {eye, 0, {}}, views.by_bounds);
  const ThinnedGround thin(grid, grid);
  ground.thinned = &thin;
  view_from(ground, {}, {eye, 0, {}}, views.thinned);
  return views;
}

RC_GTEST_PROP(ApproximateView, ErrsSeldomAndMoreWithFewerSamples, ()) {
  const GroundGrid grid = waves(*rc::gen::inRange<std::uint32_t>(0, 1000));
  const auto column = *rc::gen::inRange<std::int32_t>(1, kSide - 1);
  const auto row = *rc::gen::inRange<std::int32_t>(1, kSide - 1);
  const Views views = views_of(grid, grid.raised(column, row, 2));
  RC_ASSERT(share_different(views.exact, views.by_bounds) < 0.03);
  RC_ASSERT(share_different(views.exact, views.thinned) < 0.15);
}

// A thinned ground that rises above a low eye would hide everything from it.
TEST(ApproximateView, AnEyeInANarrowGorgeIsNotBuriedByThinnedGround) {
  GroundGrid grid = waves(1);
  for (std::int32_t row = 0; row < kSide; ++row) grid.set_z(31, row, -400);
  const Views views = views_of(grid, grid.raised(31, 50, 2));
  const SeenTotals thinned = count_seen(views.thinned);
  EXPECT_GT(thinned.visible, 20U);
}

TEST(ApproximateView, ThinnedSamplesAreTheSamplesTheyStandFor) {
  const GroundGrid grid = waves(7), thin = thinned(grid);
  ASSERT_EQ(thin.columns(), kSide / 2);
  for (std::int32_t row = 0; row < thin.rows(); ++row)
    for (std::int32_t column = 0; column < thin.columns(); ++column)
      ASSERT_EQ(thin.at(column, row), grid.at(2 * column, 2 * row));
}

TEST(ApproximateView, LeastHeightsAreNearTheExactOnes) {
  const GroundGrid grid = waves(3);
  const ViewshedEye eye{grid.raised(40, 30, 2), 0, {}};
  std::vector<float> exact_m(std::size_t{kSide} * kSide), guessed_m(exact_m.size());
  ViewGround ground(grid);
  heights_from(ground, {}, eye, exact_m);
  ground.deciding = Deciding::kByBounds;
  heights_from(ground, {}, eye, guessed_m);
  double sum_m = 0;
  for (std::size_t i = 0; i < exact_m.size(); ++i) {
    ASSERT_EQ(std::isnan(exact_m[i]), std::isnan(guessed_m[i]));
    if (!std::isnan(exact_m[i])) sum_m += std::abs(guessed_m[i] - exact_m[i]);
  }
  // The waves are 350 m high.
  EXPECT_LT(sum_m / static_cast<double>(exact_m.size()), 5);
}

TEST(ApproximateView, VoidStaysUnknown) {
  GroundGrid grid = waves(5);
  for (std::int32_t i = 20; i < 30; ++i) grid.set_void(i, 20);
  const Views views = views_of(grid, grid.raised(60, 60, 2));
  for (std::int32_t i = 20; i < 30; ++i) {
    const auto at = static_cast<std::size_t>(20 * kSide + i);
    EXPECT_EQ(views.by_bounds[at], Seen::kUnknown);
    EXPECT_EQ(views.thinned[at], Seen::kUnknown);
  }
}

}  // namespace
}  // namespace scarp
