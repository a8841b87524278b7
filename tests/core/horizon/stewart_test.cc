#include "core/horizon/stewart.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/horizon/subsector.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

const SectorLayout kLayouts[] = {{8, 1},  {8, 2},  {8, 4}, {8, 8}, {16, 4},
                                 {32, 2}, {64, 1}, {5, 3}, {4, 1}};

std::vector<Position> scattered(std::size_t count, double extent_m, double relief_m,
                                Position offset, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(-extent_m, extent_m), height(0, relief_m);
  std::vector<Position> vertices;
  for (std::size_t i = 0; i < count; ++i)
    vertices.push_back(round_to_lattice(Position{
        offset.x_m + across(random), offset.y_m + across(random), offset.z_m + height(random)}));
  return vertices;
}

/// A regular grid: its rows, columns and diagonals lie exactly along subsector boundaries.
std::vector<Position> grid(std::int32_t columns, std::int32_t rows, double cell_m,
                           const std::function<double(double, double)>& height_m) {
  std::vector<Position> vertices;
  for (std::int32_t row = 0; row < rows; ++row)
    for (std::int32_t column = 0; column < columns; ++column)
      vertices.push_back(round_to_lattice(
          Position{column * cell_m, -row * cell_m, height_m(column * cell_m, -row * cell_m)}));
  return vertices;
}

void expect_same_as_exhaustive(const std::vector<Position>& vertices, const SectorLayout& layout) {
  SCOPED_TRACE(testing::Message() << vertices.size() << " vertices, " << layout.count << "/"
                                  << layout.subsectors);
  const HorizonTable fast = stewart_horizons(vertices, layout, {});
  const HorizonTable judge = stewart_horizons_exhaustive(vertices, layout, {});
  ASSERT_EQ(fast.layout, layout);
  ASSERT_EQ(check_horizons(vertices, fast).value_or(""), "");
  ASSERT_EQ(fast.horizon_vertex.size(), judge.horizon_vertex.size());
  for (std::size_t i = 0; i < fast.horizon_vertex.size(); ++i)
    ASSERT_EQ(fast.horizon_vertex[i], judge.horizon_vertex[i])
        << "vertex " << i / static_cast<std::size_t>(layout.count) << ", sector "
        << i % static_cast<std::size_t>(layout.count);
}

void expect_same_in_every_layout(const std::vector<Position>& vertices) {
  for (const SectorLayout& layout : kLayouts) expect_same_as_exhaustive(vertices, layout);
}

TEST(Stewart, ScatteredVertices) {
  expect_same_in_every_layout(scattered(500, 10'000, 800, {}, 1));
}

TEST(Stewart, CoordinatesInTheMillionsAndAtTheReach) {
  expect_same_in_every_layout(scattered(200, 3'000, 500, {5'000'000, -4'000'000, -90}, 2));
  expect_same_in_every_layout(scattered(200, kLatticeReachM, kLatticeReachM, {}, 3));
}

TEST(Stewart, VeryUnequalSpacing) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> exponent(-3, 5), sign(-1, 1);
  std::vector<Position> vertices;
  const auto coordinate = [&] {
    return std::copysign(std::pow(10, exponent(random)), sign(random));
  };
  for (int i = 0; i < 300; ++i)
    vertices.push_back(round_to_lattice(Position{coordinate(), coordinate(), coordinate() / 50}));
  expect_same_in_every_layout(vertices);
}

TEST(Stewart, GridsWithPlateaus) {
  std::mt19937_64 random(5);
  expect_same_in_every_layout(
      grid(19, 17, 30, [&](double, double) { return static_cast<double>(random() % 3); }));
  expect_same_in_every_layout(grid(16, 16, 10, [](double, double) { return 7.0; }));
  expect_same_in_every_layout(
      grid(16, 16, 30, [](double x, double y) { return 20 * std::floor((x + y) / 120); }));
}

TEST(Stewart, SlopesDomesAndBowls) {
  expect_same_in_every_layout(grid(15, 15, 10, [](double x, double y) { return x / 2 + y / 4; }));
  expect_same_in_every_layout(
      grid(15, 15, 10, [](double x, double y) { return -(x * x + y * y) / 64; }));
  expect_same_in_every_layout(
      grid(15, 15, 10, [](double x, double y) { return (x * x + y * y) / 64; }));
}

TEST(Stewart, CollinearVertices) {
  for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}, {2, 1}}) {
    std::vector<Position> vertices;
    for (int i = 0; i < 60; ++i)
      vertices.push_back({dx * 8.0 * ((i * 7) % 60), dy * 8.0 * ((i * 7) % 60),
                          static_cast<double>((i * i) % 13)});
    expect_same_in_every_layout(vertices);
  }
}

TEST(Stewart, AlmostAndExactlyCoincidentVertices) {
  std::mt19937_64 random(6);
  std::vector<Position> vertices;
  for (int cluster = 0; cluster < 6; ++cluster)
    for (int i = 0; i < 40; ++i)
      vertices.push_back(
          {static_cast<double>(random() % 4) * kLatticeStepM + 10.0 * (cluster % 3),
           static_cast<double>(random() % 4) * kLatticeStepM + 10.0 * (cluster / 3),
           static_cast<double>(random() % 4) * kLatticeStepM * (cluster % 2 ? 1 : 4096)});
  expect_same_in_every_layout(vertices);
}

TEST(Stewart, NoneOneTwoAndThreeVertices) {
  for (std::size_t count = 0; count <= 3; ++count)
    for (std::uint64_t seed = 0; seed < 5; ++seed)
      expect_same_in_every_layout(scattered(count, 100, 50, {}, seed));
}

RC_GTEST_PROP(StewartProperty, SameAsExhaustive, ()) {
  const int cells = *rc::gen::inRange(1, 12);
  const int step_bits = *rc::gen::inRange(0, 24);
  const auto coordinate = rc::gen::map(rc::gen::inRange(-cells, cells + 1), [=](int value) {
    return value * std::ldexp(kLatticeStepM, step_bits);
  });
  const auto vertices = *rc::gen::container<std::vector<Position>>(
      rc::gen::construct<Position>(coordinate, coordinate, coordinate));
  const SectorLayout layout{*rc::gen::inRange(4, 20), *rc::gen::inRange(1, 5)};
  RC_ASSERT(stewart_horizons(vertices, layout, {}).horizon_vertex ==
            stewart_horizons_exhaustive(vertices, layout, {}).horizon_vertex);
}

TEST(Stewart, SameBitsForAnyThreadCount) {
  const std::vector<Position> vertices = scattered(3000, 10'000, 800, {}, 7);
  for (const SectorLayout& layout :
       {SectorLayout{16, 4}, SectorLayout{64, 1}, SectorLayout{5, 3}}) {
    set_thread_count(1);
    const HorizonTable one = stewart_horizons(vertices, layout, {});
    for (const int threads : {2, 7}) {
      set_thread_count(threads);
      EXPECT_EQ(stewart_horizons(vertices, layout, {}).horizon_vertex, one.horizon_vertex);
    }
    set_thread_count(0);
  }
}

/// The subsectors themselves, against azimuths: inside by more than rounding is inside.
TEST(Stewart, MembershipFollowsTheAzimuth) {
  const std::vector<Position> vertices = scattered(150, 5'000, 10, {400'000, 3'800'000, 0}, 8);
  for (const SectorLayout& layout : kLayouts) {
    const std::int32_t parts = layout.count * layout.subsectors;
    const double width_rad = 2 * std::numbers::pi / parts;
    for (std::int32_t part = 0; part < parts; ++part) {
      const Subsector subsector(layout, part);
      for (const Position& p : vertices)
        for (const Position& q : vertices) {
          if (p == q) continue;
          double azimuth_rad = std::atan2(q.y_m - p.y_m, q.x_m - p.x_m) - part * width_rad;
          if (azimuth_rad < 0) azimuth_rad += 2 * std::numbers::pi;
          const double distance_m = std::hypot(q.x_m - p.x_m, q.y_m - p.y_m);
          const double margin_rad = 4 * kProjectionStepM / distance_m;
          const bool is_in = in_subsector(subsector.project(p), subsector.project(q));
          if (azimuth_rad > margin_rad && azimuth_rad < width_rad - margin_rad) {
            ASSERT_TRUE(is_in) << "part " << part << " azimuth " << azimuth_rad;
          }
          if (azimuth_rad > width_rad + margin_rad &&
              azimuth_rad < 2 * std::numbers::pi - margin_rad) {
            ASSERT_FALSE(is_in) << "part " << part << " azimuth " << azimuth_rad;
          }
        }
    }
  }
}

using Row = std::vector<VertexIndex>;

Row horizons_of_first(const std::vector<Position>& vertices, const SectorLayout& layout) {
  const HorizonTable table = stewart_horizons(vertices, layout, {});
  EXPECT_EQ(table.horizon_vertex, stewart_horizons_exhaustive(vertices, layout, {}).horizon_vertex);
  return {table.horizon_vertex.begin(), table.horizon_vertex.begin() + layout.count};
}

TEST(Stewart, SteeperWinsOverNearerAndHigher) {
  // At azimuth 20 degrees or so: slopes 0.1, 0.2, 0.15.
  const Row row =
      horizons_of_first({{0, 0, 0}, {94, 34, 10}, {188, 68, 40}, {376, 136, 60}}, {8, 1});
  EXPECT_EQ(row, (Row{2, kNone, kNone, kNone, kNone, kNone, kNone, kNone}));
}

TEST(Stewart, EquallySteepTakesTheNearestThenTheLowestIndex) {
  EXPECT_EQ(
      horizons_of_first({{0, 0, 0}, {400, 100, 40}, {200, 50, 20}, {800, 200, 80}}, {8, 1})[0], 2U);
  EXPECT_EQ(horizons_of_first({{0, 0, 0}, {400, 100, 40}, {400, 100, 40}}, {8, 1})[0], 1U);
}

TEST(Stewart, BoundariesBelongToBothSectors) {
  // East, north-east and north exactly: each lies in the sectors on its two sides.
  EXPECT_EQ(horizons_of_first({{0, 0, 0}, {300, 0, 5}}, {8, 1}),
            (Row{1, kNone, kNone, kNone, kNone, kNone, kNone, 1}));
  EXPECT_EQ(horizons_of_first({{0, 0, 0}, {300, 300, 5}}, {8, 1}),
            (Row{1, 1, kNone, kNone, kNone, kNone, kNone, kNone}));
  EXPECT_EQ(horizons_of_first({{0, 0, 0}, {0, 300, 5}}, {8, 1}),
            (Row{kNone, 1, 1, kNone, kNone, kNone, kNone, kNone}));
}

TEST(Stewart, TheLowestSubsectorIsKept) {
  // Azimuths 11 and 34 degrees, slopes about 0.4 and 0.1: one in each half of sector 0.
  const std::vector<Position> vertices = {{0, 0, 0}, {98, 19, 40}, {83, 56, 10}};
  EXPECT_EQ(horizons_of_first(vertices, {8, 1})[0], 1U);
  EXPECT_EQ(horizons_of_first(vertices, {8, 2})[0], 2U);
}

TEST(Stewart, AnEmptySubsectorLeavesNoHorizon) {
  const std::vector<Position> vertices = {{0, 0, 0}, {98, 19, 40}, {83, 56, 10}};
  EXPECT_EQ(horizons_of_first(vertices, {8, 4})[0], kNone);
}

TEST(Stewart, VerticesBelowAreAHorizonToo) {
  EXPECT_EQ(horizons_of_first({{0, 0, 500}, {98, 19, 40}, {980, 190, 10}}, {8, 1})[0], 2U);
}

TEST(Stewart, CoincidentVerticesDoNotHideEachOther) {
  EXPECT_EQ(horizons_of_first({{0, 0, 0}, {0, 0, 900}}, {8, 1}), Row(8, kNone));
}

TEST(Stewart, ProgressRisesToOne) {
  const std::vector<Position> vertices = scattered(50, 100, 10, {}, 9);
  for (const bool fast : {true, false}) {
    double last = 0;
    const Progress progress = [&](double done) {
      EXPECT_GT(done, last);
      last = done;
    };
    if (fast)
      stewart_horizons(vertices, {16, 4}, progress);
    else
      stewart_horizons_exhaustive(vertices, {16, 4}, progress);
    EXPECT_EQ(last, 1.0);
  }
}

TEST(CheckHorizons, NamesWhatIsBroken) {
  const std::vector<Position> vertices = {{0, 0, 0}, {98, 19, 40}, {83, 56, 10}};
  HorizonTable table = stewart_horizons(vertices, {8, 1}, {});
  EXPECT_EQ(check_horizons(vertices, table).value_or(""), "");
  HorizonTable broken = table;
  broken.horizon_vertex[0] = 0;  // itself
  EXPECT_NE(check_horizons(vertices, broken).value_or("").find("vertex 0, sector 0"),
            std::string::npos);
  broken.horizon_vertex[0] = 3;  // outside the span
  EXPECT_TRUE(check_horizons(vertices, broken));
  broken = table;
  broken.horizon_vertex[3] = 1;  // in another sector
  EXPECT_TRUE(check_horizons(vertices, broken));
  broken = table;
  broken.horizon_vertex.pop_back();
  EXPECT_TRUE(check_horizons(vertices, broken));
}

}  // namespace
}  // namespace scarp
