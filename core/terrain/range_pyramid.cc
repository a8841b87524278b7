#include "core/terrain/range_pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float rounded_down(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) <= value ? nearest : std::nextafter(nearest, -kInfinity);
}

/// All blocks of a tile, void, over the cells of the raster that it has a share in.
TileRanges empty_ranges(const TileScheme& scheme, const TileId& tile) {
  TileRanges ranges;
  const std::int32_t stride = scheme.stride(tile.level);
  ranges.block_cells = std::min(kRangeBlockCells, scheme.tile_samples()) * stride;
  const std::int64_t side = std::int64_t{scheme.tile_samples()} * stride;
  const auto blocks_along = [&](std::int32_t index, std::int32_t samples) {
    const std::int64_t cells = std::min(side, samples - 1 - index * side);
    assert(cells > 0);
    return static_cast<std::int32_t>((cells + ranges.block_cells - 1) / ranges.block_cells);
  };
  ranges.columns = blocks_along(tile.column, scheme.columns());
  ranges.rows = blocks_along(tile.row, scheme.rows());
  ranges.blocks.resize(static_cast<std::size_t>(ranges.columns) *
                       static_cast<std::size_t>(ranges.rows));
  return ranges;
}

HeightRange& block_at(TileRanges& ranges, std::int32_t column, std::int32_t row) {
  assert(column < ranges.columns && row < ranges.rows);
  return ranges.blocks[static_cast<std::size_t>(row) * static_cast<std::size_t>(ranges.columns) +
                       static_cast<std::size_t>(column)];
}

}  // namespace

HeightRange united(const HeightRange& a, const HeightRange& b) {
  return {std::min(a.low_m, b.low_m), std::max(a.high_m, b.high_m)};
}

HeightRange TileRanges::whole() const {
  HeightRange all;
  for (const HeightRange& block : blocks) all = united(all, block);
  return all;
}

TileRanges ranges_of(const TileScheme& scheme, const TileId& tile, const SampleGrid& window) {
  assert(tile.level == scheme.finest_level());
  const TileWindow own = scheme.window(tile), with_halo = scheme.window_with_halo(tile);
  assert(window.columns == with_halo.columns && window.rows == with_halo.rows);
  TileRanges ranges = empty_ranges(scheme, tile);
  const std::int32_t first_column = own.first_column - with_halo.first_column;
  const std::int32_t first_row = own.first_row - with_halo.first_row;
  for (std::int32_t r = 0; r + 1 < own.rows; ++r) {
    for (std::int32_t c = 0; c + 1 < own.columns; ++c) {
      if (!window.is_ground_cell(first_column + c, first_row + r)) continue;
      HeightRange& block = block_at(ranges, c / ranges.block_cells, r / ranges.block_cells);
      for (const std::int32_t dr : {0, 1})
        for (const std::int32_t dc : {0, 1}) {
          const double z_m = window.at(first_column + c + dc, first_row + r + dr).z_m;
          block = united(block, {rounded_down(z_m), -rounded_down(-z_m)});
        }
    }
  }
  return ranges;
}

TileRanges joined(const TileScheme& scheme, const TileId& tile,
                  std::span<const QuarterRanges> quarters) {
  TileRanges ranges = empty_ranges(scheme, tile);
  // Blocks of a tile along its side; where it has one, its quarters have one each.
  const std::int32_t along =
      std::max(1, scheme.tile_samples() / std::min(kRangeBlockCells, scheme.tile_samples()));
  for (const QuarterRanges& quarter : quarters) {
    assert(scheme.parent(quarter.tile) == tile);
    const std::int32_t column0 = quarter.tile.column % 2 * along;
    const std::int32_t row0 = quarter.tile.row % 2 * along;
    const TileRanges& from = *quarter.ranges;
    for (std::int32_t r = 0; r < from.rows; ++r)
      for (std::int32_t c = 0; c < from.columns; ++c) {
        HeightRange& block = block_at(ranges, (column0 + c) / 2, (row0 + r) / 2);
        block = united(
            block,
            from.blocks[static_cast<std::size_t>(r) * static_cast<std::size_t>(from.columns) +
                        static_cast<std::size_t>(c)]);
      }
  }
  return ranges;
}

}  // namespace scarp
