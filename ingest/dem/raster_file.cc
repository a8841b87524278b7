#include "ingest/dem/raster_file.h"

#include <cpl_conv.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "core/error/error.h"

namespace scarp {
namespace {

/// Files of a mosaic have to share their cells; this much of a cell may be rounding in their
/// headers.
constexpr double kGridMismatchCells = 0.01;

void read_geotransform(RasterFile& source) {
  double transform[6];
  if (source.dataset->GetGeoTransform(transform) != CE_None) {
    // A bare array: cells of one unit, row 0 on top.
    const double plain[6] = {0, 1, 0, static_cast<double>(source.rows), 0, -1};
    std::copy(plain, plain + 6, transform);
  }
  if (transform[2] != 0 || transform[4] != 0 || !(transform[1] > 0) || transform[5] == 0)
    refuse_file(
        source.file,
        "is rotated or mirrored; a north-up raster was expected; straighten it with gdalwarp");
  source.south_up = transform[5] > 0;
  if (source.south_up) {
    transform[3] += transform[5] * source.rows;
    transform[5] = -transform[5];
  }
  std::copy(transform, transform + 6, source.geotransform.begin());
}

bool same_crs(const OGRSpatialReference* a, const OGRSpatialReference* b) {
  if (!a || !b) return !a && !b;
  const char* const options[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT",
                                 nullptr};
  return a->IsSame(b, options) != 0;
}

/// Puts every source on the grid of the first and returns the mosaic's extent in dem.
void lay_out(std::vector<RasterFile>& sources, Dem& dem) {
  const RasterFile& first = sources.front();
  const auto& grid = first.geotransform;
  std::int64_t low_column = 0, low_row = 0, high_column = first.columns, high_row = first.rows;
  for (RasterFile& source : sources) {
    const auto& own = source.geotransform;
    if (!same_crs(first.dataset->GetSpatialRef(), source.dataset->GetSpatialRef()))
      refuse_file(source.file,
                  fmt::format("has another coordinate system than '{}'; one for all was "
                              "expected; warp one of them with gdalwarp -t_srs",
                              first.file));
    const double column = (own[0] - grid[0]) / grid[1], row = (own[3] - grid[3]) / grid[5];
    const double size = std::max(source.columns, source.rows);
    if (std::abs(own[1] / grid[1] - 1) * size > kGridMismatchCells ||
        std::abs(own[5] / grid[5] - 1) * size > kGridMismatchCells ||
        std::abs(column - std::round(column)) > kGridMismatchCells ||
        std::abs(row - std::round(row)) > kGridMismatchCells)
      refuse_file(
          source.file,
          fmt::format("does not share the cells of '{}'; equal cell sizes and whole offsets "
                      "were expected; warp one of them with gdalwarp -tr -tap",
                      first.file));
    source.first_column = std::llround(column);
    source.first_row = std::llround(row);
    low_column = std::min(low_column, source.first_column);
    low_row = std::min(low_row, source.first_row);
    high_column = std::max(high_column, source.first_column + source.columns);
    high_row = std::max(high_row, source.first_row + source.rows);
  }
  for (RasterFile& source : sources) {
    source.first_column -= low_column;
    source.first_row -= low_row;
  }
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (high_column - low_column > kMost || high_row - low_row > kMost)
    refuse_file(sources.back().file,
                "lies too far from the others for one mosaic; build them apart");
  dem.columns = static_cast<std::int32_t>(high_column - low_column);
  dem.rows = static_cast<std::int32_t>(high_row - low_row);
  dem.geotransform = grid;
  dem.geotransform[0] += static_cast<double>(low_column) * grid[1];
  dem.geotransform[3] += static_cast<double>(low_row) * grid[5];
}

/// The frame around the raster's centre.
void make_frame(const RasterFile& first, const DemOptions& options, Dem& dem) {
  FrameDescription frame;
  const OGRSpatialReference* crs = first.dataset->GetSpatialRef();
  if (crs && !crs->IsEmpty()) {
    char* text = nullptr;
    const char* const wkt_options[] = {"FORMAT=WKT2_2019", nullptr};
    if (crs->exportToWkt(&text, wkt_options) == OGRERR_NONE && text) frame.crs_wkt = text;
    CPLFree(text);
  }
  frame.earth = options.earth.value_or(frame.crs_wkt.empty() ? Earth::kFlat : Earth::kEllipsoid);
  frame.refraction = options.refraction;
  frame.geoid_file = options.geoid_file;
  frame.centre_x = dem.x_of((dem.columns - 1) / 2.0);
  frame.centre_y = dem.y_of((dem.rows - 1) / 2.0);
  dem.frame = std::make_shared<const GeoFrame>(frame);
}

/// Name and size of a file; what should be said about it goes to the warnings.
DemSource describe(const RasterFile& source, Dem& dem) {
  DemSource described;
  described.name = std::filesystem::path(source.file).filename().string();
  VSIStatBufL status;
  if (VSIStatL(source.file.c_str(), &status) == 0)
    described.size_bytes = static_cast<std::uint64_t>(status.st_size);
  if (source.dataset->GetRasterCount() > 1)
    dem.warnings.push_back(fmt::format("'{}' has {} bands; the first is taken as heights",
                                       described.name, source.dataset->GetRasterCount()));
  return described;
}

}  // namespace

void refuse_file(const std::string& file, const std::string& rest) {
  throw Error(ErrorCode::kInput, fmt::format("'{}': {}", file, rest));
}

void refuse_void(const std::string& file) {
  refuse_file(file,
              "all samples are void; heights were expected; is its nodata value declared right? "
              "(gdalinfo shows it)");
}

bool on_earth(const Dem& dem) {
  return dem.frame->description().earth == Earth::kEllipsoid;
}

RasterFile open_raster_file(const std::string& file) {
  RasterFile source;
  source.file = file;
  source.dataset = open_dataset(file, GDAL_OF_RASTER, "a raster that GDAL reads");
  source.columns = source.dataset->GetRasterXSize();
  source.rows = source.dataset->GetRasterYSize();
  if (source.dataset->GetRasterCount() < 1)
    refuse_file(
        file,
        "holds no raster band; one band of heights was expected; name one of its subdatasets "
        "(gdalinfo lists them)");
  source.band = source.dataset->GetRasterBand(1);
  const GDALColorInterp colour = source.band->GetColorInterpretation();
  if (colour == GCI_RedBand || colour == GCI_PaletteIndex)
    refuse_file(
        file,
        "is a picture in colours; a band of heights was expected; decode it to heights first");
  if (GDALDataTypeIsComplex(source.band->GetRasterDataType()))
    refuse_file(
        file, "holds complex numbers; a band of heights was expected; extract the real part first");
  if (source.columns < 2 || source.rows < 2)
    refuse_file(
        file,
        fmt::format("has {} x {} samples; at least 2 x 2 were expected; a surface needs cells",
                    source.columns, source.rows));
  read_geotransform(source);
  return source;
}

std::vector<RasterFile> open_mosaic(const std::vector<std::string>& files,
                                    const DemOptions& options, Dem& dem) {
  std::vector<RasterFile> sources;
  for (const std::string& file : files) sources.push_back(open_raster_file(file));
  lay_out(sources, dem);
  make_frame(sources.front(), options, dem);
  for (const RasterFile& source : sources) dem.sources.push_back(describe(source, dem));
  return sources;
}

}  // namespace scarp
