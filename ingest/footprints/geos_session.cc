#include "ingest/footprints/geos_session.h"

namespace scarp {
namespace {

/// Corners that would reach farther than this many times the distance are cut off. A right angle
/// needs 1.42.
constexpr double kMitreLimit = 2;

void keep_reason(const char* message, void* reason) {
  *static_cast<std::string*>(reason) = message;
}

}  // namespace

GeosSession::GeosSession() : context_(GEOS_init_r()) {
  GEOSContext_setErrorMessageHandler_r(context_, keep_reason, &reason_);
}

GeosSession::~GeosSession() {
  GEOS_finish_r(context_);
}

GeosSession::Geometry GeosSession::own(GEOSGeometry* geometry) const {
  if (!geometry) throw GeosFailure(reason_);
  return {geometry, Destroy{context_}};
}

GeosSession::Geometry GeosSession::polygon(const PlanePolygon& rings) const {
  std::vector<Geometry> made;
  for (const PlaneRing& ring : rings) {
    GEOSCoordSequence* sequence =
        GEOSCoordSeq_copyFromBuffer_r(context_, reinterpret_cast<const double*>(ring.data()),
                                      static_cast<unsigned int>(ring.size()), 0, 0);
    if (!sequence) throw GeosFailure(reason_);
    made.push_back(own(GEOSGeom_createLinearRing_r(context_, sequence)));
  }
  std::vector<GEOSGeometry*> holes;
  for (std::size_t i = 1; i < made.size(); ++i) holes.push_back(made[i].release());
  return own(GEOSGeom_createPolygon_r(context_, made.at(0).release(), holes.data(),
                                      static_cast<unsigned int>(holes.size())));
}

GeosSession::Geometry GeosSession::collection(std::vector<Geometry> parts) const {
  std::vector<GEOSGeometry*> raw;
  for (Geometry& part : parts) raw.push_back(part.release());
  return own(GEOSGeom_createCollection_r(context_, GEOS_GEOMETRYCOLLECTION, raw.data(),
                                         static_cast<unsigned int>(raw.size())));
}

GeosSession::Geometry GeosSession::clone(const Geometry& g) const {
  return own(GEOSGeom_clone_r(context_, g.get()));
}

GeosSession::Geometry GeosSession::boundary(const Geometry& g) const {
  return own(GEOSBoundary_r(context_, g.get()));
}

GeosSession::Geometry GeosSession::valid(const Geometry& g) const {
  return own(GEOSMakeValid_r(context_, g.get()));
}

GeosSession::Geometry GeosSession::node(const Geometry& parts, double grid_m) const {
  return own(GEOSUnaryUnionPrec_r(context_, parts.get(), grid_m));
}

GeosSession::Geometry GeosSession::node_until_still(const Geometry& lines, double grid_m) const {
  constexpr int kMostRounds = 10;  // two or three are the rule; what is left then is found later
  Geometry noded = node(lines, grid_m);
  for (int round = 1; round < kMostRounds; ++round) {
    Geometry again = node(noded, grid_m);
    const char same = GEOSEqualsExact_r(context_, noded.get(), again.get(), 0);
    if (same == 2) throw GeosFailure(reason_);
    noded = std::move(again);
    if (same == 1) break;
  }
  return noded;
}

GeosSession::Geometry GeosSession::polygonize(const Geometry& lines) const {
  const GEOSGeometry* const input[] = {lines.get()};
  return own(GEOSPolygonize_r(context_, input, 1));
}

GeosSession::Geometry GeosSession::coverage_union(const Geometry& polygons, double grid_m) const {
  // GEOS takes pieces that touch each other in points only for overlapping ones, now and then.
  GEOSGeometry* quick = GEOSCoverageUnion_r(context_, polygons.get());
  return quick ? own(quick) : node(polygons, grid_m);
}

GeosSession::Geometry GeosSession::intersection(const Geometry& a, const Geometry& b,
                                                double grid_m) const {
  return own(GEOSIntersectionPrec_r(context_, a.get(), b.get(), grid_m));
}

GeosSession::Geometry GeosSession::difference(const Geometry& a, const Geometry& b,
                                              double grid_m) const {
  return own(GEOSDifferencePrec_r(context_, a.get(), b.get(), grid_m));
}

GeosSession::Geometry GeosSession::offset(const Geometry& g, double distance_m) const {
  constexpr int kQuadrantSegments = 1;  // round corners are not asked for
  return own(GEOSBufferWithStyle_r(context_, g.get(), distance_m, kQuadrantSegments,
                                   GEOSBUF_CAP_FLAT, GEOSBUF_JOIN_MITRE, kMitreLimit));
}

bool GeosSession::is_empty(const Geometry& g) const {
  return GEOSisEmpty_r(context_, g.get()) != 0;
}

bool GeosSession::is_valid(const Geometry& g) const {
  return GEOSisValid_r(context_, g.get()) == 1;
}

double GeosSession::area_m2(const Geometry& g) const {
  double area = 0;
  if (!GEOSArea_r(context_, g.get(), &area)) throw GeosFailure(reason_);
  return area;
}

double GeosSession::distance_m(const Geometry& a, const PlanePoint& p) const {
  const Geometry point = own(GEOSGeom_createPointFromXY_r(context_, p.x_m, p.y_m));
  double distance = 0;
  if (!GEOSDistance_r(context_, a.get(), point.get(), &distance)) throw GeosFailure(reason_);
  return distance;
}

bool GeosSession::contains(const Geometry& g, const PlanePoint& p) const {
  const Geometry point = own(GEOSGeom_createPointFromXY_r(context_, p.x_m, p.y_m));
  const char inside = GEOSContains_r(context_, g.get(), point.get());
  if (inside == 2) throw GeosFailure(reason_);
  return inside == 1;
}

PlanePoint GeosSession::point_inside(const Geometry& g) const {
  const Geometry point = own(GEOSPointOnSurface_r(context_, g.get()));
  PlanePoint p;
  if (!GEOSGeomGetX_r(context_, point.get(), &p.x_m) ||
      !GEOSGeomGetY_r(context_, point.get(), &p.y_m))
    throw GeosFailure(reason_);
  return p;
}

PlaneBox GeosSession::box(const Geometry& g) const {
  PlaneBox b;
  if (!GEOSGeom_getXMin_r(context_, g.get(), &b.low_x_m) ||
      !GEOSGeom_getYMin_r(context_, g.get(), &b.low_y_m) ||
      !GEOSGeom_getXMax_r(context_, g.get(), &b.high_x_m) ||
      !GEOSGeom_getYMax_r(context_, g.get(), &b.high_y_m))
    throw GeosFailure(reason_);
  return b;
}

PlaneRing GeosSession::path(const GEOSGeometry* line) const {
  const GEOSCoordSequence* sequence = GEOSGeom_getCoordSeq_r(context_, line);
  unsigned int count = 0;
  if (!sequence || !GEOSCoordSeq_getSize_r(context_, sequence, &count)) throw GeosFailure(reason_);
  PlaneRing ring(count);
  if (!GEOSCoordSeq_copyToBuffer_r(context_, sequence, reinterpret_cast<double*>(ring.data()), 0,
                                   0))
    throw GeosFailure(reason_);
  return ring;
}

std::vector<PlanePolygon> GeosSession::polygons(const Geometry& g) const {
  std::vector<PlanePolygon> found;
  std::vector<const GEOSGeometry*> open{g.get()};
  while (!open.empty()) {
    const GEOSGeometry* part = open.back();
    open.pop_back();
    const int type = GEOSGeomTypeId_r(context_, part);
    if (type == GEOS_POLYGON) {
      if (GEOSisEmpty_r(context_, part)) continue;
      PlanePolygon polygon{path(GEOSGetExteriorRing_r(context_, part))};
      const int holes = GEOSGetNumInteriorRings_r(context_, part);
      for (int i = 0; i < holes; ++i)
        polygon.push_back(path(GEOSGetInteriorRingN_r(context_, part, i)));
      found.push_back(std::move(polygon));
    } else if (type == GEOS_MULTIPOLYGON || type == GEOS_GEOMETRYCOLLECTION) {
      for (int i = GEOSGetNumGeometries_r(context_, part); i-- > 0;)
        open.push_back(GEOSGetGeometryN_r(context_, part, i));
    }
  }
  return found;
}

std::vector<PlaneRing> GeosSession::lines(const Geometry& g) const {
  std::vector<PlaneRing> found;
  std::vector<const GEOSGeometry*> open{g.get()};
  while (!open.empty()) {
    const GEOSGeometry* part = open.back();
    open.pop_back();
    const int type = GEOSGeomTypeId_r(context_, part);
    if (type == GEOS_LINESTRING || type == GEOS_LINEARRING) {
      if (!GEOSisEmpty_r(context_, part)) found.push_back(path(part));
    } else if (type == GEOS_MULTILINESTRING || type == GEOS_GEOMETRYCOLLECTION) {
      for (int i = GEOSGetNumGeometries_r(context_, part); i-- > 0;)
        open.push_back(GEOSGetGeometryN_r(context_, part, i));
    }
  }
  return found;
}

}  // namespace scarp
