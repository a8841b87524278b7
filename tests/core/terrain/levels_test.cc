#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/sight/tin_index.h"
#include "core/terrain/coarse_samples.h"
#include "core/terrain/occluder.h"
#include "core/terrain/range_pyramid.h"
#include "core/terrain/weld.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

SampleGrid hills(std::uint64_t seed, std::int32_t columns = 33, std::int32_t rows = 29) {
  return test::random_hills(columns, rows, 10, seed, 120, seed % 3 == 0 ? 15 : 0.01,
                            seed % 2 == 0 ? 0.15 : 0);
}

/// The triangles of a part of a grid and the sample that each vertex is.
Occluder triangles_of(const SampleGrid& grid, std::uint64_t diagonals = 0) {
  Occluder all{test::triangulated(grid, diagonals), {}};
  // Vertices are samples; find them by their places.
  for (const Position& p : all.tin.vertices) {
    const auto found = std::find(grid.positions.begin(), grid.positions.end(), p);
    all.sample_of_vertex.push_back(found - grid.positions.begin());
  }
  return all;
}

TEST(CoarseSamples, TwiceByTwoIsByFour) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    const SampleGrid grid = hills(seed, 21 + static_cast<std::int32_t>(seed), 19);
    const SampleGrid twice = coarsened(coarsened(grid, 2), 2), once = coarsened(grid, 4);
    EXPECT_EQ(twice.columns, once.columns);
    EXPECT_EQ(twice.positions, once.positions);
    EXPECT_EQ(twice.known, once.known);
    EXPECT_EQ(twice.void_cells, once.void_cells);
    EXPECT_EQ(twice.cell_x_m, 40);
  }
}

TEST(CoarseSamples, ACellIsGroundWhereAllOfItIs) {
  SampleGrid grid = test::grid_of(9, 9, 10, [](int, int) { return 5.0; });
  grid.known[grid.index(3, 3)] = 0;  // no coarse sample
  const SampleGrid coarse = coarsened(grid, 2);
  for (std::int32_t r = 0; r < 4; ++r)
    for (std::int32_t c = 0; c < 4; ++c)
      EXPECT_EQ(coarse.is_ground_cell(c, r), !(c == 1 && r == 1)) << c << " " << r;
}

TEST(Weld, PartsOfASurfaceBecomeIt) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    const SampleGrid grid = hills(seed);
    SampleGrid left = grid, right = grid;
    for (std::int32_t r = 0; r < grid.rows; ++r) {
      for (std::int32_t c = 0; c < grid.columns; ++c) {
        if (c > 16) left.known[grid.index(c, r)] = 0;
        if (c < 16) right.known[grid.index(c, r)] = 0;
      }
    }
    const Tin one = test::triangulated(left), other = test::triangulated(right);
    const Tin whole = test::triangulated(grid);
    const std::array parts = {&one, &other};
    const Welded welded = weld(parts);
    EXPECT_EQ(check_tin(welded.tin), std::nullopt);
    EXPECT_EQ(welded.tin.vertices.size(), whole.vertices.size());
    EXPECT_EQ(welded.tin.triangles.size(), whole.triangles.size());
    const auto borders = [](const Tin& tin) {
      std::size_t count = 0;
      for (const auto& across : tin.neighbours)
        count += static_cast<std::size_t>(std::count(across.begin(), across.end(), kNone));
      return count;
    };
    EXPECT_EQ(borders(welded.tin), borders(whole));
    ASSERT_EQ(welded.vertex_of.size(), one.vertices.size() + other.vertices.size());
    for (std::size_t v = 0; v < one.vertices.size(); ++v)
      EXPECT_EQ(welded.tin.vertices[welded.vertex_of[v]], one.vertices[v]);
  }
}

TEST(Weld, OfTwoHeightsTheLowerIsKept) {
  const SampleGrid grid = test::grid_of(3, 2, 10, [](int, int) { return 5.0; });
  SampleGrid left = grid, right = grid;
  left.known[2] = left.known[5] = 0;
  right.known[0] = right.known[3] = 0;
  Tin one = test::triangulated(left), other = test::triangulated(right);
  for (Position& p : other.vertices) p.z_m = 3;
  const std::array parts = {&one, &other};
  const Tin tin = weld(parts).tin;
  for (const Position& p : tin.vertices) EXPECT_EQ(p.z_m, p.x_m < 10 ? 5 : 3);
}

/// Height of a surface at a place, exact enough, or nothing over void.
std::optional<double> height_at(const TinIndex& index, double x_m, double y_m) {
  return index.ground_height_m(x_m, y_m);
}

/// Greatest height of one surface above another at places drawn at random, and how many places of
/// the first have none of the second.
struct Sampled {
  double above_m = -HUGE_VAL, below_m = -HUGE_VAL;
  int over_void = 0;
};

Sampled sample_gap(const Tin& coarse, const Tin& finer, std::uint64_t seed) {
  const TinIndex upper(coarse), lower(finer);
  const Bounds bounds = bounds_of(coarse.vertices);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Sampled sampled;
  const auto look = [&](double x_m, double y_m) {
    const auto z_m = height_at(upper, x_m, y_m);
    if (!z_m) return;
    const auto below_m = height_at(lower, x_m, y_m);
    if (!below_m) {
      ++sampled.over_void;
      return;
    }
    sampled.above_m = std::max(sampled.above_m, *z_m - *below_m);
    sampled.below_m = std::max(sampled.below_m, *below_m - *z_m);
  };
  for (int i = 0; i < 4000; ++i)
    look(round_to_lattice(bounds.low.x_m + unit() * (bounds.high.x_m - bounds.low.x_m)),
         round_to_lattice(bounds.low.y_m + unit() * (bounds.high.y_m - bounds.low.y_m)));
  for (const Position& p : finer.vertices) look(p.x_m, p.y_m);
  for (const Position& p : coarse.vertices) look(p.x_m, p.y_m);
  // Where edges of both cross.
  const auto visit_edges = [](const Tin& tin, auto visit) {
    for (const auto& [a, b, c] : tin.triangles)
      for (const auto& [p, q] : {std::pair{a, b}, {b, c}, {c, a}})
        visit(tin.vertices[p], tin.vertices[q]);
  };
  visit_edges(coarse, [&](const Position& a, const Position& b) {
    visit_edges(finer, [&](const Position& p, const Position& q) {
      const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
      const double at_p = dx * (p.y_m - a.y_m) - dy * (p.x_m - a.x_m);
      const double at_q = dx * (q.y_m - a.y_m) - dy * (q.x_m - a.x_m);
      if (!(at_p > 0 && at_q < 0)) return;
      const double share = at_p / (at_p - at_q);
      const double x_m = p.x_m + share * (q.x_m - p.x_m), y_m = p.y_m + share * (q.y_m - p.y_m);
      const double along = dx * dx + dy * dy;
      const double t = ((x_m - a.x_m) * dx + (y_m - a.y_m) * dy) / along;
      if (t > 0 && t < 1) look(round_to_lattice(x_m), round_to_lattice(y_m));
    });
  });
  return sampled;
}

/// Crossings are looked at on the lattice, beside where they are.
constexpr double kLookedBesideM = 0.01;

TEST(SurfaceGap, IsTheGreatestDistanceAnywhere) {
  for (std::uint64_t seed = 1; seed < 7; ++seed) {
    SCOPED_TRACE(seed);
    const SampleGrid grid = hills(seed);
    const Tin finer = test::triangulated(grid, seed),
              coarse = test::triangulated(coarsened(grid, 4));
    const SurfaceGap gap = measure_gap(coarse, finer);
    const Sampled sampled = sample_gap(coarse, finer, seed);
    EXPECT_NEAR(sampled.above_m, gap.above_m, kLookedBesideM);
    EXPECT_NEAR(sampled.below_m, gap.below_m, kLookedBesideM);
    EXPECT_EQ(sampled.over_void, 0);
  }
}

TEST(Occluder, LiesNowhereAboveTheFinestSurfaceNorOverVoid) {
  for (std::uint64_t seed = 1; seed < 7; ++seed) {
    SCOPED_TRACE(seed);
    const SampleGrid grid = hills(seed);
    const Tin finest = test::triangulated(grid, seed);
    Tin finer = finest;
    for (std::int32_t stride = 2; stride <= 8; stride *= 2) {
      const Occluder coarse = triangles_of(coarsened(grid, stride), seed + 7);
      if (coarse.tin.triangles.empty()) break;  // void in every cell
      const Occluder lowered = lower_under(coarse.tin, coarse.sample_of_vertex, finer);
      EXPECT_EQ(check_tin(lowered.tin), std::nullopt);
      EXPECT_EQ(lowered.tin.triangles.size(), coarse.tin.triangles.size());
      const SurfaceGap gap = measure_gap(coarse.tin, finer);
      EXPECT_EQ(lowered.gap.above_m, gap.above_m);
      EXPECT_EQ(lowered.gap.below_m, gap.below_m);
      const Sampled sampled = sample_gap(lowered.tin, finest, seed);
      EXPECT_LE(sampled.above_m, 0);
      EXPECT_EQ(sampled.over_void, 0);
      // It is lowered no more than what lies above somewhere near.
      EXPECT_LE(sampled.below_m, measure_gap(coarse.tin, finest).below_m +
                                     2 * measure_gap(coarse.tin, finer).above_m +
                                     sample_gap(finer, finest, seed).below_m + 1);
      finer = lowered.tin;
    }
  }
}

TEST(Occluder, LeavesOutWhatIsNotWhollyOverGround) {
  const SampleGrid grid = test::grid_of(9, 9, 10, [](int, int) { return 5.0; });
  SampleGrid holed = grid;
  holed.known[holed.index(3, 3)] = 0;
  // Coarse triangles that do not know of the void.
  const Occluder coarse = triangles_of(coarsened(grid, 4));
  const Tin finer = test::triangulated(holed);
  const Occluder lowered = lower_under(coarse.tin, coarse.sample_of_vertex, finer);
  EXPECT_EQ(lowered.tin.triangles.size(), 8U - 2U);
  EXPECT_EQ(sample_gap(lowered.tin, finer, 1).over_void, 0);
  // Nor what lies wholly over void.
  SampleGrid half = grid;
  for (std::int32_t r = 0; r < 9; ++r)
    for (std::int32_t c = 5; c < 9; ++c) half.known[half.index(c, r)] = 0;
  EXPECT_EQ(lower_under(coarse.tin, coarse.sample_of_vertex, test::triangulated(half))
                .tin.triangles.size(),
            4U);
}

/// A coarse tile is lowered under the four beneath it and the edges of those beside them.
TEST(Occluder, OfTilesBesideWhatReachesIntoTheHaloIsEnough) {
  const SampleGrid grid = hills(3);
  const TileScheme scheme(grid.columns, grid.rows, 8);
  const std::int32_t finest = scheme.finest_level(), columns = grid.columns;
  std::map<TileId, Occluder> fine;
  const auto surface_of = [&](const TileId& id, std::int32_t stride) {
    const TileWindow window = scheme.window(id);
    const auto first = [&](std::int32_t sample) { return sample / stride; };
    SampleGrid part = coarsened(grid, stride);
    for (std::int32_t r = 0; r < part.rows; ++r)
      for (std::int32_t c = 0; c < part.columns; ++c)
        if (c < first(window.first_column) || c > first(window.last_column()) ||
            r < first(window.first_row) || r > first(window.last_row()))
          part.known[part.index(c, r)] = 0;
    Occluder surface = triangles_of(part);
    for (std::int64_t& sample : surface.sample_of_vertex)
      sample = sample / part.columns * stride * columns + sample % part.columns * stride;
    return surface;
  };
  for (const TileId& id : scheme.tiles(finest)) fine[id] = surface_of(id, 1);
  int trimmed = 0;
  for (const TileId& id : scheme.tiles(finest - 1)) {
    const Occluder coarse = surface_of(id, 2);
    if (coarse.tin.triangles.empty()) continue;
    std::map<TileId, Occluder> near;
    std::vector<SeenTile> all, enough;
    for (const TileId& finer : scheme.finer_around(id)) {
      const Occluder& whole = fine.at(finer);
      if (whole.tin.triangles.empty()) continue;
      all.push_back({finer, &whole.tin, whole.sample_of_vertex});
      near[finer] = reaching_into(all.back(), columns, scheme.window_with_halo(id));
      const Occluder& part = near.at(finer);
      EXPECT_EQ(check_tin(part.tin), std::nullopt);
      trimmed += part.tin.triangles.size() < whole.tin.triangles.size();
      enough.push_back({finer, &part.tin, part.sample_of_vertex});
    }
    const SeenTile tile{id, &coarse.tin, coarse.sample_of_vertex};
    const Occluder by_all = occluder_of(scheme, tile, all);
    const Occluder by_near = occluder_of(scheme, tile, enough);
    EXPECT_EQ(by_near.sample_of_vertex, by_all.sample_of_vertex);
    EXPECT_EQ(by_near.tin.triangles, by_all.tin.triangles);
    EXPECT_TRUE(by_near.tin.vertices == by_all.tin.vertices);
    EXPECT_EQ(by_near.gap.above_m, by_all.gap.above_m);
    EXPECT_EQ(by_near.gap.below_m, by_all.gap.below_m);
  }
  EXPECT_GT(trimmed, 4);
}

TEST(Occluder, OutsideKeepsWhatReachesOverTheRectangle) {
  const SampleGrid grid = test::grid_of(9, 9, 10, [](int, int) { return 5.0; });
  const Occluder all = triangles_of(grid);
  const Occluder rest = outside({{}, &all.tin, all.sample_of_vertex}, 9, {2, 2, 3, 4, 1});
  EXPECT_EQ(rest.tin.triangles.size(), all.tin.triangles.size() - 2 * 2 * 3);
  EXPECT_EQ(check_tin(rest.tin), std::nullopt);
  EXPECT_EQ(rest.sample_of_vertex.size(), rest.tin.vertices.size());
  for (std::size_t v = 0; v < rest.tin.vertices.size(); ++v)
    EXPECT_EQ(rest.tin.vertices[v],
              grid.positions[static_cast<std::size_t>(rest.sample_of_vertex[v])]);
}

SampleGrid window_of(const SampleGrid& grid, const TileWindow& window) {
  SampleGrid part;
  part.columns = window.columns;
  part.rows = window.rows;
  part.cell_x_m = grid.cell_x_m;
  part.cell_y_m = grid.cell_y_m;
  for (std::int32_t r = 0; r < window.rows; ++r)
    for (std::int32_t c = 0; c < window.columns; ++c) {
      part.positions.push_back(grid.at(window.first_column + c, window.first_row + r));
      part.known.push_back(grid.known[grid.index(window.first_column + c, window.first_row + r)]);
    }
  return part;
}

struct Heights {
  double low_m = HUGE_VAL, high_m = -HUGE_VAL;
};

/// The range of ground cells from (first) to before (end), by looking at all.
Heights heights_of_cells(const SampleGrid& grid, std::int32_t column, std::int32_t row,
                         std::int32_t cells) {
  Heights range;
  for (std::int32_t r = row; r < std::min(row + cells, grid.rows - 1); ++r)
    for (std::int32_t c = column; c < std::min(column + cells, grid.columns - 1); ++c)
      for (const auto& [dc, dr] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}})
        if (grid.is_ground_cell(c, r)) {
          range.low_m = std::min(range.low_m, grid.at(c + dc, r + dr).z_m);
          range.high_m = std::max(range.high_m, grid.at(c + dc, r + dr).z_m);
        }
  return range;
}

TEST(RangePyramid, BlocksOfAllLevelsHoldTheirGround) {
  for (std::uint64_t seed = 1; seed < 10; ++seed) {
    SampleGrid grid = hills(seed, 60 + static_cast<std::int32_t>(seed * 7), 75);
    for (Position& p : grid.positions)
      p.z_m += 0x1p14;  // floats are coarser than the lattice there
    const TileScheme scheme(grid.columns, grid.rows, seed % 2 == 0 ? 32 : 8);
    std::map<TileId, TileRanges> ranges;
    for (const TileId& tile : scheme.tiles(scheme.finest_level()))
      ranges[tile] = ranges_of(scheme, tile, window_of(grid, scheme.window_with_halo(tile)));
    for (std::int32_t level = scheme.finest_level() - 1; level >= 0; --level) {
      std::map<TileId, std::vector<QuarterRanges>> quarters;
      for (const auto& [tile, found] : ranges)
        if (tile.level == level + 1) quarters[scheme.parent(tile)].push_back({tile, &found});
      for (const auto& [tile, of_tile] : quarters) ranges[tile] = joined(scheme, tile, of_tile);
    }
    for (const auto& [tile, found] : ranges) {
      const std::int32_t side = scheme.tile_samples() * scheme.stride(tile.level);
      for (std::int32_t r = 0; r < found.rows; ++r) {
        for (std::int32_t c = 0; c < found.columns; ++c) {
          const HeightRange& block = found.blocks[static_cast<std::size_t>(r * found.columns + c)];
          const Heights truth =
              heights_of_cells(grid, tile.column * side + c * found.block_cells,
                               tile.row * side + r * found.block_cells, found.block_cells);
          EXPECT_EQ(block.is_void(), truth.low_m > truth.high_m);
          if (block.is_void()) continue;
          const auto low_m = double{block.low_m}, high_m = double{block.high_m};
          EXPECT_LE(low_m, truth.low_m);
          EXPECT_GE(high_m, truth.high_m);
          EXPECT_NEAR(low_m, truth.low_m, 0x1p-9);
          EXPECT_NEAR(high_m, truth.high_m, 0x1p-9);
        }
      }
    }
    EXPECT_EQ((ranges.at({0, 0, 0}).whole().is_void()), false);
  }
}

}  // namespace
}  // namespace scarp
