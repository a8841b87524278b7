#include "ingest/observers/observers.h"

#include <cpl_error.h>
#include <fmt/format.h>
#include <ogrsf_frmts.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>

#include "core/error/error.h"
#include "ingest/dem/gdal_session.h"

namespace scarp {
namespace {

[[noreturn]] void refuse(const std::string& file, const std::string& rest) {
  throw Error(ErrorCode::kInput, fmt::format("'{}': {}", file, rest));
}

/// Conversion of a layer's points to the data's CRS; nothing where they are taken as they are.
TransformationPtr conversion_of(OGRLayer& layer, const std::string& file,
                                const std::string& data_crs_wkt, const std::string& crs) {
  OGRSpatialReference from, to;
  const OGRSpatialReference* own = layer.GetSpatialRef();
  if (own && !own->IsEmpty())
    from = *own;
  else if (crs.empty())
    return nullptr;
  else if (from.SetFromUserInput(crs.c_str()) != OGRERR_NONE)
    refuse(file,
           fmt::format("--crs {}: not known; a name such as OGC:CRS84, or WKT, was expected", crs));
  if (data_crs_wkt.empty()) {
    if (!crs.empty())
      refuse(file, "the data have no coordinate system to convert to; leave --crs out");
    return nullptr;
  }
  to.SetFromUserInput(data_crs_wkt.c_str());
  for (OGRSpatialReference* reference : {&from, &to}) {
    reference->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    reference->StripVertical();
  }
  TransformationPtr made(OGRCreateCoordinateTransformation(&from, &to));
  if (!made)
    refuse(file, fmt::format("its coordinate system \"{}\" cannot be converted to that of the DEM; "
                             "convert it with ogr2ogr -t_srs",
                             from.GetName() ? from.GetName() : ""));
  return made;
}

/// Reads attributes of one feature as numbers.
class Attributes {
 public:
  Attributes(OGRFeature& feature, const std::string& file) : feature_(feature), file_(file) {}

  std::optional<double> number(const char* name) const {
    const int field = feature_.GetFieldIndex(name);
    if (field < 0 || !feature_.IsFieldSetAndNotNull(field)) return {};
    const char* text = feature_.GetFieldAsString(field);
    if (*text == '\0') return {};
    double value = 0;
    switch (feature_.GetFieldDefnRef(field)->GetType()) {
      case OFTInteger:
      case OFTInteger64:
      case OFTReal:
        value = feature_.GetFieldAsDouble(field);
        break;
      default: {
        const char* last = text + std::strlen(text);
        const auto [end, failed] = std::from_chars(text, last, value);
        if (failed != std::errc() || end != last) value = NAN;
      }
    }
    if (!std::isfinite(value))
      refuse(file_, fmt::format("feature {}: attribute \"{}\" is \"{}\"; a number was expected",
                                feature_.GetFID(), name, text));
    return value;
  }

  std::optional<std::pair<double, double>> place() const {
    for (const auto& [x_name, y_name] :
         {std::pair("x", "y"), {"lon", "lat"}, {"longitude", "latitude"}}) {
      const auto x = number(x_name), y = number(y_name);
      if (x && y) return std::pair(*x, *y);
    }
    return {};
  }

  std::string text(const char* name) const {
    const int field = feature_.GetFieldIndex(name);
    return field >= 0 && feature_.IsFieldSetAndNotNull(field) ? feature_.GetFieldAsString(field)
                                                              : "";
  }

 private:
  OGRFeature& feature_;
  const std::string& file_;
};

ObserverRecord record_of(const Attributes& attributes, const OGRPoint& point) {
  ObserverRecord record;
  record.x = point.getX();
  record.y = point.getY();
  record.name = attributes.text("name");
  record.height_m = attributes.number("height");
  record.elevation_m = attributes.number("elevation");
  record.target_height_m = attributes.number("target_height");
  record.min_distance_m = attributes.number("min_distance");
  record.max_distance_m = attributes.number("max_distance");
  if (!record.max_distance_m) record.max_distance_m = attributes.number("radius");
  record.azimuth_from_deg = attributes.number("azimuth_from");
  record.azimuth_to_deg = attributes.number("azimuth_to");
  record.pitch_lowest_deg = attributes.number("pitch_low");
  record.pitch_highest_deg = attributes.number("pitch_high");
  return record;
}

void check(const ObserverRecord& record, const std::string& file, GIntBig feature) {
  const auto refuse_values = [&](const std::string& what) {
    refuse(file, fmt::format("feature {}: {}", feature, what));
  };
  if (record.azimuth_from_deg.has_value() != record.azimuth_to_deg.has_value())
    refuse_values("has one of azimuth_from and azimuth_to; both or none were expected");
  if (record.max_distance_m && !(*record.max_distance_m > 0))
    refuse_values(
        fmt::format("max_distance {}: metres above 0 were expected", *record.max_distance_m));
  if (record.target_height_m && !(*record.target_height_m >= 0))
    refuse_values(fmt::format("target_height {}: metres above ground were expected",
                              *record.target_height_m));
}

}  // namespace

std::vector<ObserverRecord> read_observers(const std::string& file, const std::string& data_crs_wkt,
                                           const std::string& crs) {
  const DatasetPtr dataset = open_dataset(file, GDAL_OF_VECTOR, "a vector file that OGR reads");
  std::vector<ObserverRecord> records;
  for (OGRLayer* layer : dataset->GetLayers()) {
    const TransformationPtr conversion = conversion_of(*layer, file, data_crs_wkt, crs);
    for (const auto& feature : layer) {
      const Attributes attributes(*feature, file);
      const auto typed = attributes.place();
      const OGRPoint from_table(typed ? typed->first : 0, typed ? typed->second : 0);
      // Tables without geometry have columns x and y, or lon and lat.
      const OGRGeometry* geometry = feature->GetGeometryRef();
      if (!geometry && typed) geometry = &from_table;
      if (!geometry || wkbFlatten(geometry->getGeometryType()) != wkbPoint || geometry->IsEmpty())
        refuse(file,
               fmt::format("feature {}: has no point; points were expected", feature->GetFID()));
      OGRPoint point = *geometry->toPoint();
      if (conversion) {
        CPLPushErrorHandler(CPLQuietErrorHandler);
        const bool converted = point.transform(conversion.get()) == OGRERR_NONE;
        CPLPopErrorHandler();
        if (!converted)
          refuse(file, fmt::format("feature {}: cannot be converted to the coordinate system of "
                                   "the DEM; is its own declared right?",
                                   feature->GetFID()));
      }
      records.push_back(record_of(attributes, point));
      check(records.back(), file, feature->GetFID());
    }
  }
  if (records.empty()) refuse(file, "holds no point; observers were expected");
  return records;
}

}  // namespace scarp
