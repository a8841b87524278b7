#include <cpl_error.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>

#include "core/error/error.h"
#include "ingest/dem/gdal_session.h"
#include "ingest/footprints/footprints.h"

namespace scarp {
namespace {

/// GDAL's messages go to nobody while this lives; what matters is said by our own.
struct QuietGdal {
  QuietGdal() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~QuietGdal() { CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
};

/// Why features were left out or changed, how often.
struct Counts {
  std::uint64_t polygons = 0, without_height = 0, not_polygons = 0, not_converted = 0,
                beyond_repair = 0, repaired = 0, outside = 0;
};

/// A height in metres from text, such as "12.5" or "12.5 m"; NaN where it is none.
double parse_height_m(std::string text) {
  const auto trim = [&] {
    while (!text.empty() && text.back() == ' ') text.pop_back();
    text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
  };
  trim();
  if (!text.empty() && text.back() == 'm') text.pop_back();
  trim();
  double height_m = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), height_m);
  if (failed != std::errc() || end != text.data() + text.size())
    return std::numeric_limits<double>::quiet_NaN();
  return height_m;
}

double height_of(OGRFeature& feature, int field) {
  if (!feature.IsFieldSetAndNotNull(field)) return std::numeric_limits<double>::quiet_NaN();
  switch (feature.GetFieldDefnRef(field)->GetType()) {
    case OFTInteger:
    case OFTInteger64:
    case OFTReal:
      return feature.GetFieldAsDouble(field);
    default:
      return parse_height_m(feature.GetFieldAsString(field));
  }
}

/// One file being read.
class FootprintReader {
 public:
  FootprintReader(const std::string& file, const std::string& height_field, const Dem& dem)
      : file_(file), height_field_(height_field), dem_(dem) {
    const double x0 = dem.x_of(0), x1 = dem.x_of(dem.columns - 1);
    const double y0 = dem.y_of(dem.rows - 1), y1 = dem.y_of(0);
    extent_.MinX = x0, extent_.MaxX = x1, extent_.MinY = y0, extent_.MaxY = y1;
    const std::string& wkt = dem.frame->description().crs_wkt;
    if (!wkt.empty() && dem_crs_.SetFromUserInput(wkt.c_str()) == OGRERR_NONE) {
      dem_crs_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      dem_crs_.StripVertical();
    }
  }

  std::vector<Footprint> run(std::vector<std::string>& warnings) {
    const DatasetPtr dataset = open_dataset(file_, GDAL_OF_VECTOR, "a vector file that OGR reads");
    const QuietGdal quiet;
    std::set<std::string> fields;
    bool has_field = false;
    for (OGRLayer* layer : dataset->GetLayers()) {
      OGRFeatureDefn& definition = *layer->GetLayerDefn();
      for (int i = 0; i < definition.GetFieldCount(); ++i)
        fields.insert(definition.GetFieldDefn(i)->GetNameRef());
      const int field = definition.GetFieldIndex(height_field_.c_str());
      if (field < 0) continue;
      has_field = true;
      read_layer(*layer, field, warnings);
    }
    if (!has_field)
      refuse(fmt::format(
          "has no attribute \"{}\"; a height in metres was expected; give "
          "--height-field with one of: {}",
          height_field_, fields.empty() ? "(none)" : fmt::format("{}", fmt::join(fields, ", "))));
    if (counts_.polygons + counts_.without_height + counts_.not_converted + counts_.beyond_repair ==
        0)
      refuse("holds no polygon; building outlines were expected; ogrinfo shows what it holds");
    if (found_.empty() && counts_.outside == 0)
      refuse(
          fmt::format("no polygon has a height above 0 in \"{}\"; metres were expected; is it the "
                      "right attribute?",
                      height_field_));
    if (found_.empty())
      refuse(
          fmt::format("all {} buildings lie outside the DEM; some inside were expected; check the "
                      "coordinate system of both",
                      counts_.outside));
    report(warnings);
    return std::move(found_);
  }

 private:
  [[noreturn]] void refuse(const std::string& rest) const {
    throw Error(ErrorCode::kInput, fmt::format("'{}': {}", file_, rest));
  }

  TransformationPtr transformation_from(const OGRLayer& layer,
                                        std::vector<std::string>& warnings) const {
    const OGRSpatialReference* crs = const_cast<OGRLayer&>(layer).GetSpatialRef();
    if (!crs || crs->IsEmpty() || dem_crs_.IsEmpty()) {
      if ((crs && !crs->IsEmpty()) != !dem_crs_.IsEmpty())
        warnings.push_back(fmt::format(
            "'{}' {} a coordinate system and the DEM {}; coordinates are taken as they are", file_,
            dem_crs_.IsEmpty() ? "has" : "has not", dem_crs_.IsEmpty() ? "has not" : "has"));
      return nullptr;
    }
    OGRSpatialReference source(*crs);
    source.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    source.StripVertical();
    TransformationPtr made(OGRCreateCoordinateTransformation(&source, &dem_crs_));
    if (!made)
      refuse(
          fmt::format("its coordinate system \"{}\" cannot be converted to that of the DEM; "
                      "convert it with ogr2ogr -t_srs",
                      source.GetName() ? source.GetName() : ""));
    return made;
  }

  void read_layer(OGRLayer& layer, int field, std::vector<std::string>& warnings) {
    const TransformationPtr transformation = transformation_from(layer, warnings);
    layer.ResetReading();
    while (const OGRFeatureUniquePtr feature{layer.GetNextFeature()}) {
      std::unique_ptr<OGRGeometry> geometry(feature->StealGeometry());
      if (!geometry || geometry->IsEmpty() || geometry->getDimension() < 2) {
        ++counts_.not_polygons;
        continue;
      }
      const double height_m = height_of(*feature, field);
      if (!std::isfinite(height_m) || !(height_m > 0)) {
        ++counts_.without_height;
        continue;
      }
      geometry.reset(geometry->getLinearGeometry());
      geometry->flattenTo2D();
      if (transformation && geometry->transform(transformation.get()) != OGRERR_NONE) {
        ++counts_.not_converted;
        continue;
      }
      add(std::move(geometry), height_m);
    }
  }

  void add(std::unique_ptr<OGRGeometry> geometry, double height_m) {
    if (!geometry->IsValid()) {
      std::unique_ptr<OGRGeometry> repaired(geometry->MakeValid());
      if (!repaired) {
        ++counts_.beyond_repair;
        return;
      }
      ++counts_.repaired;
      geometry = std::move(repaired);
    }
    add_polygons(*geometry, height_m);
  }

  void add_polygons(const OGRGeometry& geometry, double height_m) {
    const OGRwkbGeometryType type = wkbFlatten(geometry.getGeometryType());
    if (type == wkbPolygon || type == wkbTriangle) {
      add_polygon(*geometry.toPolygon(), height_m);
    } else if (OGR_GT_IsSubClassOf(type, wkbGeometryCollection)) {
      for (const OGRGeometry* part : *geometry.toGeometryCollection())
        add_polygons(*part, height_m);
    } else if (OGR_GT_IsSubClassOf(type, wkbPolyhedralSurface)) {
      for (const OGRPolygon* part : *geometry.toPolyhedralSurface()) add_polygon(*part, height_m);
    }
  }

  void add_polygon(const OGRPolygon& polygon, double height_m) {
    if (polygon.IsEmpty()) return;
    ++counts_.polygons;
    OGREnvelope box;
    polygon.getEnvelope(&box);
    if (!std::isfinite(box.MinX + box.MaxX + box.MinY + box.MaxY)) {
      ++counts_.not_converted;
      return;
    }
    // The data may count longitudes on the other side of the antimeridian.
    double turn = 0;
    if (dem_.frame->is_geographic())
      turn = 360 * std::round((dem_.frame->description().centre_x - box.MinX) / 360);
    box.MinX += turn;
    box.MaxX += turn;
    if (!box.Intersects(extent_)) {
      ++counts_.outside;
      return;
    }
    Footprint footprint;
    footprint.height_m = height_m;
    for (const OGRLinearRing* ring : polygon) {
      auto& points = footprint.rings.emplace_back();
      for (int i = 0; i + 1 < ring->getNumPoints(); ++i)
        points.push_back({ring->getX(i) + turn, ring->getY(i)});
    }
    found_.push_back(std::move(footprint));
  }

  void report(std::vector<std::string>& warnings) const {
    const auto say = [&](std::uint64_t count, const std::string& what) {
      if (count > 0) warnings.push_back(fmt::format("'{}': {} {}", file_, count, what));
    };
    say(counts_.without_height,
        fmt::format("features left out, no height above 0 in \"{}\"", height_field_));
    say(counts_.not_polygons, "features left out, no polygon");
    say(counts_.not_converted, "features left out, cannot be converted to the CRS of the DEM");
    say(counts_.beyond_repair, "features left out, invalid beyond repair");
    say(counts_.repaired, "invalid features repaired");
    say(counts_.outside, "polygons left out, outside the DEM");
  }

  const std::string& file_;
  const std::string& height_field_;
  const Dem& dem_;
  OGREnvelope extent_;
  OGRSpatialReference dem_crs_;
  Counts counts_;
  std::vector<Footprint> found_;
};

}  // namespace

std::vector<Footprint> read_footprints(const std::string& file, const std::string& height_field,
                                       const Dem& dem, std::vector<std::string>& warnings) {
  return FootprintReader(file, height_field, dem).run(warnings);
}

}  // namespace scarp
