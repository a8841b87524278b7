#include "ingest/dem/height_reader.h"

#include <cpl_error.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <string>

#include "core/error/error.h"
#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

/// Ground lies between these on every solid body that has been surveyed (deepest trench 10.9 km,
/// Olympus Mons 21.9 km): what is beyond is a nodata value that nobody declared.
constexpr double kLowestGroundM = -12'000;
constexpr double kHighestGroundM = 30'000;

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

HeightUnit height_unit_of(const RasterFile& source, const DemOptions& options) {
  if (options.height_unit) {
    if (const auto unit = parse_unit(*options.height_unit)) return *unit;
    throw Error(ErrorCode::kInput,
                fmt::format("--height-unit {}: not known; m, ft or us-ft was expected",
                            *options.height_unit));
  }
  const std::string declared = source.band->GetUnitType();
  if (!declared.empty()) {
    if (const auto unit = parse_unit(declared)) return *unit;
    refuse_file(source.file,
                fmt::format("height unit \"{}\" is not known; a length unit was expected; "
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
      refuse_file(source.file,
                  fmt::format("height unit \"{}\" of its vertical CRS is not known; a "
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
bool any_near(std::span<const double> values, double to, double reach) {
  std::int32_t any = 0;
  for (const double value : values) any |= std::abs(value - to) > reach ? 0 : 1;
  return any != 0;
}

}  // namespace

HeightReader::HeightReader(const RasterFile& source, const DemOptions& options, bool on_earth)
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

void HeightReader::read_values(const SampleRect& rect, StoredValues& stored) const {
  const std::size_t count =
      static_cast<std::size_t>(rect.columns) * static_cast<std::size_t>(rect.rows);
  stored.values.resize(count);
  stored.mask.assign(count, 255);
  CPLPushErrorHandler(CPLQuietErrorHandler);
  CPLErrorReset();
  CPLErr result =
      source_.band->RasterIO(GF_Read, rect.first_column, rect.first_row, rect.columns, rect.rows,
                             stored.values.data(), rect.columns, rect.rows, GDT_Float64, 0, 0);
  if (result == CE_None && has_mask_ && may_be_void(stored.values))
    result = source_.band->GetMaskBand()->RasterIO(GF_Read, rect.first_column, rect.first_row,
                                                   rect.columns, rect.rows, stored.mask.data(),
                                                   rect.columns, rect.rows, GDT_Byte, 0, 0);
  const std::string reason = CPLGetLastErrorMsg();
  CPLPopErrorHandler();
  if (result != CE_None)
    refuse_file(
        source_.file,
        fmt::format("cannot be read at row {} of {} ({}); the whole raster was "
                    "expected; is the file complete?",
                    rect.first_row, source_.rows, reason.empty() ? "too few bytes" : reason));
}

bool HeightReader::may_be_void(std::span<const double> values) const {
  const GDALDataType type = source_.band->GetRasterDataType();
  if (source_.band->GetMaskFlags() != GMF_NODATA || type == GDT_Int64 || type == GDT_UInt64)
    return true;
  const double nodata = source_.band->GetNoDataValue();
  // GDAL takes values for equal that differ in their last bits.
  constexpr double kNearly = 1e-4;
  return std::isnan(nodata) ? any_near(values, 0.0, -1.0)
                            : any_near(values, nodata, kNearly * std::abs(nodata));
}

void HeightReader::to_metres(std::int32_t column, std::int32_t row, std::span<double> values,
                             std::span<std::uint8_t> mask) const {
  assert(values.size() == mask.size());
  if (options_.nodata)
    for (std::size_t c = 0; c < values.size(); ++c)
      if (values[c] == *options_.nodata) mask[c] = 0;
  const double low_m = on_earth_ ? kLowestGroundM : -kLatticeReachM;
  const double high_m = on_earth_ ? kHighestGroundM : kLatticeReachM;
  if (convert_to_metres(values.size(), mask.data(), scale_, offset_, unit_.metres, low_m, high_m,
                        values.data()))
    return;
  for (std::size_t c = 0; c < values.size(); ++c)
    if (mask[c]) check_height(values[c], column + static_cast<std::int32_t>(c), row);
}

void HeightReader::check_height(double value, std::int32_t column, std::int32_t row) const {
  if (!std::isfinite(value))
    refuse_file(
        source_.file,
        fmt::format("height {} at column {}, row {} is not a number, and not declared as nodata; "
                    "give --nodata nan, or declare it with gdal_translate -a_nodata nan",
                    value, column, row));
  const double height_m = (value * scale_ + offset_) * unit_.metres;
  const bool possible = on_earth_ ? height_m >= kLowestGroundM && height_m <= kHighestGroundM
                                  : std::abs(height_m) < kLatticeReachM;
  if (!possible)
    refuse_file(
        source_.file,
        fmt::format("height {:.10g} m at column {}, row {} is no ground; heights from {} to "
                    "{} m were expected; if it stands for void, give --nodata {:.10g}",
                    height_m, column, row, kLowestGroundM, kHighestGroundM, value));
}

}  // namespace scarp
