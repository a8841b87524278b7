#include "ingest/dem/dem.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <span>

#include "core/error/error.h"
#include "core/memory/large_array.h"
#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"
#include "ingest/dem/gdal_session.h"
#include "ingest/dem/ground_placement.h"

namespace scarp {
namespace {

/// Ground lies between these on every solid body that has been surveyed (deepest trench 10.9 km,
/// Olympus Mons 21.9 km): what is beyond is a nodata value that nobody declared.
constexpr double kLowestGroundM = -12'000;
constexpr double kHighestGroundM = 30'000;

/// Files of a mosaic have to share their cells; this much of a cell may be rounding in their
/// headers.
constexpr double kGridMismatchCells = 0.01;

constexpr int kRowsPerRead = 64;

/// Pieces that a file is read in at once, so that threads end together.
constexpr int kBandsPerThread = 4;

[[noreturn]] void refuse(const std::string& file, const std::string& rest) {
  throw Error(ErrorCode::kInput, fmt::format("'{}': {}", file, rest));
}

/// One opened file and where it lies on the mosaic's grid.
struct Source {
  std::string file;
  DatasetPtr dataset;
  GDALRasterBand* band = nullptr;
  std::array<double, 6> geotransform{};
  int columns = 0, rows = 0;
  bool south_up = false;
  std::int64_t first_column = 0, first_row = 0;  // on the mosaic
};

void read_geotransform(Source& source) {
  double transform[6];
  if (source.dataset->GetGeoTransform(transform) != CE_None) {
    // A bare array: cells of one unit, row 0 on top.
    const double plain[6] = {0, 1, 0, static_cast<double>(source.rows), 0, -1};
    std::copy(plain, plain + 6, transform);
  }
  if (transform[2] != 0 || transform[4] != 0 || !(transform[1] > 0) || transform[5] == 0)
    refuse(source.file,
           "is rotated or mirrored; a north-up raster was expected; straighten it with gdalwarp");
  source.south_up = transform[5] > 0;
  if (source.south_up) {
    transform[3] += transform[5] * source.rows;
    transform[5] = -transform[5];
  }
  std::copy(transform, transform + 6, source.geotransform.begin());
}

Source open_source(const std::string& file) {
  Source source;
  source.file = file;
  source.dataset = open_dataset(file, GDAL_OF_RASTER, "a raster that GDAL reads");
  source.columns = source.dataset->GetRasterXSize();
  source.rows = source.dataset->GetRasterYSize();
  if (source.dataset->GetRasterCount() < 1)
    refuse(file,
           "holds no raster band; one band of heights was expected; name one of its subdatasets "
           "(gdalinfo lists them)");
  source.band = source.dataset->GetRasterBand(1);
  const GDALColorInterp colour = source.band->GetColorInterpretation();
  if (colour == GCI_RedBand || colour == GCI_PaletteIndex)
    refuse(file,
           "is a picture in colours; a band of heights was expected; decode it to heights first");
  if (GDALDataTypeIsComplex(source.band->GetRasterDataType()))
    refuse(file,
           "holds complex numbers; a band of heights was expected; extract the real part first");
  if (source.columns < 2 || source.rows < 2)
    refuse(file,
           fmt::format("has {} x {} samples; at least 2 x 2 were expected; a surface needs cells",
                       source.columns, source.rows));
  read_geotransform(source);
  return source;
}

bool same_crs(const OGRSpatialReference* a, const OGRSpatialReference* b) {
  if (!a || !b) return !a && !b;
  const char* const options[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT",
                                 nullptr};
  return a->IsSame(b, options) != 0;
}

/// Puts every source on the grid of the first and returns the mosaic's extent in dem.
void lay_out(std::vector<Source>& sources, Dem& dem) {
  const Source& first = sources.front();
  const auto& grid = first.geotransform;
  std::int64_t low_column = 0, low_row = 0, high_column = first.columns, high_row = first.rows;
  for (Source& source : sources) {
    const auto& own = source.geotransform;
    if (!same_crs(first.dataset->GetSpatialRef(), source.dataset->GetSpatialRef()))
      refuse(source.file, fmt::format("has another coordinate system than '{}'; one for all was "
                                      "expected; warp one of them with gdalwarp -t_srs",
                                      first.file));
    const double column = (own[0] - grid[0]) / grid[1], row = (own[3] - grid[3]) / grid[5];
    const double size = std::max(source.columns, source.rows);
    if (std::abs(own[1] / grid[1] - 1) * size > kGridMismatchCells ||
        std::abs(own[5] / grid[5] - 1) * size > kGridMismatchCells ||
        std::abs(column - std::round(column)) > kGridMismatchCells ||
        std::abs(row - std::round(row)) > kGridMismatchCells)
      refuse(source.file,
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
  for (Source& source : sources) {
    source.first_column -= low_column;
    source.first_row -= low_row;
  }
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (high_column - low_column > kMost || high_row - low_row > kMost)
    refuse(sources.back().file, "lies too far from the others for one mosaic; build them apart");
  dem.columns = static_cast<std::int32_t>(high_column - low_column);
  dem.rows = static_cast<std::int32_t>(high_row - low_row);
  dem.geotransform = grid;
  dem.geotransform[0] += static_cast<double>(low_column) * grid[1];
  dem.geotransform[3] += static_cast<double>(low_row) * grid[5];
}

struct HeightUnit {
  const char* name;
  double metres;
};
constexpr HeightUnit kMetre{"m", 1}, kFoot{"ft", 0.3048}, kSurveyFoot{"us-ft", 1200.0 / 3937.0};

std::optional<HeightUnit> parse_unit(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* name : {"m", "metre", "meter", "metres", "meters"})
    if (text == name) return kMetre;
  for (const char* name : {"ft", "foot", "feet", "international foot", "international feet"})
    if (text == name) return kFoot;
  for (const char* name :
       {"us-ft", "ftus", "us ft", "us survey foot", "us survey feet", "us_survey_foot", "foot_us"})
    if (text == name) return kSurveyFoot;
  return {};
}

HeightUnit height_unit_of(const Source& source, const DemOptions& options) {
  if (options.height_unit) {
    if (const auto unit = parse_unit(*options.height_unit)) return *unit;
    throw Error(ErrorCode::kInput,
                fmt::format("--height-unit {}: not known; m, ft or us-ft was expected",
                            *options.height_unit));
  }
  const std::string declared = source.band->GetUnitType();
  if (!declared.empty()) {
    if (const auto unit = parse_unit(declared)) return *unit;
    refuse(source.file, fmt::format("height unit \"{}\" is not known; a length unit was expected; "
                                    "give --height-unit m|ft|us-ft",
                                    declared));
  }
  const OGRSpatialReference* crs = source.dataset->GetSpatialRef();
  if (crs && (crs->IsCompound() || crs->IsVertical())) {
    const char* name = nullptr;
    const double metres = crs->GetTargetLinearUnits("VERT_CS", &name);
    if (std::abs(metres - kFoot.metres) < 1e-9) return kFoot;
    if (std::abs(metres - kSurveyFoot.metres) < 1e-9) return kSurveyFoot;
    if (metres != 1)
      refuse(source.file, fmt::format("height unit \"{}\" of its vertical CRS is not known; a "
                                      "length unit was expected; give --height-unit m|ft|us-ft",
                                      name ? name : ""));
  }
  return kMetre;
}

/// (value * scale + offset) * metres in place, if all known ones come to lie between low and high
/// then; otherwise nothing. @return whether they did
SCARP_FOR_EACH_TARGET
bool convert_to_metres(std::size_t count, const std::uint8_t* __restrict known, double scale,
                       double offset, double metres, double low_m, double high_m,
                       double* __restrict values) {
  std::int32_t wrong = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double height_m = (values[i] * scale + offset) * metres;
    const std::int32_t right = (height_m >= low_m ? 1 : 0) & (height_m <= high_m ? 1 : 0);
    wrong |= (known[i] != 0 ? 1 : 0) & (right ^ 1);
  }
  if (wrong != 0) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const double height_m = (values[i] * scale + offset) * metres;
    values[i] = known[i] != 0 ? height_m : 0;
  }
  return true;
}

/// Is any value within reach of another, or no number?
template <typename Value>
bool any_near(std::size_t count, const Value* values, double to, double reach) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double off = std::abs(static_cast<double>(values[i]) - to);
    any |= off > reach ? 0 : 1;
  }
  return any != 0;
}

/// Reads one file into its place; heights leave here in metres.
class HeightReader {
 public:
  HeightReader(const Source& source, const DemOptions& options, bool on_earth)
      : source_(source),
        options_(options),
        on_earth_(on_earth),
        unit_(height_unit_of(source, options)) {
    int found = 0;
    scale_ = source.band->GetScale(&found);
    if (!found || scale_ == 0) scale_ = 1;
    offset_ = source.band->GetOffset(&found);
    if (!found) offset_ = 0;
    has_mask_ = (source.band->GetMaskFlags() & GMF_ALL_VALID) == 0;
  }

  const char* unit_name() const { return unit_.name; }

  /// @return how many heights the file gave
  std::uint64_t read_into(Dem& dem, const Progress& progress, std::string& checksum) {
    std::uint64_t known = 0;
    const auto width = static_cast<std::size_t>(source_.columns);
    std::vector<double> values(width * kRowsPerRead);
    std::vector<std::uint8_t> mask(width * kRowsPerRead, 255);
    const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> hash(XXH3_createState(),
                                                                               XXH3_freeState);
    XXH3_128bits_reset(hash.get());
    for (int row = 0; row < source_.rows; row += kRowsPerRead) {
      const int count = std::min(kRowsPerRead, source_.rows - row);
      read_rows(row, count, values, mask);
      XXH3_128bits_update(hash.get(), values.data(),
                          width * static_cast<std::size_t>(count) * sizeof(double));
      for (int r = 0; r < count; ++r) {
        const int file_row = row + r;
        const int up_row = source_.south_up ? source_.rows - 1 - file_row : file_row;
        const std::size_t to = static_cast<std::size_t>(source_.first_row + up_row) *
                                   static_cast<std::size_t>(dem.columns) +
                               static_cast<std::size_t>(source_.first_column);
        for (std::size_t c = 0; c < width; ++c) {
          const std::size_t from = static_cast<std::size_t>(r) * width + c;
          if (!mask[from] || (options_.nodata && values[from] == *options_.nodata)) continue;
          dem.heights_m[to + c] = metres(values[from], c, file_row);
          dem.known[to + c] = 1;
          ++known;
        }
      }
      if (progress) progress(static_cast<double>(row + count) / source_.rows);
    }
    const XXH128_hash_t digest = XXH3_128bits_digest(hash.get());
    checksum = fmt::format("{:016x}{:016x}", digest.high64, digest.low64);
    return known;
  }

  /// Heights in metres, row by row: put(row from the north, heights, known).
  template <typename Put>
  void read_rows_to(int first_row, int end_row, const Put& put) {
    if (source_.band->GetRasterDataType() == GDT_Float32)
      read_rows_as<float>(first_row, end_row, put);
    else
      read_rows_as<double>(first_row, end_row, put);
  }

 private:
  /// @tparam Value  that holds all values of the file
  template <typename Value, typename Put>
  void read_rows_as(int first_row, int end_row, const Put& put) {
    const auto width = static_cast<std::size_t>(source_.columns);
    std::vector<Value> values(width * kRowsPerRead);
    std::vector<std::uint8_t> mask(width * kRowsPerRead, 255);
    std::vector<double> of_row(width);
    for (int row = first_row; row < end_row; row += kRowsPerRead) {
      const int count = std::min(kRowsPerRead, end_row - row);
      read_rows(row, count, values, mask);
      for (int r = 0; r < count; ++r) {
        const Value* from = &values[static_cast<std::size_t>(r) * width];
        std::copy(from, from + width, of_row.begin());
        std::uint8_t* known = &mask[static_cast<std::size_t>(r) * width];
        if (options_.nodata)
          for (std::size_t c = 0; c < width; ++c)
            if (of_row[c] == *options_.nodata) known[c] = 0;
        if (!convert(of_row, known))
          for (std::size_t c = 0; c < width; ++c)
            if (known[c]) metres(of_row[c], c, row + r);  // refuses the first that is wrong
        put(source_.south_up ? source_.rows - 1 - (row + r) : row + r, std::span<double>(of_row),
            known);
        if (options_.nodata) std::fill(known, known + width, std::uint8_t{255});
      }
      relieve_large_memory();
    }
  }

  template <typename Value>
  void read_rows(int row, int count, std::vector<Value>& values, std::vector<std::uint8_t>& mask) {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
    constexpr GDALDataType kType = sizeof(Value) == sizeof(float) ? GDT_Float32 : GDT_Float64;
    CPLErr result = source_.band->RasterIO(GF_Read, 0, row, source_.columns, count, values.data(),
                                           source_.columns, count, kType, 0, 0);
    const auto size = static_cast<std::size_t>(source_.columns) * static_cast<std::size_t>(count);
    if (result == CE_None && has_mask_) {
      if (may_be_void(std::span<const Value>(values.data(), size)))
        result = source_.band->GetMaskBand()->RasterIO(GF_Read, 0, row, source_.columns, count,
                                                       mask.data(), source_.columns, count,
                                                       GDT_Byte, 0, 0);
      else
        std::fill_n(mask.begin(), size, std::uint8_t{255});
    }
    const std::string reason = CPLGetLastErrorMsg();
    CPLPopErrorHandler();
    if (result != CE_None)
      refuse(source_.file,
             fmt::format("cannot be read at row {} of {} ({}); the whole raster was "
                         "expected; is the file complete?",
                         row, source_.rows, reason.empty() ? "too few bytes" : reason));
  }

  /// Can the mask differ from "all known"? Where it stands for a nodata value only, it is as costly
  /// as the heights, and mostly nothing is near that value.
  template <typename Value>
  bool may_be_void(std::span<const Value> values) const {
    const GDALDataType type = source_.band->GetRasterDataType();
    if (source_.band->GetMaskFlags() != GMF_NODATA || type == GDT_Int64 || type == GDT_UInt64)
      return true;
    const double nodata = source_.band->GetNoDataValue();
    // GDAL takes values for equal that differ in their last bits.
    constexpr double kNearly = 1e-4;
    return std::isnan(nodata)
               ? any_near(values.size(), values.data(), 0.0, -1.0)
               : any_near(values.size(), values.data(), nodata, kNearly * std::abs(nodata));
  }

  /// Known values to metres, all of a row; where one is no height, nothing is done.
  /// @return whether all are heights
  bool convert(std::span<double> values, const std::uint8_t* known) const {
    const double low_m = on_earth_ ? kLowestGroundM : -kLatticeReachM;
    const double high_m = on_earth_ ? kHighestGroundM : kLatticeReachM;
    return convert_to_metres(values.size(), known, scale_, offset_, unit_.metres, low_m, high_m,
                             values.data());
  }

  double metres(double value, std::size_t column, int row) const {
    if (!std::isfinite(value))
      refuse(
          source_.file,
          fmt::format("height {} at column {}, row {} is not a number, and not declared as nodata; "
                      "give --nodata nan, or declare it with gdal_translate -a_nodata nan",
                      value, column, row));
    const double height_m = (value * scale_ + offset_) * unit_.metres;
    const bool possible = on_earth_ ? height_m >= kLowestGroundM && height_m <= kHighestGroundM
                                    : std::abs(height_m) < kLatticeReachM;
    if (!possible)
      refuse(source_.file,
             fmt::format("height {:.10g} m at column {}, row {} is no ground; heights from {} to "
                         "{} m were expected; if it stands for void, give --nodata {:.10g}",
                         height_m, column, row, kLowestGroundM, kHighestGroundM, value));
    return height_m;
  }

  const Source& source_;
  const DemOptions& options_;
  bool on_earth_;
  HeightUnit unit_;
  double scale_ = 1, offset_ = 0;
  bool has_mask_ = false;
};

/// Distance in the plane.
double plane_distance_m(const Position& a, const Position& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

/// Nominal cell size at the centre, and how far grid lines bend. Second differences are taken over
/// an eighth of the raster at height 0, where the lattice is negligible, and divided by the square
/// of that length; the map is smooth, so half as much again bounds what lies between.
void measure_cells(const Dem& dem, SampleGrid& grid) {
  const GeoFrame::Placer placer(*dem.frame);
  const auto at = [&](double column, double row) {
    return placer.place({dem.x_of(column), dem.y_of(row), 0});
  };
  const double middle_column = (dem.columns - 1) / 2.0, middle_row = (dem.rows - 1) / 2.0;
  const double reach_x = std::max(1.0, (dem.columns - 1) / 8.0),
               reach_y = std::max(1.0, (dem.rows - 1) / 8.0);
  grid.cell_x_m =
      plane_distance_m(at(middle_column - 1, middle_row), at(middle_column + 1, middle_row)) / 2;
  grid.cell_y_m =
      plane_distance_m(at(middle_column, middle_row - 1), at(middle_column, middle_row + 1)) / 2;
  if (dem.frame->description().earth == Earth::kFlat) return;
  constexpr int kStations = 7;
  constexpr double kBetweenStations = 1.5;
  const double cell_m = std::min(grid.cell_x_m, grid.cell_y_m);
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
      grid.bend_cells = std::max(grid.bend_cells, kBetweenStations * most);
    }
  }
}

/// The frame around the raster's centre.
void make_frame(const Source& first, const DemOptions& options, Dem& dem) {
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

bool on_earth(const Dem& dem) {
  return dem.frame->description().earth == Earth::kEllipsoid;
}

/// Name and size of a file; what should be said about it goes to the warnings.
DemSource describe(const Source& source, Dem& dem) {
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

[[noreturn]] void refuse_void(const std::string& file) {
  refuse(file,
         "all samples are void; heights were expected; is its nodata value declared right? "
         "(gdalinfo shows it)");
}

/// Rows of one file straight into the grid. Each call opens the file for itself, so that calls may
/// run at once.
/// @return how many heights it gave
std::uint64_t read_rows_into(GroundGrid& grid, const Dem& dem, const Source& source,
                             const DemOptions& options, int first_row, int end_row) {
  Source own = open_source(source.file);
  own.first_column = source.first_column;
  own.first_row = source.first_row;
  HeightReader reader(own, options, on_earth(dem));
  const bool add_undulation = !dem.frame->description().geoid_file.empty();
  const GeoFrame::Placer placer(*dem.frame);
  std::uint64_t known_count = 0;
  const auto put = [&](int up_row, std::span<double> heights_m, const std::uint8_t* known) {
    const auto row = static_cast<std::int32_t>(own.first_row + up_row);
    const auto column = static_cast<std::int32_t>(own.first_column);
    for (std::size_t c = 0; c < heights_m.size(); ++c) {
      known_count += known[c] != 0;
      if (add_undulation && known[c])
        heights_m[c] +=
            placer.undulation_m(dem.x_of(column + static_cast<double>(c)), dem.y_of(row));
    }
    if (!grid.set_heights(row, column, heights_m, known))
      refuse(own.file,
             "reaches too far around the Earth for one frame (heights of 500 km and more); a "
             "smaller piece was expected; cut it with gdal_translate -projwin");
  };
  reader.read_rows_to(first_row, end_row, put);
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
double reading_bytes(const std::vector<Source>& sources) {
  double most = 0;
  for (const Source& source : sources) {
    int block_columns = 1, block_rows = 1;
    source.band->GetBlockSize(&block_columns, &block_rows);
    most = std::max(most, static_cast<double>(block_rows) * (source.columns + block_columns) *
                              GDALGetDataTypeSizeBytes(source.band->GetRasterDataType()));
  }
  constexpr double kLeast = 4e6;
  return std::max(kLeast, thread_count() * most);
}

/// Makes room elsewhere, or refuses.
void make_room(const Dem& dem, const DemOptions& options, const std::vector<Source>& sources) {
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
  Dem dem;
  std::vector<Source> sources;
  for (const std::string& file : files) sources.push_back(open_source(file));
  lay_out(sources, dem);
  check_memory(dem, options, kBytesPerSample, files.front());

  make_frame(sources.front(), options, dem);

  const std::size_t count =
      static_cast<std::size_t>(dem.columns) * static_cast<std::size_t>(dem.rows);
  dem.heights_m.assign(count, 0);
  dem.known.assign(count, 0);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const Source& source = sources[i];
    HeightReader reader(source, options, on_earth(dem));
    DemSource described = describe(source, dem);
    described.samples = reader.read_into(
        dem,
        [&](double done) {
          if (progress)
            progress((static_cast<double>(i) + done) / static_cast<double>(sources.size()));
        },
        described.checksum);
    dem.height_unit = reader.unit_name();
    dem.sources.push_back(described);
  }
  if (std::find(dem.known.begin(), dem.known.end(), 1) == dem.known.end())
    refuse_void(files.front());
  return dem;
}

Ground read_ground(const std::vector<std::string>& files, const DemOptions& options,
                   const Progress& progress) {
  Ground ground;
  Dem& dem = ground.dem;
  std::vector<Source> sources;
  for (const std::string& file : files) sources.push_back(open_source(file));
  lay_out(sources, dem);
  make_room(dem, options, sources);
  make_frame(sources.front(), options, dem);
  ground.grid = GroundGrid(dem.columns, dem.rows, ground_placement(dem));
  std::uint64_t known = 0;
  for (const Source& source : sources) {
    dem.sources.push_back(describe(source, dem));
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
    dem.sources.back().samples =
        std::accumulate(known_in_band.begin(), known_in_band.end(), std::uint64_t{0});
    known += dem.sources.back().samples;
    if (progress)
      progress(static_cast<double>(dem.sources.size()) / static_cast<double>(sources.size()));
  }
  if (known == 0) refuse_void(files.front());
  return ground;
}

SampleGrid place_samples(const Dem& dem) {
  SampleGrid grid;
  grid.columns = dem.columns;
  grid.rows = dem.rows;
  grid.known = dem.known;
  grid.positions.resize(dem.heights_m.size());
  const auto columns = static_cast<std::size_t>(dem.columns);
  constexpr std::size_t kRowsPerBlock = 32;
  const std::size_t blocks =
      (static_cast<std::size_t>(dem.rows) + kRowsPerBlock - 1) / kRowsPerBlock;
  parallel_for(blocks, [&](std::size_t block) {
    const GeoFrame::Placer placer(*dem.frame);
    std::vector<MapPoint> points(columns);
    const std::size_t end =
        std::min((block + 1) * kRowsPerBlock, static_cast<std::size_t>(dem.rows));
    for (std::size_t row = block * kRowsPerBlock; row < end; ++row) {
      for (std::size_t c = 0; c < columns; ++c)
        points[c] = {dem.x_of(static_cast<double>(c)), dem.y_of(static_cast<double>(row)),
                     dem.heights_m[row * columns + c]};
      placer.place(points, std::span(grid.positions).subspan(row * columns, columns));
    }
  });
  measure_cells(dem, grid);
  return grid;
}

}  // namespace scarp
