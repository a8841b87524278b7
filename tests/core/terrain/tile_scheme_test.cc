#include "core/terrain/tile_scheme.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace scarp {
namespace {

TEST(TileScheme, NamesAndTilesAreEachOthersInverse) {
  EXPECT_EQ(name_of({3, 12, 7}), "3/12/7");
  EXPECT_EQ(tile_named("3/12/7"), (TileId{3, 12, 7}));
  for (const char* wrong :
       {"", "3/12", "3/12/7/", "3/012/7", "a/1/1", "1/-1/1", "1/1/1 ", "//", "99999999999/1/1"})
    EXPECT_EQ(tile_named(wrong), std::nullopt) << wrong;
}

TEST(TileScheme, OneTileHoldsWhatFits) {
  for (const auto& [columns, rows] : {std::pair{1025, 1025}, {2, 2}, {1025, 3}, {700, 1024}}) {
    const TileScheme scheme(columns, rows, 1024);
    EXPECT_EQ(scheme.finest_level(), 0);
    EXPECT_EQ(scheme.tiles(0), (std::vector<TileId>{{0, 0, 0}}));
    EXPECT_EQ(scheme.window({0, 0, 0}), (TileWindow{0, 0, columns, rows, 1}));
    EXPECT_EQ(scheme.window_with_halo({0, 0, 0}), (TileWindow{0, 0, columns, rows, 1}));
  }
  EXPECT_EQ(TileScheme(1026, 2, 1024).finest_level(), 1);
}

/// All cells of windows of a level, by how many windows hold them.
std::vector<int> cells_held(const TileScheme& scheme, std::int32_t level) {
  std::vector<int> held(static_cast<std::size_t>(scheme.columns() * scheme.rows()), 0);
  for (const TileId& tile : scheme.tiles(level)) {
    const TileWindow window = scheme.window(tile);
    EXPECT_GE(window.columns, 2);
    EXPECT_GE(window.rows, 2);
    EXPECT_LT(window.last_column(), scheme.columns());
    EXPECT_LT(window.last_row(), scheme.rows());
    for (std::int32_t r = window.first_row; r < window.last_row(); ++r)
      for (std::int32_t c = window.first_column; c < window.last_column(); ++c) {
        ++held[static_cast<std::size_t>(r * scheme.columns() + c)];
        EXPECT_EQ(scheme.tile_at(level, c, r), tile);
      }
  }
  return held;
}

TEST(TileScheme, TilesOfALevelHoldEachWholeCellOnce) {
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    const auto columns = static_cast<std::int32_t>(2 + random() % 70);
    const auto rows = static_cast<std::int32_t>(2 + random() % 70);
    const TileScheme scheme(columns, rows, 2 << random() % 4);
    SCOPED_TRACE(std::to_string(columns) + " x " + std::to_string(rows) + " in tiles of " +
                 std::to_string(scheme.tile_samples()));
    EXPECT_LE(scheme.tiles(0).size(), 1U);
    for (std::int32_t level = 0; level <= scheme.finest_level(); ++level) {
      const std::vector<int> held = cells_held(scheme, level);
      const std::int32_t stride = scheme.stride(level);
      for (std::int32_t r = 0; r + 1 < rows; ++r)
        for (std::int32_t c = 0; c + 1 < columns; ++c) {
          const bool is_whole =
              (c / stride + 1) * stride < columns && (r / stride + 1) * stride < rows;
          ASSERT_EQ(held[static_cast<std::size_t>(r * columns + c)], is_whole ? 1 : 0)
              << c << " " << r << " at level " << level;
        }
    }
  }
}

TEST(TileScheme, TilesKnowTheirFamily) {
  const TileScheme scheme(100, 37, 8);
  for (std::int32_t level = 0; level <= scheme.finest_level(); ++level) {
    const std::vector<TileId> tiles = scheme.tiles(level);
    EXPECT_TRUE(std::is_sorted(tiles.begin(), tiles.end()));
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      EXPECT_TRUE(scheme.exists(tiles[i]));
      EXPECT_EQ(scheme.number_of(tiles[i]), i);
      for (const TileId& child : scheme.children(tiles[i]))
        EXPECT_EQ(scheme.parent(child), tiles[i]);
      if (level == scheme.finest_level()) {
        EXPECT_TRUE(scheme.children(tiles[i]).empty());
      }
    }
  }
  EXPECT_FALSE(scheme.exists({0, 1, 0}));
  EXPECT_FALSE(scheme.exists({scheme.finest_level() + 1, 0, 0}));
}

TEST(TileScheme, AHaloIsOneSampleWhereTheLatticeGoesOn) {
  const TileScheme scheme(40, 21, 8);  // strides 8, 4, 2, 1
  EXPECT_EQ(scheme.window_with_halo({3, 1, 1}), (TileWindow{7, 7, 11, 11, 1}));
  EXPECT_EQ(scheme.window_with_halo({3, 0, 0}), (TileWindow{0, 0, 10, 10, 1}));
  EXPECT_EQ(scheme.window({3, 4, 2}), (TileWindow{32, 16, 8, 5, 1}));
  EXPECT_EQ(scheme.window_with_halo({3, 4, 2}), (TileWindow{31, 15, 9, 6, 1}));
  EXPECT_EQ(scheme.window({2, 2, 1}), (TileWindow{32, 16, 4, 3, 2}));
  EXPECT_EQ(scheme.window_with_halo({2, 2, 1}), (TileWindow{30, 14, 5, 4, 2}));
}

TEST(TileScheme, ATileSeesAllOfTheScene) {
  std::mt19937 random(2);
  for (int i = 0; i < 30; ++i) {
    const TileScheme scheme(static_cast<std::int32_t>(2 + random() % 70),
                            static_cast<std::int32_t>(2 + random() % 70), 2 << random() % 3);
    const std::vector<TileId> finest = scheme.tiles(scheme.finest_level());
    const TileId tile = finest[random() % finest.size()];
    const std::vector<TileId> seen = scheme.seen_from(tile);
    EXPECT_EQ(seen.front(), tile);
    EXPECT_EQ(std::set<TileId>(seen.begin(), seen.end()).size(), seen.size());
    EXPECT_LE(seen.size(), static_cast<std::size_t>(9 + 8 * scheme.finest_level()));
    // Each cell is in a tile of the list, but for what coarser levels leave out at the border; and
    // what finer tiles of it hold is what covered_by_finer says.
    for (std::int32_t r = 0; r + 1 < scheme.rows(); ++r) {
      for (std::int32_t c = 0; c + 1 < scheme.columns(); ++c) {
        bool is_held = false;
        for (std::int32_t level = scheme.finest_level(); level >= 0; --level) {
          if (level < scheme.finest_level()) {
            const TileWindow covered = scheme.covered_by_finer(tile, level);
            const bool is_inside = c >= covered.first_column && c < covered.last_column() &&
                                   r >= covered.first_row && r < covered.last_row();
            const TileId finer = scheme.tile_at(level + 1, c, r);
            const TileId middle = scheme.tile_at(level + 1, tile.column * scheme.tile_samples(),
                                                 tile.row * scheme.tile_samples());
            EXPECT_EQ(is_inside, std::abs(finer.column - middle.column) <= 1 &&
                                     std::abs(finer.row - middle.row) <= 1);
            if (is_inside) {
              is_held = true;
              break;
            }
          }
          const TileId holder = scheme.tile_at(level, c, r);
          if (std::find(seen.begin(), seen.end(), holder) != seen.end()) {
            is_held = true;
            break;
          }
          // Where the coarser tile is not there, its lattice ends before this cell.
          if (!scheme.exists(holder) && level < scheme.finest_level()) is_held = true;
        }
        EXPECT_TRUE(is_held) << c << " " << r;
      }
    }
  }
}

}  // namespace
}  // namespace scarp
