#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

#include "core/threads/parallel_for.h"
#include "core/viewshed/viewshed.h"
#include "tests/core/viewshed/random_ground.h"

namespace scarp {
namespace {

using test::Relief;

constexpr std::int32_t kColumns = 40, kRows = 34;

/// What any terrain must satisfy, on all reliefs, straight and bent, with void and without.
template <typename Body>
void for_grounds(const Body& body) {
  for (int relief = 0; relief < static_cast<int>(Relief::kCount); ++relief)
    for (const double bend : {0.0, 1.2})
      for (const double void_share : {0.0, 0.06}) {
        const auto seed = static_cast<std::uint32_t>(relief + 11);
        SCOPED_TRACE(testing::Message()
                     << "relief " << relief << " bend " << bend << " void " << void_share);
        const GroundGrid grid = test::random_ground(
            {static_cast<Relief>(relief), kColumns, kRows, bend, void_share, seed});
        std::mt19937 random(seed);
        body(grid, random);
      }
}

struct Place {
  std::int32_t column, row;
};
Place known_place(const GroundGrid& grid, std::mt19937& random) {
  std::uniform_int_distribution<std::int32_t> column(1, kColumns - 2), row(1, kRows - 2);
  for (;;) {
    const Place place{column(random), row(random)};
    if (grid.is_known(place.column, place.row)) return place;
  }
}

GroundGrid copy_of(const GroundGrid& grid) {
  GroundGrid copy(kColumns, kRows, grid.placement());
  for (std::int32_t r = 0; r < kRows; ++r)
    for (std::int32_t c = 0; c < kColumns; ++c)
      if (grid.is_known(c, r)) copy.set_z(c, r, grid.at(c, r).z_m);
  return copy;
}

std::vector<Seen> seen_from(const GroundGrid& grid, const Position& eye, double target_m) {
  std::vector<Seen> seen(static_cast<std::size_t>(kColumns * kRows));
  sweep_viewshed(grid, eye, target_m, whole_window(grid), seen);
  return seen;
}

std::size_t index_of(const Place& place) {
  return static_cast<std::size_t>(place.row * kColumns + place.column);
}

TEST(ViewshedProperties, EyeAndTargetMayBeSwapped) {
  for_grounds([](const GroundGrid& grid, std::mt19937& random) {
    const double eye_m = 2, target_m = 5;
    for (int i = 0; i < 4; ++i) {
      const Place a = known_place(grid, random);
      const auto there = seen_from(grid, grid.raised(a.column, a.row, eye_m), target_m);
      for (int k = 0; k < 4; ++k) {
        const Place b = known_place(grid, random);
        const auto back = seen_from(grid, grid.raised(b.column, b.row, target_m), eye_m);
        EXPECT_EQ(there[index_of(b)], back[index_of(a)]);
      }
    }
  });
}

TEST(ViewshedProperties, HigherEyesAndTargetsLoseNothing) {
  for_grounds([](const GroundGrid& grid, std::mt19937& random) {
    const Place at = known_place(grid, random);
    const auto low = seen_from(grid, grid.raised(at.column, at.row, 1), 0);
    const auto high_eye = seen_from(grid, grid.raised(at.column, at.row, 9), 0);
    const auto high_target = seen_from(grid, grid.raised(at.column, at.row, 1), 3);
    for (std::size_t i = 0; i < low.size(); ++i) {
      if (low[i] != Seen::kVisible) continue;
      EXPECT_EQ(high_eye[i], Seen::kVisible);
      EXPECT_EQ(high_target[i], Seen::kVisible);
    }
  });
}

TEST(ViewshedProperties, HigherGroundShowsNothingThatWasHidden) {
  for_grounds([](const GroundGrid& grid, std::mt19937& random) {
    const Place at = known_place(grid, random);
    const Position eye = grid.raised(at.column, at.row, 2);
    const auto before = seen_from(grid, eye, 0);
    GroundGrid raised = copy_of(grid);
    const Place hill = known_place(grid, random);
    raised.set_z(hill.column, hill.row, grid.at(hill.column, hill.row).z_m + 30);
    const auto after = seen_from(raised, eye, 0);
    for (std::size_t i = 0; i < before.size(); ++i)
      if (before[i] == Seen::kHidden && i != index_of(hill)) {
        EXPECT_EQ(after[i], Seen::kHidden);
      }
  });
}

TEST(ViewshedProperties, NeighboursOfAnEyeOnTheGroundAreSeen) {
  for_grounds([](const GroundGrid& grid, std::mt19937& random) {
    for (int i = 0; i < 6; ++i) {
      const Place at = known_place(grid, random);
      const auto seen = seen_from(grid, grid.at(at.column, at.row), 0);
      for (const Place& next : {Place{at.column + 1, at.row}, Place{at.column - 1, at.row},
                                Place{at.column, at.row + 1}, Place{at.column, at.row - 1}}) {
        if (grid.is_known(next.column, next.row)) {
          EXPECT_EQ(seen[index_of(next)], Seen::kVisible);
        }
      }
    }
  });
}

TEST(ViewshedProperties, LeastHeightsHaveTheSameBitsForAnyThreadsAndOrder) {
  for_grounds([](const GroundGrid& grid, std::mt19937& random) {
    std::vector<ViewshedEye> eyes;
    for (int i = 0; i < 5; ++i) {
      const Place at = known_place(grid, random);
      eyes.push_back({grid.raised(at.column, at.row, 2), 0, {}});
    }
    LeastHeight forwards(grid), backwards(grid);
    set_thread_count(1);
    for (const ViewshedEye& eye : eyes) forwards.lower(grid, {}, eye);
    set_thread_count(3);
    for (std::size_t i = eyes.size(); i-- > 0;) backwards.lower(grid, {}, eyes[i]);
    set_thread_count(0);
    EXPECT_EQ(std::memcmp(forwards.heights_m().data(), backwards.heights_m().data(),
                          forwards.heights_m().size_bytes()),
              0);
  });
}

}  // namespace
}  // namespace scarp
