#include "ingest/dem/dem_windows.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr int kRowsPerRead = 64;

/// Distance in the plane.
double plane_distance_m(const Position& a, const Position& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

}  // namespace

DemWindows::DemWindows(const std::vector<std::string>& files, const DemOptions& options)
    : options_(options), names_(files), files_(open_mosaic(files, options_, dem_)) {
  for (const RasterFile& file : files_) {
    readers_.emplace_back(file, options_, on_earth(dem_));
    dem_.height_unit = readers_.back().unit_name();
  }
}

/// Tells put(column and row of the mosaic, heights, known) of each row of a file.
template <class Put>
DemSource DemWindows::read_file(std::size_t index, const Progress& progress, const Put& put) const {
  const RasterFile& file = files_[index];
  const auto width = static_cast<std::size_t>(file.columns);
  DemSource described = dem_.sources[index];
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> hash(XXH3_createState(),
                                                                             XXH3_freeState);
  XXH3_128bits_reset(hash.get());
  StoredValues stored;
  for (int first = 0; first < file.rows; first += kRowsPerRead) {
    const int count = std::min(kRowsPerRead, file.rows - first);
    readers_[index].read_values({0, first, file.columns, count}, stored);
    XXH3_128bits_update(hash.get(), stored.values.data(), stored.values.size() * sizeof(double));
    for (int r = 0; r < count; ++r) {
      const int row = first + r;
      const std::size_t begin = static_cast<std::size_t>(r) * width;
      const std::span<double> heights_m = std::span(stored.values).subspan(begin, width);
      const std::span<std::uint8_t> known = std::span(stored.mask).subspan(begin, width);
      readers_[index].to_metres(0, row, heights_m, known);
      described.samples +=
          width - static_cast<std::size_t>(std::count(known.begin(), known.end(), 0));
      put(file.first_column, file.first_row + (file.south_up ? file.rows - 1 - row : row),
          heights_m, known);
    }
    if (progress) progress(static_cast<double>(first + count) / file.rows);
  }
  const XXH128_hash_t digest = XXH3_128bits_digest(hash.get());
  described.checksum = fmt::format("{:016x}{:016x}", digest.high64, digest.low64);
  return described;
}

std::int32_t DemWindows::widest_columns() const {
  std::int32_t widest = 0;
  for (const RasterFile& file : files_) widest = std::max(widest, file.columns);
  return widest;
}

template <class Put>
std::vector<DemSource> DemWindows::read_files(const Progress& progress, const Put& put) const {
  std::vector<DemSource> sources;
  std::uint64_t known = 0;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const auto part = [&](double done) {
      if (progress) progress((static_cast<double>(i) + done) / static_cast<double>(files_.size()));
    };
    sources.push_back(read_file(i, part, put));
    known += sources.back().samples;
  }
  if (known == 0) refuse_void(names_.front());
  return sources;
}

std::vector<DemSource> DemWindows::check(const Progress& progress) const {
  return read_files(progress, [](std::int64_t, std::int64_t, std::span<const double>,
                                 std::span<const std::uint8_t>) {});
}

std::vector<DemSource> DemWindows::read_all(std::span<double> heights_m,
                                            std::span<std::uint8_t> known,
                                            const Progress& progress) const {
  assert(heights_m.size() == known.size());
  return read_files(progress, [&](std::int64_t column, std::int64_t row, std::span<double> values_m,
                                  std::span<const std::uint8_t> mask) {
    const std::size_t to = static_cast<std::size_t>(row) * static_cast<std::size_t>(dem_.columns) +
                           static_cast<std::size_t>(column);
    for (std::size_t c = 0; c < values_m.size(); ++c) {
      if (!mask[c]) continue;
      heights_m[to + c] = values_m[c];
      known[to + c] = 1;
    }
  });
}

HeightWindow DemWindows::read(const SampleRect& rect) const {
  assert(rect.columns > 0 && rect.rows > 0 && rect.first_column >= 0 && rect.first_row >= 0 &&
         rect.columns <= dem_.columns - rect.first_column &&
         rect.rows <= dem_.rows - rect.first_row);
  HeightWindow window;
  window.rect = rect;
  const std::size_t count =
      static_cast<std::size_t>(rect.columns) * static_cast<std::size_t>(rect.rows);
  window.heights_m.assign(count, 0);
  window.known.assign(count, 0);
  StoredValues stored;
  for (std::size_t i = 0; i < files_.size(); ++i) {
    // What the window and the file share, in samples of the mosaic.
    const RasterFile& file = files_[i];
    const std::int64_t low_column = std::max<std::int64_t>(rect.first_column, file.first_column);
    const std::int64_t low_row = std::max<std::int64_t>(rect.first_row, file.first_row);
    const std::int64_t high_column = std::min<std::int64_t>(
        std::int64_t{rect.first_column} + rect.columns, file.first_column + file.columns);
    const std::int64_t high_row = std::min<std::int64_t>(std::int64_t{rect.first_row} + rect.rows,
                                                         file.first_row + file.rows);
    if (low_column >= high_column || low_row >= high_row) continue;
    SampleRect part;
    part.first_column = static_cast<std::int32_t>(low_column - file.first_column);
    part.first_row = static_cast<std::int32_t>(low_row - file.first_row);
    part.columns = static_cast<std::int32_t>(high_column - low_column);
    part.rows = static_cast<std::int32_t>(high_row - low_row);
    if (file.south_up) part.first_row = file.rows - part.first_row - part.rows;
    readers_[i].read_values(part, stored);
    const auto width = static_cast<std::size_t>(part.columns);
    for (std::int32_t r = 0; r < part.rows; ++r) {
      const std::size_t begin = static_cast<std::size_t>(r) * width;
      const std::span<double> heights_m = std::span(stored.values).subspan(begin, width);
      const std::span<std::uint8_t> known = std::span(stored.mask).subspan(begin, width);
      readers_[i].to_metres(part.first_column, part.first_row + r, heights_m, known);
      const std::int64_t row = low_row + (file.south_up ? part.rows - 1 - r : r);
      const std::size_t to =
          static_cast<std::size_t>(row - rect.first_row) * static_cast<std::size_t>(rect.columns) +
          static_cast<std::size_t>(low_column - rect.first_column);
      for (std::size_t c = 0; c < width; ++c) {
        if (!known[c]) continue;
        window.heights_m[to + c] = heights_m[c];
        window.known[to + c] = 1;
      }
    }
  }
  return window;
}

/// Nominal cell size at the centre, and how far grid lines bend. Second differences are taken over
/// an eighth of the raster at height 0, where the lattice is negligible, and divided by the square
/// of that length; the map is smooth, so half as much again bounds what lies between.
CellMeasures measure_cells(const Dem& dem) {
  CellMeasures cells;
  const GeoFrame::Placer placer(*dem.frame);
  const auto at = [&](double column, double row) {
    return placer.place({dem.x_of(column), dem.y_of(row), 0});
  };
  const double middle_column = (dem.columns - 1) / 2.0, middle_row = (dem.rows - 1) / 2.0;
  const double reach_x = std::max(1.0, (dem.columns - 1) / 8.0),
               reach_y = std::max(1.0, (dem.rows - 1) / 8.0);
  cells.cell_x_m =
      plane_distance_m(at(middle_column - 1, middle_row), at(middle_column + 1, middle_row)) / 2;
  cells.cell_y_m =
      plane_distance_m(at(middle_column, middle_row - 1), at(middle_column, middle_row + 1)) / 2;
  if (dem.frame->description().earth == Earth::kFlat) return cells;
  constexpr int kStations = 7;
  constexpr double kBetweenStations = 1.5;
  const double cell_m = std::min(cells.cell_x_m, cells.cell_y_m);
  const auto bend = [&](double column, double row, double dx, double dy) {
    const Position a = at(column - dx, row - dy), b = at(column, row),
                   c = at(column + dx, row + dy);
    const Position middle{(a.x_m + c.x_m) / 2, (a.y_m + c.y_m) / 2, 0};
    // 4: half of a chord of two steps, so the sagitta over one step is a quarter
    return plane_distance_m(middle, b) / cell_m / (4 * std::max(dx * dx, dy * dy));
  };
  for (int i = 0; i < kStations; ++i) {
    for (int j = 0; j < kStations; ++j) {
      const double column = reach_x + (dem.columns - 1 - 2 * reach_x) * i / (kStations - 1);
      const double row = reach_y + (dem.rows - 1 - 2 * reach_y) * j / (kStations - 1);
      const double most =
          std::max({bend(column, row, reach_x, 0), bend(column, row, 0, reach_y),
                    bend(column, row, reach_x, reach_y), bend(column, row, reach_x, -reach_y)});
      cells.bend_cells = std::max(cells.bend_cells, kBetweenStations * most);
    }
  }
  return cells;
}

SampleGrid place_window(const Dem& dem, const HeightWindow& window) {
  return place_window(dem, window.rect, window.heights_m, window.known);
}

SampleGrid place_window(const Dem& dem, const SampleRect& rect, std::span<const double> heights_m,
                        std::span<const std::uint8_t> known) {
  SampleGrid grid;
  grid.columns = rect.columns;
  grid.rows = rect.rows;
  grid.known.assign(known.begin(), known.end());
  grid.positions.resize(heights_m.size());
  const auto columns = static_cast<std::size_t>(grid.columns);
  constexpr std::size_t kRowsPerBlock = 32;
  const std::size_t blocks =
      (static_cast<std::size_t>(grid.rows) + kRowsPerBlock - 1) / kRowsPerBlock;
  parallel_for(blocks, [&](std::size_t block) {
    const GeoFrame::Placer placer(*dem.frame);
    std::vector<MapPoint> points(columns);
    const std::size_t end =
        std::min((block + 1) * kRowsPerBlock, static_cast<std::size_t>(grid.rows));
    for (std::size_t row = block * kRowsPerBlock; row < end; ++row) {
      const double y = dem.y_of(rect.first_row + static_cast<double>(row));
      for (std::size_t c = 0; c < columns; ++c)
        points[c] = {dem.x_of(rect.first_column + static_cast<double>(c)), y,
                     heights_m[row * columns + c]};
      placer.place(points, std::span(grid.positions).subspan(row * columns, columns));
    }
  });
  const CellMeasures cells = measure_cells(dem);
  grid.cell_x_m = cells.cell_x_m;
  grid.cell_y_m = cells.cell_y_m;
  grid.bend_cells = cells.bend_cells;
  return grid;
}

void limit_raster_cache(std::uint64_t bytes) {
  GDALSetCacheMax64(static_cast<GIntBig>(bytes));
}

}  // namespace scarp
