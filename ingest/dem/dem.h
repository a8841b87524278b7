#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/terrain/ground_grid.h"
#include "core/terrain/sample_grid.h"
#include "core/threads/progress.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// How a DEM is to be read; every command that reads one has these options.
struct DemOptions {
  std::optional<Earth> earth;  ///< ellipsoid where there is a CRS, otherwise flat
  double refraction = 0;
  std::string geoid_file;
  std::optional<std::string> height_unit;  ///< m, ft or us-ft; overrides what the file says
  std::optional<double> nodata;            ///< a value that stands for void, besides the file's
  std::uint64_t memory_budget_bytes = 0;   ///< 0: no limit
  double more_bytes_per_sample = 0;        ///< that the command takes besides, of the budget
  /// Asked by read_ground, with the number of samples and the bytes that reading them takes
  /// besides, where the budget is too small: whether room was made for the arrays elsewhere. Empty:
  /// no.
  std::function<bool(double samples, double reading_bytes)> make_room;
};

/// What a sample takes in memory from reading to the finished mesh: height, position, marks, and
/// the mesher's share where the terrain needs every sample.
inline constexpr double kBytesPerSample = 160;

/// A file that heights were taken from.
struct DemSource {
  std::string name;  ///< without folder
  std::uint64_t size_bytes = 0;
  std::uint64_t samples = 0;  ///< that are known
  std::string checksum;       ///< XXH3-128 of the values as read (double), hexadecimal
};

/// A north-up raster of heights in metres, its place on the map, and the frame that places it.
struct Dem {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  /// GDAL's order: x of the upper left corner, cell width, 0, y of it, 0, minus cell height.
  std::array<double, 6> geotransform{};
  std::vector<double> heights_m;    ///< [rows * columns]; 0 where void
  std::vector<std::uint8_t> known;  ///< [rows * columns]
  std::shared_ptr<const GeoFrame> frame;
  std::vector<DemSource> sources;
  std::string height_unit;  ///< as read: m, ft or us-ft
  std::vector<std::string> warnings;

  double x_of(double column) const { return geotransform[0] + (column + 0.5) * geotransform[1]; }
  double y_of(double row) const { return geotransform[3] + (row + 0.5) * geotransform[5]; }
};

/// Reads one raster, or several that share CRS and cells as a mosaic: later files lie on top of
/// earlier ones, and what none covers is void. Void: the nodata value, the mask band, or
/// options.nodata. Scale, offset and height unit are applied.
///
/// Throws Error{kInput} with one line where a file is no raster of heights, is rotated, smaller
/// than 2 x 2, wholly void, holds NaN or infinite heights that are not declared, heights that no
/// ground has, an unknown unit, or does not fit the others.
Dem read_dem(const std::vector<std::string>& files, const DemOptions& options,
             const Progress& progress);

/// What a sample takes in memory as Ground: its height, and a share of the output's making.
inline constexpr double kBytesPerGroundSample = 12;

/// A DEM read straight into the compact surface `grid`.
struct Ground {
  Dem dem;  ///< without heights_m and known; sources without checksums
  GroundGrid grid;
};

/// Reads and places in one go, on as many threads as allowed, in 4 bytes a sample. The same files
/// are refused as by read_dem, and DEMs of more than about 5000 km.
/// Positions on the ellipsoid are interpolated (ground_placement.h).
Ground read_ground(const std::vector<std::string>& files, const DemOptions& options,
                   const Progress& progress);

/// Places every sample in the flattened frame, on as many threads as allowed.
SampleGrid place_samples(const Dem& dem);

}  // namespace scarp
