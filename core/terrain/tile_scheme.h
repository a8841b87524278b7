#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace scarp {

/// A tile of a scene: its level, 0 for the root, and its place among the tiles of that level.
/// Ordered by level, then row by row.
struct TileId {
  std::int32_t level = 0;
  std::int32_t column = 0;
  std::int32_t row = 0;

  friend bool operator==(const TileId&, const TileId&) = default;
  friend std::strong_ordering operator<=>(const TileId& a, const TileId& b) {
    if (const auto order = a.level <=> b.level; order != 0) return order;
    if (const auto order = a.row <=> b.row; order != 0) return order;
    return a.column <=> b.column;
  }
};

/// "level/column/row", as in scene.json.
std::string name_of(const TileId& tile);
/// The inverse; nothing for any other text.
std::optional<TileId> tile_named(std::string_view name);

/// Every stride-th sample of a rectangle of the raster: sample (i, j) of the window is sample
/// (first_column + i * stride, first_row + j * stride) of the raster.
struct TileWindow {
  std::int32_t first_column = 0;
  std::int32_t first_row = 0;
  std::int32_t columns = 0;  ///< of the window, in samples
  std::int32_t rows = 0;
  std::int32_t stride = 1;

  friend bool operator==(const TileWindow&, const TileWindow&) = default;
  /// The last samples, in the raster.
  std::int32_t last_column() const { return first_column + (columns - 1) * stride; }
  std::int32_t last_row() const { return first_row + (rows - 1) * stride; }
};

/// The quadtree of tiles over a raster's samples. At the finest level a tile holds tile_samples x
/// tile_samples cells; a level nearer to the root, every other sample of twice that in both
/// directions, and so on to the root, which holds all. Neighbours share the samples of their
/// common edge, so that a tile has one sample more than cells in a row.
///
/// Tiles at the right and lower border are clipped to the raster, on the lattice of their level:
/// what is left beyond the last whole row and column of coarser cells is in finer tiles only. A
/// tile without a cell does not exist, and long narrow rasters have none at all near the root; a
/// raster of up to tile_samples x tile_samples cells has one tile, 0/0/0, with all samples.
///
/// Cost: O(1) where nothing else is said.
class TileScheme {
 public:
  /// @param columns, rows   of samples, at least 2 and at most 2^24
  /// @param tile_samples    a power of two from 2 to 2^20
  TileScheme(std::int32_t columns, std::int32_t rows, std::int32_t tile_samples);

  std::int32_t columns() const { return columns_; }
  std::int32_t rows() const { return rows_; }
  std::int32_t tile_samples() const { return tile_samples_; }

  /// 0 where one tile holds the raster.
  std::int32_t finest_level() const { return finest_level_; }
  /// Samples of the raster from one sample of a level to the next.
  std::int32_t stride(std::int32_t level) const { return 1 << (finest_level_ - level); }
  /// How many tiles a row and a column of a level have; at least 1 at the finest.
  std::int32_t tiles_across(std::int32_t level) const { return tiles_over(columns_, level); }
  std::int32_t tiles_down(std::int32_t level) const { return tiles_over(rows_, level); }

  bool exists(const TileId& tile) const;
  /// All tiles of a level, row by row. Cost: O(tiles).
  std::vector<TileId> tiles(std::int32_t level) const;
  /// Place of a tile in tiles(tile.level).
  std::size_t number_of(const TileId& tile) const;
  /// The tile that holds it one level nearer to the root, which need not exist (see above).
  TileId parent(const TileId& tile) const;
  /// Those of its four quarters that exist, row by row; none at the finest level.
  std::vector<TileId> children(const TileId& tile) const;
  /// The tile of a level that a cell lies in, the cell named by its upper left sample; it need not
  /// exist where the cell is in finer tiles only.
  TileId tile_at(std::int32_t level, std::int32_t column, std::int32_t row) const;

  /// A tile's own samples, edges included.
  TileWindow window(const TileId& tile) const;
  /// The same with one more sample of its level on each side where the raster has one: what it
  /// takes to mesh a tile (mesh_tile).
  TileWindow window_with_halo(const TileId& tile) const;

  /// Tiles of the next finer level that have samples in the halo of a tile, row by row: its
  /// children and those beside them. None at the finest level.
  std::vector<TileId> finer_around(const TileId& tile) const;

  /// What the ground of a tile of the finest level is seen against, all of the scene: itself first,
  /// the other tiles around it, then for each level from the second finest on the tiles around its
  /// ancestor, the ancestor left out. Each level in rows, from fine to coarse. All ground that is
  /// in a coarser tile but not in finer ones of the list lies outside covered_by_finer.
  /// Cost: O(levels); at most 9 + 8 * levels tiles.
  std::vector<TileId> seen_from(const TileId& tile) const;
  /// The rectangle of the raster that tiles finer than `level` hold in seen_from, stride 1. The
  /// last sample may lie beyond the raster. Requires level < finest_level().
  TileWindow covered_by_finer(const TileId& tile, std::int32_t level) const;

 private:
  std::int32_t tiles_over(std::int32_t samples, std::int32_t level) const;

  std::int32_t columns_, rows_, tile_samples_;
  std::int32_t finest_level_ = 0;
};

}  // namespace scarp
