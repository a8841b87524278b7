#include "core/viewshed/tin_viewshed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/threads/parallel_for.h"
#include "tests/core/viewshed/random_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

using test::Relief;

/// Samples of a ground, as test::triangulated takes them.
SampleGrid samples_of(const GroundGrid& ground) {
  SampleGrid samples;
  samples.columns = ground.columns();
  samples.rows = ground.rows();
  for (std::int32_t r = 0; r < ground.rows(); ++r) {
    for (std::int32_t c = 0; c < ground.columns(); ++c) {
      samples.positions.push_back(ground.at(c, r));
      samples.known.push_back(ground.is_known(c, r));
    }
  }
  return samples;
}

/// Samples over a mesh, most of them between its vertices, some beside it.
GroundGrid samples_over(const TinIndex& index, std::int32_t columns, std::int32_t rows) {
  const Bounds bounds = bounds_of(index.tin().vertices);
  SeparablePlacement placement;
  const auto fill = [](std::vector<double>& places, double low, double high, std::int32_t count) {
    for (std::int32_t i = 0; i < count; ++i)
      places.push_back(round_to_lattice(low + (high - low) * (i - 0.5) / (count - 2)));
  };
  fill(placement.x_of_column_m, bounds.low.x_m, bounds.high.x_m, columns);
  fill(placement.y_of_row_m, bounds.high.y_m, bounds.low.y_m, rows);
  GroundGrid samples(columns, rows, placement);
  stand_on(index, samples);
  return samples;
}

/// Eyes over vertices, between them, on the ground, under it, over void and beside the data.
std::vector<Position> eyes_over(const GroundGrid& samples) {
  std::vector<Position> eyes;
  const std::int32_t columns = samples.columns(), rows = samples.rows();
  for (const auto& [column, row, height_m] :
       {std::tuple(columns / 2, rows / 2, 2.0), std::tuple(columns / 3, rows / 4, 0.0),
        std::tuple(columns - 4, 3, 30.0), std::tuple(3, rows - 4, -4.0),
        std::tuple(columns / 4, rows - 5, 700.0)}) {
    Position eye = samples.at(column, row);
    eye.z_m += height_m;
    eyes.push_back(eye);
    eye.x_m += 7.25, eye.y_m -= 0x1p-12;
    eyes.push_back(eye);
  }
  eyes.push_back({eyes[0].x_m - 100'000, eyes[0].y_m + 31, 3000});
  return eyes;
}

/// Eyes over an enclosed void, and over the ground a hand's breadth beside its border.
std::vector<Position> eyes_at_void(const TinIndex& index) {
  std::vector<Position> eyes;
  const auto edges = index.hole_edges();
  for (std::size_t i = 0; i < edges.size(); i += 1 + edges.size() / 4) {
    const MeshEdge& edge = index.edges()[edges[i]];
    const Position& a = index.tin().vertices[edge.from];
    const Position& b = index.tin().vertices[edge.to];
    const double dx = (b.x_m - a.x_m) / 30, dy = (b.y_m - a.y_m) / 30;
    for (const double aside : {0.1, -4.0}) {  // ground lies on the left
      Position eye{(a.x_m + b.x_m) / 2 - aside * dy, (a.y_m + b.y_m) / 2 + aside * dx, 0};
      eye = round_to_lattice(eye);
      const double ground_m = index.ground_height_m(eye.x_m, eye.y_m).value_or(a.z_m + 40);
      eye.z_m = round_to_lattice(ground_m + 5);
      eyes.push_back(eye);
    }
  }
  return eyes;
}

/// Compares every sample with the judge. @return the share that the fast way left to it
double compare(const TinIndex& index, const GroundGrid& samples, const Position& eye,
               double target_m, const SampleWindow& window) {
  std::vector<Seen> fast(static_cast<std::size_t>(samples.columns() * samples.rows())),
      judged = fast;
  const std::uint64_t left = tin_viewshed(index, samples, eye, target_m, window, fast);
  judge_tin_viewshed(index, samples, eye, target_m, window, judged);
  for (std::int32_t r = window.first_row; r <= window.last_row; ++r)
    for (std::int32_t c = window.first_column; c <= window.last_column; ++c)
      EXPECT_EQ(static_cast<int>(fast[static_cast<std::size_t>(r * samples.columns() + c)]),
                static_cast<int>(judged[static_cast<std::size_t>(r * samples.columns() + c)]))
          << "column " << c << " row " << r << " target " << target_m << " eye " << eye.x_m << ' '
          << eye.y_m << ' ' << eye.z_m;
  return static_cast<double>(left) / static_cast<double>(samples.columns() * samples.rows());
}

TEST(TinViewshed, EqualsItsJudgeOnAllReliefs) {
  for (int relief = 0; relief < static_cast<int>(Relief::kCount); ++relief) {
    for (const double void_share : {0.0, 0.05}) {
      SCOPED_TRACE(testing::Message() << "relief " << relief << " void " << void_share);
      const auto seed = static_cast<std::uint32_t>(relief) + 17;
      const SampleGrid ground = samples_of(
          test::random_ground({static_cast<Relief>(relief), 34, 29, 0.4, void_share, seed}));
      const Tin tin = test::triangulated(ground, seed);
      const TinIndex index(tin);
      GroundGrid vertices(ground);
      stand_on(index, vertices);
      GroundGrid between = samples_over(index, 57, 43);
      const double target_m = relief % 2 == 0 ? 3 : -1;
      for (GroundGrid* samples : {&vertices, &between}) {
        std::vector<Position> eyes = eyes_over(*samples);
        for (const Position& eye : eyes_at_void(index)) eyes.push_back(eye);
        for (const Position& eye : eyes) {
          compare(index, *samples, eye, 0, whole_window(*samples));
          compare(index, *samples, eye, target_m, {2, 5, 9, 25});
          if (testing::Test::HasFailure()) return;
        }
      }
    }
  }
}

TEST(TinViewshed, LeavesLittleToTheJudge) {
  const SampleGrid ground = test::random_hills(60, 60, 90, 4, 400, 1 / 16.0);
  const Tin tin = test::triangulated(ground, 2);
  const TinIndex index(tin);
  const GroundGrid samples = samples_over(index, 181, 181);
  Position eye = samples.at(90, 85);
  eye.z_m += 2;
  EXPECT_LT(compare(index, samples, eye, 0, whole_window(samples)), 0.05);
  eye.z_m += 100;
  EXPECT_LT(compare(index, samples, eye, 5, whole_window(samples)), 0.05);
}

TEST(TinViewshed, SamplesStandOnTheGroundAtTheirPlace) {
  const Tin tin = test::triangulated(test::random_hills(30, 30, 50, 9, 200, 1 / 64.0, 0.05), 3);
  const TinIndex index(tin);
  const GroundGrid samples = samples_over(index, 101, 97);
  int known = 0;
  for (std::int32_t r = 0; r < samples.rows(); ++r) {
    for (std::int32_t c = 0; c < samples.columns(); ++c) {
      const Position at = samples.at(c, r);
      const auto ground_m = index.ground_height_m(at.x_m, at.y_m);
      ASSERT_EQ(samples.is_known(c, r), ground_m.has_value());
      if (!ground_m) continue;
      ++known;
      EXPECT_GE(index.above_ground(at), 0);
      EXPECT_LE(at.z_m - *ground_m, 2 * kLatticeStepM);
    }
  }
  EXPECT_GT(known, 5000);
}

}  // namespace
}  // namespace scarp
