#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "ingest/dem/dem.h"
#include "ingest/dem/gdal_session.h"

namespace scarp {

/// One opened file of heights and where it lies on the mosaic's grid.
struct RasterFile {
  std::string file;
  DatasetPtr dataset;
  GDALRasterBand* band = nullptr;
  std::array<double, 6> geotransform{};  ///< north up, whichever way the file's rows run
  int columns = 0, rows = 0;
  bool south_up = false;
  std::int64_t first_column = 0, first_row = 0;  ///< on the mosaic
};

/// Throws Error{kInput}: what read_dem says about single files.
RasterFile open_raster_file(const std::string& file);

/// Opens all files of a mosaic and puts each on the grid of the first; their extent, the frame
/// around its centre and what should be said about the files go to dem, sources without samples and
/// checksums. Reads no height. Throws as read_dem.
std::vector<RasterFile> open_mosaic(const std::vector<std::string>& files,
                                    const DemOptions& options, Dem& dem);

/// Whether heights are checked against what ground there is on Earth.
bool on_earth(const Dem& dem);

/// Throws Error{kInput} with the file's name before the rest.
[[noreturn]] void refuse_file(const std::string& file, const std::string& rest);
[[noreturn]] void refuse_void(const std::string& file);

}  // namespace scarp
