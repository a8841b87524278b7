#include "ingest/dem/dem.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <span>

#include "core/error/error.h"
#include "core/memory/large_array.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/dem/ground_placement.h"
#include "ingest/dem/height_reader.h"
#include "ingest/dem/raster_file.h"

namespace scarp {
namespace {

constexpr int kRowsPerRead = 64;

/// Pieces that a file is read in at once, so that threads end together.
constexpr int kBandsPerThread = 4;

/// Rows of one file straight into the grid. Each call opens the file for itself, so that calls may
/// run at once.
/// @return how many heights it gave
std::uint64_t read_rows_into(GroundGrid& grid, const Dem& dem, const RasterFile& source,
                             const DemOptions& options, int first_row, int end_row) {
  const RasterFile own = open_raster_file(source.file);
  const HeightReader reader(own, options, on_earth(dem));
  const bool add_undulation = !dem.frame->description().geoid_file.empty();
  const GeoFrame::Placer placer(*dem.frame);
  const auto width = static_cast<std::size_t>(own.columns);
  const auto column = static_cast<std::int32_t>(source.first_column);
  StoredValues stored;
  std::uint64_t known_count = 0;
  for (int first = first_row; first < end_row; first += kRowsPerRead) {
    const int count = std::min(kRowsPerRead, end_row - first);
    reader.read_values({0, first, own.columns, count}, stored);
    for (int r = 0; r < count; ++r) {
      const int file_row = first + r;
      const auto row = static_cast<std::int32_t>(
          source.first_row + (own.south_up ? own.rows - 1 - file_row : file_row));
      const std::size_t begin = static_cast<std::size_t>(r) * width;
      const std::span<double> heights_m = std::span(stored.values).subspan(begin, width);
      const std::span<std::uint8_t> known = std::span(stored.mask).subspan(begin, width);
      reader.to_metres(0, file_row, heights_m, known);
      for (std::size_t c = 0; c < width; ++c) {
        known_count += known[c] != 0;
        if (add_undulation && known[c])
          heights_m[c] +=
              placer.undulation_m(dem.x_of(column + static_cast<double>(c)), dem.y_of(row));
      }
      if (!grid.set_heights(row, column, heights_m, known.data()))
        refuse_file(own.file,
                    "reaches too far around the Earth for one frame (heights of 500 km and more); "
                    "a smaller piece was expected; cut it with gdal_translate -projwin");
    }
    relieve_large_memory();
  }
  return known_count;
}

/// Is the budget too small for all in memory?
bool is_tight(const Dem& dem, const DemOptions& options, double bytes_per_sample) {
  const double needed = static_cast<double>(dem.columns) * dem.rows *
                        (bytes_per_sample + options.more_bytes_per_sample);
  return options.memory_budget_bytes && needed > static_cast<double>(options.memory_budget_bytes);
}

/// Refuses before allocating what will not fit.
void check_memory(const Dem& dem, const DemOptions& options, double bytes_per_sample,
                  const std::string& file) {
  const double needed = static_cast<double>(dem.columns) * dem.rows *
                        (bytes_per_sample + options.more_bytes_per_sample);
  if (is_tight(dem, options, bytes_per_sample))
    throw Error(ErrorCode::kResource,
                fmt::format("'{}': {} x {} samples need about {:.1f} GiB, and --memory allows "
                            "{:.1f}; raise --memory, or cut the DEM with gdal_translate -projwin",
                            file, dem.columns, dem.rows, needed / (1 << 30),
                            static_cast<double>(options.memory_budget_bytes) / (1 << 30)));
}
/// What GDAL's cache has to hold so that no block is unpacked twice, in files that are read by
/// bands of rows.
double reading_bytes(const std::vector<RasterFile>& sources) {
  double most = 0;
  for (const RasterFile& source : sources) {
    int block_columns = 1, block_rows = 1;
    source.band->GetBlockSize(&block_columns, &block_rows);
    most = std::max(most, static_cast<double>(block_rows) * (source.columns + block_columns) *
                              GDALGetDataTypeSizeBytes(source.band->GetRasterDataType()));
  }
  constexpr double kLeast = 4e6;
  return std::max(kLeast, thread_count() * most);
}

/// Makes room elsewhere, or refuses.
void make_room(const Dem& dem, const DemOptions& options, const std::vector<RasterFile>& sources) {
  if (!is_tight(dem, options, kBytesPerGroundSample)) return;
  const double bytes = reading_bytes(sources);
  if (options.make_room && options.make_room(static_cast<double>(dem.columns) * dem.rows, bytes))
    GDALSetCacheMax64(static_cast<GIntBig>(bytes));
  else
    check_memory(dem, options, kBytesPerGroundSample, sources.front().file);
}

}  // namespace

Dem read_dem(const std::vector<std::string>& files, const DemOptions& options,
             const Progress& progress) {
  const DemWindows source(files, options);
  check_memory(source.dem(), options, kBytesPerSample, files.front());
  Dem dem = source.dem();
  const std::size_t count =
      static_cast<std::size_t>(dem.columns) * static_cast<std::size_t>(dem.rows);
  dem.heights_m.assign(count, 0);
  dem.known.assign(count, 0);
  dem.sources = source.read_all(dem.heights_m, dem.known, progress);
  return dem;
}

Ground read_ground(const std::vector<std::string>& files, const DemOptions& options,
                   const Progress& progress) {
  Ground ground;
  Dem& dem = ground.dem;
  const std::vector<RasterFile> sources = open_mosaic(files, options, dem);
  make_room(dem, options, sources);
  ground.grid = GroundGrid(dem.columns, dem.rows, ground_placement(dem));
  std::uint64_t known = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const RasterFile& source = sources[i];
    dem.height_unit = HeightReader(source, options, on_earth(dem)).unit_name();
    const int bands = std::clamp(source.rows / kRowsPerRead, 1, kBandsPerThread * thread_count());
    // Bands end between the file's own blocks, so that none is read twice.
    int block_columns = 1, block_rows = 1;
    source.band->GetBlockSize(&block_columns, &block_rows);
    const int rows_in_band =
        (source.rows + bands * block_rows - 1) / (bands * block_rows) * block_rows;
    const auto count = static_cast<std::size_t>((source.rows + rows_in_band - 1) / rows_in_band);
    std::vector<std::uint64_t> known_in_band(count);
    parallel_for(count, [&](std::size_t band) {
      const int first = static_cast<int>(band) * rows_in_band;
      known_in_band[band] = read_rows_into(ground.grid, dem, source, options, first,
                                           std::min(source.rows, first + rows_in_band));
    });
    dem.sources[i].samples =
        std::accumulate(known_in_band.begin(), known_in_band.end(), std::uint64_t{0});
    known += dem.sources[i].samples;
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(sources.size()));
  }
  if (known == 0) refuse_void(files.front());
  return ground;
}

SampleGrid place_samples(const Dem& dem) {
  return place_window(dem, {0, 0, dem.columns, dem.rows}, dem.heights_m, dem.known);
}

}  // namespace scarp
