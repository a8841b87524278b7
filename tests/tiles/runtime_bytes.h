#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include "tests/tiles/small_scene.h"
#include "tiles/culling/culling_file.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp::test {

/// Small culling files to damage: a flat scene, one on the Earth, one without groups.
inline std::vector<std::vector<std::uint8_t>> small_culling_files() {
  std::vector<std::vector<std::uint8_t>> files;
  const Tin tin = grid_tin(3, 3);
  const TinIndex index(tin);
  for (int kind = 0; kind < 3; ++kind) {
    Groups groups = small_certified_groups(tin);
    if (kind == 2) {
      groups = Groups{};
      groups.group_of_triangle.assign(tin.triangles.size(), kNone);
      groups.certified.layout = {8, 2};
    }
    CullingSource source;
    if (kind == 1) source.frame = Flattening({6'378'137, 0, 0}, 0.13);
    source.tiles = {
        {{1, 0, 0}, true, bounds_of(tin.vertices), groups.leaf_count, tin.triangles.size()},
        {{0, 0, 0}, false, bounds_of(tin.vertices), 0, 0}};
    source.groups = &groups;
    source.ground = &index;
    const std::vector<std::byte> bytes = culling_file(source);
    files.emplace_back(bytes.size());
    std::memcpy(files.back().data(), bytes.data(), bytes.size());
  }
  return files;
}

/// Makes size and checksums of a damaged file fit again, as far as its counts can be followed.
/// Offsets: docs/runtime.md.
inline void reseal_culling_file(std::uint8_t* bytes, std::size_t size) {
  using runtime::detail::crc_of;
  constexpr std::size_t kHeader = 256;
  if (size < kHeader) return;
  const auto read = [&](std::size_t at) {
    std::uint32_t value;
    std::memcpy(&value, bytes + at, 4);
    return std::uint64_t{value};
  };
  const auto seal = [&](std::size_t at, std::uint32_t crc) { std::memcpy(bytes + at, &crc, 4); };
  std::memcpy(bytes, "SCARPGRP", 8);
  const std::uint64_t whole = size;
  std::memcpy(bytes + 16, &whole, 8);
  std::memset(bytes + 244, 0, 8);
  const std::uint64_t n = read(24), tiles = read(28), sectors = read(32);
  std::uint64_t cells = 0, columns = read(168), rows = read(172);
  if (columns <= 32768 && rows <= 32768)
    for (; columns > 0; columns = (columns + 1) / 2, rows = (rows + 1) / 2) {
      cells += columns * rows;
      if (columns == 1 && rows <= 1) break;
    }
  const std::uint64_t sizes[] = {tiles * 64,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 4,
                                 n * 24,
                                 (n + 31) / 32 * 24,
                                 n * sectors * 16,
                                 cells * 2};
  std::uint64_t at = kHeader;
  for (std::size_t i = 0; i < std::size(sizes); ++i) {
    const std::uint64_t begin = (at + 63) / 64 * 64;
    if (begin > size || sizes[i] > size - begin) break;
    seal(192 + 4 * i, crc_of(bytes + begin, sizes[i]));
    at = begin + sizes[i];
  }
  seal(252, crc_of(bytes, 252));
}

}  // namespace scarp::test
