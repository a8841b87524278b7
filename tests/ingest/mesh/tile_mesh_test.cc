#include "ingest/mesh/tile_mesh.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <random>

#include "tests/ingest/mesh/grids.h"
#include "tests/ingest/mesh/tiled.h"

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
  const auto below = [&](std::uint32_t count) { return static_cast<std::int32_t>(random() % count); };
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
  SampleGrid grid =
      is_bent ? bent_grid(columns, rows, 0.02, 60, height)
              : flat_grid(columns, rows, below(2) == 0 ? 10 : 30.1, below(2) == 0 ? 10 : 21.7,
                          height);
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
    EXPECT_NEAR(found.over_surface_m, level.whole.error_over_surface_m, kErrorRoundingM);
    EXPECT_NEAR(found.cell_ambiguity_m, level.whole.cell_ambiguity_m, kErrorRoundingM);
  }
}

TEST(TileMesh, AllTilesOfALevelAreOneSurfaceWithinTheError) {
  for (std::uint32_t seed = 0; seed < 400; ++seed) {
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
    if (testing::Test::HasFailure()) break;
  }
}

}  // namespace
}  // namespace scarp
