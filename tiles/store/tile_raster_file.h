#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kTileRasterKind = {'R', 'A', 'S', 'T'};

/// Values of a layer over a tile's samples, as one step of a build hands them to the last: no part
/// of a scene.
struct TileRaster {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  std::vector<std::int32_t> values;  ///< [rows * columns], row by row
};

/// Errors: those of PartFile.
void write_tile_raster(const std::string& path, const TileRaster& raster, Existing existing);

/// Errors: kCorrupt. Cost: O(n).
TileRaster read_tile_raster(const SectionFile& file);

}  // namespace scarp
