#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tiles/layers/geotiff.h"
#include "tiles/store/part_file.h"

namespace scarp {

/// A raster of many bands that is larger than memory: an unpacked cloud-optimised BigTIFF whose
/// squares are written in any order, each to its own place. Bands lie one after the other.
///
/// Overviews hold every second sample of the level below. They are kept for each band until it is
/// finished, a quarter of its size.
/// Threads: any number may write at once, but each sample once; finish and commit when none does.
/// Errors, of all members: those of PartFile; kResource with GDAL's own words.
class BlockRaster {
 public:
  static constexpr std::int32_t kSide = 256;  ///< of a square

  /// @param layer  what the bands are; its samples and those of more_bands tell the type alone, and
  ///               may be empty
  BlockRaster(const std::string& path, const RasterLayer& layer, Existing existing);
  ~BlockRaster();
  BlockRaster(const BlockRaster&) = delete;
  BlockRaster& operator=(const BlockRaster&) = delete;

  std::size_t bands() const;

  /// A square's samples, row by row. Requires that the band is begun, and that the square begins at
  /// multiples of kSide and ends there or at the border.
  void begin(std::size_t band);
  void write(std::size_t band, std::int32_t first_column, std::int32_t first_row,
             std::int32_t columns, std::int32_t rows, std::span<const std::byte> samples);
  /// Writes the overviews of some bands.
  void finish(std::size_t first_band, std::size_t count);

  /// The file appears. Once, when all bands are finished.
  void commit();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scarp
