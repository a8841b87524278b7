#include "ingest/crs/geo_frame.h"

#include <fmt/format.h>
#include <proj.h>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/Geodesic.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error/error.h"
#include "core/geodesy/flattening.h"
#include "ingest/crs/geoid.h"

namespace scarp {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

/// Least cosine of the angle between a point and the scene's centre: 87 degrees.
constexpr double kLeastCosine = 0.0523;

struct DestroyPj {
  void operator()(PJ* pj) const { proj_destroy(pj); }
};
struct DestroyContext {
  void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
using PjPtr = std::unique_ptr<PJ, DestroyPj>;
using ContextPtr = std::unique_ptr<PJ_CONTEXT, DestroyContext>;

ContextPtr make_context() {
  ContextPtr context(proj_context_create());
  proj_log_level(context.get(), PJ_LOG_NONE);
  proj_context_set_enable_network(context.get(), 0);
  return context;
}

[[noreturn]] void refuse_crs(const std::string& found) {
  throw Error(ErrorCode::kInput,
              fmt::format("coordinate system {}: cannot be placed on the Earth; a projected or "
                          "geographic CRS was expected; give --earth flat to use the map plane",
                          found));
}

/// The horizontal part of a CRS, without a bound transformation to another datum.
PjPtr horizontal_crs(PJ_CONTEXT* context, const std::string& crs) {
  PjPtr pj(proj_create(context, crs.c_str()));
  while (pj) {
    const PJ_TYPE type = proj_get_type(pj.get());
    if (type == PJ_TYPE_BOUND_CRS)
      pj.reset(proj_get_source_crs(context, pj.get()));
    else if (type == PJ_TYPE_COMPOUND_CRS)
      pj.reset(proj_crs_get_sub_crs(context, pj.get(), 0));
    else
      break;
  }
  return pj;
}

std::string name_of(PJ* pj) {
  const char* name = pj ? proj_get_name(pj) : nullptr;
  return name && *name ? fmt::format("\"{}\"", name) : "given";
}

}  // namespace

/// The ellipsoid and angular conventions of the CRS's own datum, and the flattened frame on it.
struct GeoFrame::Datum {
  double semi_major_m = 0, flattening = 0;
  double degrees_per_unit = 1, prime_meridian_deg = 0;
  GeographicLib::Geocentric ecef = GeographicLib::Geocentric::WGS84();
  std::unique_ptr<Flattening> frame;
};

struct GeoFrame::Placer::Impl {
  const GeoFrame* frame = nullptr;
  ContextPtr context;
  PjPtr to_geodetic;  // map coordinates to longitude and latitude in the datum's own units

  GeodeticPoint geodetic(double x, double y) const {
    const PJ_COORD at = proj_trans(to_geodetic.get(), PJ_FWD, proj_coord(x, y, 0, HUGE_VAL));
    const Datum& datum = *frame->datum_;
    const GeodeticPoint point{at.lp.lam * datum.degrees_per_unit + datum.prime_meridian_deg,
                              at.lp.phi * datum.degrees_per_unit};
    if (!std::isfinite(point.longitude_deg) || !(std::abs(point.latitude_deg) <= 90))
      throw Error(ErrorCode::kInput,
                  fmt::format("position {:.10g},{:.10g}: outside of what the coordinate system of "
                              "the data can place; check the order (x,y) and the CRS",
                              x, y));
    return point;
  }
};

GeoFrame::GeoFrame(const FrameDescription& description) : description_(description) {
  if (!(description.refraction >= 0 && description.refraction <= 1))
    throw Error(ErrorCode::kInput,
                fmt::format("refraction {}: outside [0, 1]; 0 is none, 0.13 light, 0.25 radio",
                            description.refraction));
  const ContextPtr context = make_context();
  PjPtr crs;
  if (!description.crs_wkt.empty()) crs = horizontal_crs(context.get(), description.crs_wkt);
  const PJ_TYPE type = crs ? proj_get_type(crs.get()) : PJ_TYPE_UNKNOWN;
  geographic_ = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;

  if (description.earth == Earth::kFlat) {
    if (geographic_)
      throw Error(ErrorCode::kInput,
                  fmt::format("coordinate system {}: is in degrees, which --earth flat would take "
                              "for lengths; leave --earth out to use the ellipsoid",
                              name_of(crs.get())));
    if (description.refraction != 0)
      throw Error(ErrorCode::kInput,
                  "--refraction bends rays around the Earth, and --earth flat "
                  "has none; leave one of them out");
    if (!description.geoid_file.empty())
      throw Error(ErrorCode::kInput,
                  "--geoid adds the undulation above the ellipsoid, and --earth "
                  "flat has none; leave one of them out");
    if (crs) {
      const PjPtr system(proj_crs_get_coordinate_system(context.get(), crs.get()));
      double unit = 1;
      if (system &&
          proj_cs_get_axis_info(context.get(), system.get(), 0, nullptr, nullptr, nullptr, &unit,
                                nullptr, nullptr, nullptr) &&
          unit > 0)
        metres_per_unit_ = unit;
    }
    return;
  }

  if (description.crs_wkt.empty())
    throw Error(ErrorCode::kInput,
                "the data have no coordinate system, and --earth ellipsoid needs one; give --earth "
                "flat, or assign a CRS with gdal_edit.py -a_srs");
  const PjPtr geodetic(crs ? proj_crs_get_geodetic_crs(context.get(), crs.get()) : nullptr);
  const PjPtr ellipsoid(geodetic ? proj_get_ellipsoid(context.get(), geodetic.get()) : nullptr);
  double semi_major_m = 0, inverse_flattening = 0;
  if (!ellipsoid || !proj_ellipsoid_get_parameters(context.get(), ellipsoid.get(), &semi_major_m,
                                                   nullptr, nullptr, &inverse_flattening))
    refuse_crs(name_of(crs.get()));

  datum_ = std::make_unique<Datum>();
  datum_->semi_major_m = semi_major_m;
  datum_->flattening = inverse_flattening > 0 ? 1 / inverse_flattening : 0;
  datum_->ecef = GeographicLib::Geocentric(semi_major_m, datum_->flattening);
  const PjPtr system(proj_crs_get_coordinate_system(context.get(), geodetic.get()));
  double radians_per_unit = 0;
  if (system &&
      proj_cs_get_axis_info(context.get(), system.get(), 0, nullptr, nullptr, nullptr,
                            &radians_per_unit, nullptr, nullptr, nullptr) &&
      radians_per_unit > 0)
    datum_->degrees_per_unit = radians_per_unit * kDegreesPerRadian;
  // A degree is a degree: the factor above carries the rounding of pi twice.
  if (std::abs(datum_->degrees_per_unit - 1) < 1e-12) datum_->degrees_per_unit = 1;
  const PjPtr meridian(proj_get_prime_meridian(context.get(), geodetic.get()));
  double longitude = 0, unit = 0;
  if (meridian &&
      proj_prime_meridian_get_parameters(context.get(), meridian.get(), &longitude, &unit, nullptr))
    datum_->prime_meridian_deg = longitude * unit * kDegreesPerRadian;

  if (!description.geoid_file.empty()) geoid_ = std::make_unique<Geoid>(description.geoid_file);

  const GeodeticPoint centre = Placer(*this).geodetic(description.centre_x, description.centre_y);
  EcefPoint at;
  datum_->ecef.Forward(centre.latitude_deg, centre.longitude_deg, 0, at.x_m, at.y_m, at.z_m);
  // Where the normals of the centre's parallel meet the axis: see Flattening.
  const double sine = std::sin(centre.latitude_deg / kDegreesPerRadian);
  const double e2 = datum_->flattening * (2 - datum_->flattening);
  const double normal_m = semi_major_m / std::sqrt(1 - e2 * sine * sine);
  datum_->frame = std::make_unique<Flattening>(at, description.refraction,
                                               EcefPoint{0, 0, -e2 * normal_m * sine});
}

GeoFrame::~GeoFrame() = default;

std::optional<EarthFrame> GeoFrame::earth_frame() const {
  if (!datum_) return {};
  return EarthFrame{*datum_->frame, datum_->semi_major_m, datum_->flattening};
}

GeoFrame::Placer::Placer(const GeoFrame& frame) : impl_(std::make_unique<Impl>()) {
  impl_->frame = &frame;
  if (frame.description_.earth == Earth::kFlat) return;
  impl_->context = make_context();
  PJ_CONTEXT* context = impl_->context.get();
  const PjPtr crs = horizontal_crs(context, frame.description_.crs_wkt);
  const PjPtr geodetic(proj_crs_get_geodetic_crs(context, crs.get()));
  const PjPtr conversion(
      proj_create_crs_to_crs_from_pj(context, crs.get(), geodetic.get(), nullptr, nullptr));
  if (conversion)
    impl_->to_geodetic.reset(proj_normalize_for_visualization(context, conversion.get()));
  if (!impl_->to_geodetic) refuse_crs(name_of(crs.get()));
}

GeoFrame::Placer::~Placer() = default;
GeoFrame::Placer::Placer(Placer&&) noexcept = default;

GeodeticPoint GeoFrame::Placer::geodetic(double x, double y) const {
  return impl_->geodetic(x, y);
}

void GeoFrame::Placer::place(std::span<const MapPoint> points,
                             std::span<Position> positions) const {
  for (std::size_t i = 0; i < points.size(); ++i) positions[i] = place(points[i]);
}

Position GeoFrame::Placer::place(const MapPoint& point) const {
  return round_to_lattice(place_unrounded(point));
}

Position GeoFrame::Placer::place_unrounded(const MapPoint& point) const {
  const GeoFrame& frame = *impl_->frame;
  const auto out_of_reach = [&]() -> Error {
    return {ErrorCode::kInput,
            fmt::format("position {:.10g},{:.10g},{:.10g}: farther from the scene's centre than a "
                        "frame reaches; a place on this side of the Earth was expected",
                        point.x, point.y, point.height_m)};
  };
  Position p;
  if (frame.description_.earth == Earth::kFlat) {
    p = {(point.x - frame.description_.centre_x) * frame.metres_per_unit_,
         (point.y - frame.description_.centre_y) * frame.metres_per_unit_, point.height_m};
  } else {
    const Datum& datum = *frame.datum_;
    const GeodeticPoint at = impl_->geodetic(point.x, point.y);
    const double above_ellipsoid_m =
        point.height_m +
        (frame.geoid_ ? frame.geoid_->undulation_m(at.longitude_deg, at.latitude_deg) : 0);
    EcefPoint ecef;
    datum.ecef.Forward(at.latitude_deg, at.longitude_deg, above_ellipsoid_m, ecef.x_m, ecef.y_m,
                       ecef.z_m);
    if (datum.frame->cosine_from_centre(ecef) < kLeastCosine) throw out_of_reach();
    p = datum.frame->flatten(ecef);
  }
  if (!(std::abs(p.x_m) < kLatticeReachM && std::abs(p.y_m) < kLatticeReachM &&
        std::abs(p.z_m) < kLatticeReachM))
    throw out_of_reach();
  return p;
}

MapPoint GeoFrame::Placer::unplace(const Position& p) const {
  const GeoFrame& frame = *impl_->frame;
  const FrameDescription& description = frame.description_;
  if (description.earth == Earth::kFlat)
    return {p.x_m / frame.metres_per_unit_ + description.centre_x,
            p.y_m / frame.metres_per_unit_ + description.centre_y, p.z_m};
  const Datum& datum = *frame.datum_;
  const EcefPoint ecef = datum.frame->unflatten(p);
  double latitude_deg, longitude_deg, height_m;
  datum.ecef.Reverse(ecef.x_m, ecef.y_m, ecef.z_m, latitude_deg, longitude_deg, height_m);
  if (frame.geoid_) height_m -= frame.geoid_->undulation_m(longitude_deg, latitude_deg);
  const PJ_COORD at =
      proj_trans(impl_->to_geodetic.get(), PJ_INV,
                 proj_coord((longitude_deg - datum.prime_meridian_deg) / datum.degrees_per_unit,
                            latitude_deg / datum.degrees_per_unit, 0, HUGE_VAL));
  double x = at.xy.x;
  if (frame.geographic_) {
    // The data may count longitudes on the other side of the antimeridian.
    const double turn = 360 / datum.degrees_per_unit;
    x += turn * std::round((description.centre_x - x) / turn);
  }
  return {x, at.xy.y, height_m};
}

double GeoFrame::Placer::undulation_m(double x, double y) const {
  const GeoFrame& frame = *impl_->frame;
  if (!frame.geoid_) return 0;
  const GeodeticPoint at = impl_->geodetic(x, y);
  return frame.geoid_->undulation_m(at.longitude_deg, at.latitude_deg);
}

double GeoFrame::Placer::plane_direction_rad(const MapPoint& from, double azimuth_deg) const {
  const GeoFrame& frame = *impl_->frame;
  if (frame.description_.earth == Earth::kFlat) return (90 - azimuth_deg) / kDegreesPerRadian;
  // The geodesic's tangent as a chord of a kilometre: the lattice turns it by less than 1e-6.
  constexpr double kChordM = 1000;
  const Datum& datum = *frame.datum_;
  const GeodeticPoint at = impl_->geodetic(from.x, from.y);
  const GeographicLib::Geodesic earth(datum.semi_major_m, datum.flattening);
  const auto place_at = [&](double distance_m) {
    double latitude_deg, longitude_deg;
    earth.Direct(at.latitude_deg, at.longitude_deg, azimuth_deg, distance_m, latitude_deg,
                 longitude_deg);
    EcefPoint ecef;
    datum.ecef.Forward(latitude_deg, longitude_deg, from.height_m, ecef.x_m, ecef.y_m, ecef.z_m);
    return datum.frame->flatten(ecef);
  };
  const Position behind = place_at(-kChordM / 2), ahead = place_at(kChordM / 2);
  return std::atan2(ahead.y_m - behind.y_m, ahead.x_m - behind.x_m);
}

struct CoordinateConversion::Impl {
  ContextPtr context;
  PjPtr conversion;  // null where there is no way from one to the other

  std::optional<MapPoint> convert(const MapPoint& point, PJ_DIRECTION direction) const {
    const PJ_COORD at = conversion ? proj_trans(conversion.get(), direction,
                                                proj_coord(point.x, point.y, 0, HUGE_VAL))
                                   : proj_coord(HUGE_VAL, HUGE_VAL, 0, 0);
    if (!std::isfinite(at.xy.x) || !std::isfinite(at.xy.y)) return {};
    return MapPoint{at.xy.x, at.xy.y, point.height_m};
  }
};

CoordinateConversion::CoordinateConversion(const std::string& from_crs, const std::string& to_crs)
    : impl_(std::make_unique<Impl>()) {
  impl_->context = make_context();
  PJ_CONTEXT* context = impl_->context.get();
  const PjPtr from = horizontal_crs(context, from_crs);
  const PjPtr to = horizontal_crs(context, to_crs);
  if (!from || !to)
    throw Error(ErrorCode::kInput,
                fmt::format("coordinate system '{}': not known; a name such as OGC:CRS84 or "
                            "EPSG:32611, or WKT, was expected",
                            (from ? to_crs : from_crs).substr(0, 60)));
  const PjPtr conversion(
      proj_create_crs_to_crs_from_pj(context, from.get(), to.get(), nullptr, nullptr));
  if (conversion)
    impl_->conversion.reset(proj_normalize_for_visualization(context, conversion.get()));
}

CoordinateConversion::~CoordinateConversion() = default;
CoordinateConversion::CoordinateConversion(CoordinateConversion&&) noexcept = default;

std::optional<MapPoint> CoordinateConversion::forwards(const MapPoint& point) const {
  return impl_->convert(point, PJ_FWD);
}

std::optional<MapPoint> CoordinateConversion::back(const MapPoint& point) const {
  return impl_->convert(point, PJ_INV);
}

MapPoint convert_coordinates(const std::string& from_crs, const std::string& to_crs,
                             const MapPoint& point) {
  const auto converted = CoordinateConversion(from_crs, to_crs).forwards(point);
  if (!converted)
    throw Error(
        ErrorCode::kInput,
        fmt::format("position {:.10g},{:.10g}: cannot be converted to the coordinate system "
                    "of the data; check the order (x,y) and --crs",
                    point.x, point.y));
  return *converted;
}

}  // namespace scarp
