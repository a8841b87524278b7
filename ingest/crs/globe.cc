#include "ingest/crs/globe.h"

#include <fmt/format.h>
#include <proj_experimental.h>

#include <cmath>
#include <optional>

#include "core/error/error.h"
#include "ingest/crs/proj_objects.h"

namespace scarp {
namespace {

/// Whether the CRS lies on WGS 84 itself, so that positions in its ECEF are EPSG:4978.
bool is_on_wgs84(PJ_CONTEXT* context, const std::string& crs_wkt) {
  const PjPtr crs = horizontal_crs(context, crs_wkt);
  const PjPtr geodetic(crs ? proj_crs_get_geodetic_crs(context, crs.get()) : nullptr);
  const PjPtr wgs84(proj_create(context, "EPSG:4326"));
  return geodetic && wgs84 &&
         proj_is_equivalent_to(geodetic.get(), wgs84.get(),
                               PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) == 1;
}

/// From map coordinates and heights above the data's ellipsoid to EPSG:4978, the operation that
/// PROJ prefers at a place, and no other. Null where there is none.
PjPtr shift_at(PJ_CONTEXT* context, const std::string& crs_wkt, double x, double y) {
  const PjPtr crs = horizontal_crs(context, crs_wkt);
  const PjPtr solid(crs ? proj_crs_promote_to_3D(context, nullptr, crs.get()) : nullptr);
  const PjPtr earth(proj_create(context, "EPSG:4978"));
  if (!solid || !earth) return nullptr;
  const PjPtr any(
      proj_create_crs_to_crs_from_pj(context, solid.get(), earth.get(), nullptr, nullptr));
  PjPtr ordered(any ? proj_normalize_for_visualization(context, any.get()) : nullptr);
  if (!ordered) return nullptr;
  const PJ_COORD at = proj_trans(ordered.get(), PJ_FWD, proj_coord(x, y, 0, HUGE_VAL));
  if (!std::isfinite(at.xyz.x)) return nullptr;
  PjPtr used(proj_trans_get_last_used_operation(ordered.get()));
  return used ? std::move(used) : std::move(ordered);
}

}  // namespace

struct Globe::Placer::Impl {
  std::optional<Flattening> frame;         // on WGS 84
  std::optional<GeoFrame::Placer> placer;  // elsewhere
  ContextPtr context;
  PjPtr shift;
};

Globe::Globe(const GeoFrame& frame) : frame_(&frame) {
  const FrameDescription& description = frame.description();
  if (!frame.earth_frame())
    throw Error(ErrorCode::kInput,
                "the scene was built with --earth flat and has no place on the globe; build it "
                "from a DEM with a coordinate system, without --earth flat");
  const ContextPtr context = make_proj_context();
  if (is_on_wgs84(context.get(), description.crs_wkt)) return;
  const PjPtr shift =
      shift_at(context.get(), description.crs_wkt, description.centre_x, description.centre_y);
  if (!shift)
    throw Error(ErrorCode::kInput,
                "the scene's coordinate system: PROJ knows no transformation to WGS 84 "
                "(EPSG:4978); reproject the DEM with gdalwarp and build it again");
  const PJ_PROJ_INFO info = proj_pj_info(shift.get());
  datum_shift_ = info.description ? info.description : "unnamed";
  datum_shift_accuracy_m_ = info.accuracy;
}

Globe::Placer::Placer(const Globe& globe) : impl_(std::make_unique<Impl>()) {
  if (globe.datum_shift().empty()) {
    impl_->frame = globe.frame_->earth_frame()->frame;
    return;
  }
  const FrameDescription& description = globe.frame_->description();
  impl_->placer.emplace(*globe.frame_);
  impl_->context = make_proj_context();
  impl_->shift = shift_at(impl_->context.get(), description.crs_wkt, description.centre_x,
                          description.centre_y);
}

Globe::Placer::~Placer() = default;
Globe::Placer::Placer(Placer&&) noexcept = default;

EcefPoint Globe::Placer::ecef(const Position& p) const {
  if (impl_->frame) return impl_->frame->unflatten(p);
  const MapPoint at = impl_->placer->unplace(p);
  const double height_m = at.height_m + impl_->placer->undulation_m(at.x, at.y);
  const PJ_COORD ecef =
      proj_trans(impl_->shift.get(), PJ_FWD, proj_coord(at.x, at.y, height_m, HUGE_VAL));
  if (!std::isfinite(ecef.xyz.x))
    throw Error(ErrorCode::kInput,
                fmt::format("position {:.10g},{:.10g}: the transformation to WGS 84 does not "
                            "reach it; reproject the DEM with gdalwarp and build it again",
                            at.x, at.y));
  return {ecef.xyz.x, ecef.xyz.y, ecef.xyz.z};
}

}  // namespace scarp
