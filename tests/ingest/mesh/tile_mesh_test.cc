#include "ingest/mesh/tile_mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>

#include "ingest/dem/dem.h"
#include "tests/ingest/mesh/grids.h"
#include "tests/ingest/mesh/tiled.h"
#include "tests/support/shared_data.h"

namespace scarp {
namespace {

using test::bent_grid;
using test::flat_grid;
using test::mesh_level;
using test::TiledLevel;

MeshOptions within(double max_error_m, MeshBound bound = MeshBound::kSurface) {
  MeshOptions options;
  options.max_error_m = max_error_m;
  options.bound = bound;
  return options;
}

/// Ground of several kinds, from smooth to rough, some of it flat, with voids.
SampleGrid random_ground(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto below = [&](std::uint32_t count) {
    return static_cast<std::int32_t>(random() % count);
  };
  const std::int32_t columns = 2 + below(40), rows = 2 + below(40);
  const int kind = below(5);
  const double rough_m = kind == 0 ? 0 : std::ldexp(1.0, below(6) - 1);
  const double wave = 0.05 + 0.1 * below(6), height_m = 10.0 * below(10);
  const auto height = [&](std::int32_t c, std::int32_t r) {
    const double noise = rough_m * double(below(64)) / 64;
    switch (kind) {
      case 1:  // a wall next to flat ground
        return c % 8 == 0 ? height_m : 0.0;
      case 2:  // rough on one side of a line
        return c > columns / 2 ? noise * 8 : 0.0;
      case 3:  // flat
        return 12.5;
      default:
        return height_m * std::sin(wave * c) * std::cos(wave * 1.3 * r) + noise;
    }
  };
  const bool is_bent = below(3) == 0;
  SampleGrid grid = is_bent ? bent_grid(columns, rows, 0.02, 60, height)
                            : flat_grid(columns, rows, below(2) == 0 ? 10 : 30.1,
                                        below(2) == 0 ? 10 : 21.7, height);
  for (int holes = below(4); holes > 0; --holes) {
    const std::int32_t c0 = below(static_cast<std::uint32_t>(columns)),
                       r0 = below(static_cast<std::uint32_t>(rows)), size = 1 + below(6);
    for (std::int32_t r = r0; r < std::min(rows, r0 + size); ++r)
      for (std::int32_t c = c0; c < std::min(columns, c0 + size); ++c)
        grid.known[grid.index(c, r)] = 0;
  }
  for (int spots = below(6); spots > 0; --spots)
    grid.known[grid.index(below(static_cast<std::uint32_t>(columns)),
                          below(static_cast<std::uint32_t>(rows)))] = 0;
  return grid;
}

void expect_sound(const TiledLevel& level, std::int32_t tile_samples, double max_error_m,
                  MeshBound bound) {
  if (level.whole.tin.triangles.empty()) {
    for (std::int32_t r = 0; r < level.grid.rows; ++r)
      for (std::int32_t c = 0; c < level.grid.columns; ++c)
        EXPECT_FALSE(level.grid.is_ground_cell(c, r));
    return;
  }
  EXPECT_EQ(check_mesh(level.grid, level.whole, tile_samples), std::nullopt);
  const MeasuredError found = measure_error(level.grid, level.whole);
  EXPECT_EQ(found.uncovered_samples, 0U);
  EXPECT_LE(found.at_samples_m, max_error_m + kErrorRoundingM);
  if (bound == MeshBound::kSurface) {
    EXPECT_LE(found.over_surface_m, max_error_m + kErrorRoundingM);
    // Where an edge between tiles bends, both tiles look at samples on either side of it.
    EXPECT_LE(level.whole.error_over_surface_m, max_error_m + kErrorRoundingM);
    EXPECT_GE(level.whole.error_over_surface_m, found.over_surface_m - kErrorRoundingM);
    EXPECT_NEAR(level.whole.error_over_surface_m, found.over_surface_m, 0.01 * max_error_m);
    EXPECT_NEAR(found.cell_ambiguity_m, level.whole.cell_ambiguity_m, kErrorRoundingM);
  }
}

void expect_sound_at_all_levels(std::uint32_t seed) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const SampleGrid raster = random_ground(seed);
  const std::int32_t tile_samples = 2 << seed % 4;
  const TileScheme scheme(raster.columns, raster.rows, tile_samples);
  const MeshBound bound = seed % 5 == 0 ? MeshBound::kSamples : MeshBound::kSurface;
  for (std::int32_t level = 0; level <= scheme.finest_level(); ++level) {
    SCOPED_TRACE("level " + std::to_string(level));
    const double max_error_m = 1.5 * scheme.stride(level);
    expect_sound(mesh_level(raster, scheme, level, within(max_error_m, bound)), tile_samples,
                 max_error_m, bound);
  }
}

TEST(TileMesh, AllTilesOfALevelAreOneSurfaceWithinTheError) {
  for (std::uint32_t seed = 0; seed < 600; ++seed) {
    expect_sound_at_all_levels(seed);
    if (testing::Test::HasFailure()) break;
  }
  // A cell beside a locked sample errs by a vertex that is missing further along the edge.
  expect_sound_at_all_levels(2706);
}

TEST(TileMesh, ARasterOfOneTileIsMeshedAsWithoutTiles) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const SampleGrid raster = random_ground(seed);
    const TileScheme scheme(raster.columns, raster.rows, 64);
    ASSERT_EQ(scheme.finest_level(), 0);
    const Mesh tile = mesh_tile(scheme, {0, 0, 0}, raster, within(1.5), {});
    if (tile.tin.triangles.empty()) continue;
    const Mesh whole = mesh_samples(raster, within(1.5), {});
    EXPECT_EQ(tile.tin.vertices, whole.tin.vertices);
    EXPECT_EQ(tile.tin.triangles, whole.tin.triangles);
    EXPECT_EQ(tile.tin.neighbours, whole.tin.neighbours);
    EXPECT_EQ(tile.sample_of_vertex, whole.sample_of_vertex);
    EXPECT_EQ(tile.error_over_surface_m, whole.error_over_surface_m);
    EXPECT_EQ(tile.lost_samples, whole.lost_samples);
  }
}

/// Greatest distance of a sample on row `row` from the edge between its neighbours there, in cells.
double stray_on_row_cells(const TiledLevel& level, std::int32_t row) {
  std::vector<std::int32_t> columns;
  for (const std::int64_t sample : level.whole.sample_of_vertex)
    if (sample / level.grid.columns == row)
      columns.push_back(static_cast<std::int32_t>(sample % level.grid.columns));
  double farthest_m = 0;
  for (std::size_t i = 0; i + 1 < columns.size(); ++i) {
    const Position &a = level.grid.at(columns[i], row), &b = level.grid.at(columns[i + 1], row);
    const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
    for (std::int32_t c = columns[i] + 1; c < columns[i + 1]; ++c) {
      const Position& p = level.grid.at(c, row);
      farthest_m = std::max(
          farthest_m, std::abs(dx * (p.y_m - a.y_m) - dy * (p.x_m - a.x_m)) / std::hypot(dx, dy));
    }
  }
  return farthest_m / std::min(level.grid.cell_x_m, level.grid.cell_y_m);
}

/// Least height of a triangle over its longest edge, as a share of what that edge bends.
double least_height_in_bends(const SampleGrid& grid, const Tin& tin) {
  double least = HUGE_VAL;
  for (const auto& corners : tin.triangles) {
    const Position &a = tin.vertices[corners[0]], &b = tin.vertices[corners[1]],
                   &c = tin.vertices[corners[2]];
    const double longest_m = std::max({std::hypot(b.x_m - a.x_m, b.y_m - a.y_m),
                                       std::hypot(c.x_m - b.x_m, c.y_m - b.y_m),
                                       std::hypot(a.x_m - c.x_m, a.y_m - c.y_m)});
    const double area_m2 = (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
    const double cells = longest_m / std::max(grid.cell_x_m, grid.cell_y_m);
    least = std::min(
        least, area_m2 / longest_m /
                   (grid.bend_cells * cells * cells * std::min(grid.cell_x_m, grid.cell_y_m)));
  }
  return least;
}

TEST(TileMesh, EdgesThatBendAreCutHoweverLooseTheError) {
  // Loose enough that heights ask for nothing: what is cut is cut because it bends.
  for (const double cell_deg : {0.002, 0.004, 0.02, 0.1}) {
    SCOPED_TRACE(cell_deg);
    const SampleGrid raster =
        bent_grid(160, 150, cell_deg, 60, [](std::int32_t, std::int32_t) { return 7.0; });
    const TileScheme scheme(raster.columns, raster.rows, 64);
    const TiledLevel level = mesh_level(raster, scheme, scheme.finest_level(), within(1e5));
    expect_sound(level, 64, 1e5, MeshBound::kSurface);
    for (const std::int32_t row : {64, 128}) {
      EXPECT_GT(stray_on_row_cells(level, row), 0);
      EXPECT_LE(stray_on_row_cells(level, row), kBorderDeviationCells);
    }
    // A chord strays by a quarter of bend times length squared, in cells.
    EXPECT_GT(least_height_in_bends(raster, level.whole.tin), 0.25);
  }
}

TEST(TileMesh, RealMountainsOfAllLevelsAreOneSurface) {
  SCARP_SHARED_OR_SKIP(path, "geographic/N27E086_everest_srtm3_voids.tif");
  // With voids, and a frame in which grid lines bend.
  const Dem dem = read_dem({path}, {}, {});
  const SampleGrid raster = test::part_of(place_samples(dem), {0, 0, 700, 500, 1});
  const TileScheme scheme(raster.columns, raster.rows, 128);
  for (std::int32_t level = 0; level <= scheme.finest_level(); ++level) {
    SCOPED_TRACE("level " + std::to_string(level));
    const double max_error_m = 20 * scheme.stride(level);
    const TiledLevel made = mesh_level(raster, scheme, level, within(max_error_m));
    expect_sound(made, 128, max_error_m, MeshBound::kSurface);
    if (level < scheme.finest_level()) continue;
    const Mesh whole = mesh_samples(raster, within(max_error_m), {});
    EXPECT_LT(double(made.whole.tin.triangles.size()), 1.03 * double(whole.tin.triangles.size()));
  }
}

TEST(TileMesh, LostSamplesAreCountedOnce) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const SampleGrid raster = random_ground(seed);
    const TileScheme scheme(raster.columns, raster.rows, 4);
    const TiledLevel level = mesh_level(raster, scheme, scheme.finest_level(), within(1.5));
    if (level.whole.tin.triangles.empty()) continue;
    EXPECT_EQ(level.whole.lost_samples, mesh_samples(raster, within(1.5), {}).lost_samples);
  }
}

TEST(TileMesh, SmoothGroundHasFewVerticesOnItsEdges) {
  const SampleGrid raster = flat_grid(257, 257, 10, 10, [](std::int32_t c, std::int32_t r) {
    return 200 * std::sin(0.02 * c) * std::cos(0.03 * r);
  });
  const TileScheme scheme(257, 257, 64);
  const TiledLevel level = mesh_level(raster, scheme, scheme.finest_level(), within(2));
  const Mesh whole = mesh_samples(raster, within(2), {});
  EXPECT_LT(level.whole.tin.triangles.size(), 1.25 * double(whole.tin.triangles.size()));
  // A plane: the corners of tiles and the samples beside them.
  const SampleGrid plane =
      flat_grid(17, 17, 10, 10, [](std::int32_t c, std::int32_t r) { return 2.0 * c - r; });
  const TileScheme quarters(17, 17, 8);
  EXPECT_EQ(mesh_level(plane, quarters, 1, within(1)).whole.tin.vertices.size(), 9U + 8U);
}

TEST(TileMesh, ATileWithoutGroundHasNoTriangle) {
  SampleGrid raster = flat_grid(9, 5, 10, 10, [](std::int32_t, std::int32_t) { return 3.0; });
  for (std::int32_t r = 0; r < 5; ++r)
    for (std::int32_t c = 4; c < 9; ++c) raster.known[raster.index(c, r)] = c == 4;
  const TileScheme scheme(9, 5, 4);
  const TiledLevel level = mesh_level(raster, scheme, 1, within(1));
  EXPECT_EQ(level.tiles.at({1, 0, 0}).tin.triangles.size(), 2U);
  const Mesh& none = level.tiles.at({1, 1, 0});
  EXPECT_TRUE(none.tin.triangles.empty() && none.tin.vertices.empty());
  EXPECT_TRUE(none.sample_of_vertex.empty());
}

}  // namespace
}  // namespace scarp
