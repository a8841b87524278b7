#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "core/terrain/tile_scheme.h"

namespace scarp {

/// Least and greatest height of ground, flattened metres, rounded outwards; low_m > high_m where
/// there is none.
struct HeightRange {
  float low_m = std::numeric_limits<float>::infinity();
  float high_m = -std::numeric_limits<float>::infinity();

  bool is_void() const { return low_m > high_m; }
  friend bool operator==(const HeightRange&, const HeightRange&) = default;
};

HeightRange united(const HeightRange& a, const HeightRange& b);

/// Cells of a tile's level to a block of its finest ranges; of smaller tiles, all.
inline constexpr std::int32_t kRangeBlockCells = 16;

/// Ranges of heights over square blocks of a tile: its part of the minimum/maximum pyramid of the
/// scene. Blocks hold all ground of the raster in the tile's square, also what coarser meshes leave
/// to finer ones; only what lies in no tile of a level (TileScheme) is in finer ranges alone.
struct TileRanges {
  std::int32_t block_cells = 0;  ///< of the raster, along a block's side
  std::int32_t columns = 0;      ///< of blocks
  std::int32_t rows = 0;
  std::vector<HeightRange> blocks;  ///< [rows * columns], row by row

  HeightRange whole() const;
};

/// Ranges of a tile of the finest level.
/// @param window  the samples of scheme.window_with_halo(tile), as for mesh_tile
/// Side: a block's range holds the surface `grid` over its cells, read with either diagonal; the
/// mesh `tin` may lie beyond it by its error.
/// Cost: O(samples).
TileRanges ranges_of(const TileScheme& scheme, const TileId& tile, const SampleGrid& window);

/// One of the four quarters of a tile and its ranges.
struct QuarterRanges {
  TileId tile;
  const TileRanges* ranges = nullptr;
};

/// Ranges of a tile from those of its quarters one level finer, which need not all be there.
/// @param quarters  at least one, each with parent(tile) == tile
/// Cost: O(blocks).
TileRanges joined(const TileScheme& scheme, const TileId& tile,
                  std::span<const QuarterRanges> quarters);

}  // namespace scarp
