#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "core/threads/progress.h"
#include "ingest/dem/dem.h"
#include "ingest/dem/height_reader.h"
#include "ingest/dem/raster_file.h"

namespace scarp {

/// Heights of a part of a raster.
struct HeightWindow {
  SampleRect rect;
  std::vector<double> heights_m;    ///< [rows * columns]; 0 where void
  std::vector<std::uint8_t> known;  ///< [rows * columns]
};

/// A DEM that is read in windows, so that it may be larger than memory: the same heights, checks
/// and messages as read_dem, which is made of it.
///
/// Memory: GDAL's cache (limit_raster_cache), and a window. Thread safety: one thread at a time;
/// each thread may open its own.
class DemWindows {
 public:
  /// Opens the files and reads no height. Throws as read_dem does for what headers tell.
  DemWindows(const std::vector<std::string>& files, const DemOptions& options);
  DemWindows(const DemWindows&) = delete;
  DemWindows& operator=(const DemWindows&) = delete;

  /// Without heights_m and known, its sources without samples and checksums.
  const Dem& dem() const { return dem_; }

  /// Columns of the widest file.
  std::int32_t widest_columns() const;

  /// Reads every height once, file by file, and refuses what read_dem refuses.
  /// @return the sources, with how many samples they know and the checksums of their values
  /// Memory: 64 rows of the widest file.
  std::vector<DemSource> check(const Progress& progress) const;

  /// The same, and keeps them: [rows * columns] each, zeros before.
  std::vector<DemSource> read_all(std::span<double> heights_m, std::span<std::uint8_t> known,
                                  const Progress& progress) const;

  /// The samples of a rectangle, bit for bit those of read_dem.
  /// Requires it to lie on the raster (asserted). Errors: kInput where a file cannot be read there,
  /// or holds what is no height.
  HeightWindow read(const SampleRect& rect) const;

 private:
  template <class Put>
  DemSource read_file(std::size_t file, const Progress& progress, const Put& put) const;
  template <class Put>
  std::vector<DemSource> read_files(const Progress& progress, const Put& put) const;

  DemOptions options_;
  std::vector<std::string> names_;
  Dem dem_;
  std::vector<RasterFile> files_;
  std::vector<HeightReader> readers_;
};

/// The cells of a raster, whatever its heights: as SampleGrid has them.
struct CellMeasures {
  double cell_x_m = 0, cell_y_m = 0;
  double bend_cells = 0;
};
CellMeasures measure_cells(const Dem& dem);

/// Places the samples of a window of a DEM in the DEM's frame: each as place_samples does, which is
/// this for the whole raster. Cells and their bending are those of the DEM.
/// @param dem  may be without heights
SampleGrid place_window(const Dem& dem, const HeightWindow& window);

/// The same of borrowed heights. [rows * columns] each, of the rectangle
SampleGrid place_window(const Dem& dem, const SampleRect& rect, std::span<const double> heights_m,
                        std::span<const std::uint8_t> known);

/// Bounds what GDAL keeps of files that were read, for all of the process. More than a row of a
/// file's blocks should fit, or they are unpacked again and again.
void limit_raster_cache(std::uint64_t bytes);

}  // namespace scarp
