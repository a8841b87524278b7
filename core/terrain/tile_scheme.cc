#include "core/terrain/tile_scheme.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <charconv>

namespace scarp {

std::string name_of(const TileId& tile) {
  return std::to_string(tile.level) + "/" + std::to_string(tile.column) + "/" +
         std::to_string(tile.row);
}

std::optional<TileId> tile_named(std::string_view name) {
  std::array<std::int32_t, 3> numbers{};
  const char* at = name.data();
  const char* const end = at + name.size();
  for (std::size_t i = 0; i < 3; ++i) {
    if (i > 0 && (at == end || *at++ != '/')) return {};
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc() || numbers[i] < 0) return {};
    at = next;
  }
  const TileId tile{numbers[0], numbers[1], numbers[2]};
  // One name for a tile: no leading zeros, nothing behind.
  if (name_of(tile) != name) return {};
  return tile;
}

TileScheme::TileScheme(std::int32_t columns, std::int32_t rows, std::int32_t tile_samples)
    : columns_(columns), rows_(rows), tile_samples_(tile_samples) {
  assert(columns >= 2 && rows >= 2 && columns <= 1 << 24 && rows <= 1 << 24);
  assert(tile_samples >= 2 && tile_samples <= 1 << 20 &&
         std::has_single_bit(static_cast<std::uint32_t>(tile_samples)));
  const std::int64_t cells = std::max(columns, rows) - 1;
  while (std::int64_t{tile_samples} << finest_level_ < cells) ++finest_level_;
}

std::int32_t TileScheme::tiles_over(std::int32_t samples, std::int32_t level) const {
  assert(level >= 0 && level <= finest_level_);
  const std::int32_t cells = (samples - 1) / stride(level);  // those that are whole
  return (cells + tile_samples_ - 1) / tile_samples_;
}

bool TileScheme::exists(const TileId& tile) const {
  return tile.level >= 0 && tile.level <= finest_level_ && tile.column >= 0 && tile.row >= 0 &&
         tile.column < tiles_across(tile.level) && tile.row < tiles_down(tile.level);
}

std::vector<TileId> TileScheme::tiles(std::int32_t level) const {
  std::vector<TileId> all;
  for (std::int32_t row = 0; row < tiles_down(level); ++row)
    for (std::int32_t column = 0; column < tiles_across(level); ++column)
      all.push_back({level, column, row});
  return all;
}

std::size_t TileScheme::number_of(const TileId& tile) const {
  assert(exists(tile));
  return static_cast<std::size_t>(tile.row) * static_cast<std::size_t>(tiles_across(tile.level)) +
         static_cast<std::size_t>(tile.column);
}

TileId TileScheme::parent(const TileId& tile) const {
  assert(tile.level > 0);
  return {tile.level - 1, tile.column / 2, tile.row / 2};
}

std::vector<TileId> TileScheme::children(const TileId& tile) const {
  std::vector<TileId> found;
  for (const std::int32_t row : {2 * tile.row, 2 * tile.row + 1})
    for (const std::int32_t column : {2 * tile.column, 2 * tile.column + 1})
      if (const TileId child{tile.level + 1, column, row}; exists(child)) found.push_back(child);
  return found;
}

TileId TileScheme::tile_at(std::int32_t level, std::int32_t column, std::int32_t row) const {
  const std::int32_t cells = tile_samples_ * stride(level);
  return {level, column / cells, row / cells};
}

TileWindow TileScheme::window(const TileId& tile) const {
  assert(exists(tile));
  const std::int32_t step = stride(tile.level);
  const auto along = [&](std::int32_t index, std::int32_t samples) {
    const std::int32_t cells = (samples - 1) / step, first = index * tile_samples_;
    return std::min(tile_samples_, cells - first) + 1;
  };
  return {tile.column * tile_samples_ * step, tile.row * tile_samples_ * step,
          along(tile.column, columns_), along(tile.row, rows_), step};
}

TileWindow TileScheme::window_with_halo(const TileId& tile) const {
  TileWindow window = this->window(tile);
  const auto widen = [&](std::int32_t& first, std::int32_t& count, std::int32_t samples) {
    if (first + count * window.stride < samples) ++count;
    if (first > 0) {
      first -= window.stride;
      ++count;
    }
  };
  widen(window.first_column, window.columns, columns_);
  widen(window.first_row, window.rows, rows_);
  return window;
}

std::vector<TileId> TileScheme::finer_around(const TileId& tile) const {
  std::vector<TileId> found;
  for (std::int32_t row = 2 * tile.row - 1; row <= 2 * tile.row + 2; ++row)
    for (std::int32_t column = 2 * tile.column - 1; column <= 2 * tile.column + 2; ++column)
      if (const TileId finer{tile.level + 1, column, row}; exists(finer)) found.push_back(finer);
  return found;
}

std::vector<TileId> TileScheme::seen_from(const TileId& tile) const {
  assert(tile.level == finest_level_ && exists(tile));
  std::vector<TileId> seen{tile};
  for (std::int32_t level = finest_level_; level >= 0; --level) {
    const std::int32_t up = finest_level_ - level;
    const TileId middle{level, tile.column >> up, tile.row >> up};
    for (std::int32_t row = middle.row - 1; row <= middle.row + 1; ++row)
      for (std::int32_t column = middle.column - 1; column <= middle.column + 1; ++column) {
        const TileId around{level, column, row};
        if (!(around == middle) && exists(around)) seen.push_back(around);
      }
  }
  return seen;
}

TileWindow TileScheme::covered_by_finer(const TileId& tile, std::int32_t level) const {
  assert(level < finest_level_);
  const std::int32_t up = finest_level_ - level - 1;
  const std::int32_t cells = tile_samples_ << up;
  const auto first = [&](std::int32_t index) { return std::max(0, (index >> up) - 1) * cells; };
  const auto samples = [&](std::int32_t index) {
    return ((index >> up) + 2) * cells - first(index) + 1;
  };
  return {first(tile.column), first(tile.row), samples(tile.column), samples(tile.row), 1};
}

}  // namespace scarp
