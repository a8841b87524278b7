#pragma once

#ifndef GEOS_USE_ONLY_R_API
#define GEOS_USE_ONLY_R_API
#endif
#include <geos_c.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace scarp {

/// A point of the plane that footprints are cut in, metres: x to the right along columns, y against
/// the rows. Nearly the flattened plane, but with straight grid lines.
struct PlanePoint {
  double x_m = 0;
  double y_m = 0;

  friend bool operator==(const PlanePoint&, const PlanePoint&) = default;
  friend auto operator<=>(const PlanePoint&, const PlanePoint&) = default;
};

using PlaneRing = std::vector<PlanePoint>;  ///< closed: the last point is the first
using PlanePolygon = std::vector<PlaneRing>;

struct PlaneBox {
  double low_x_m = 0, low_y_m = 0, high_x_m = 0, high_y_m = 0;

  bool meets(const PlaneBox& other, double reach_m) const {
    return low_x_m <= other.high_x_m + reach_m && other.low_x_m <= high_x_m + reach_m &&
           low_y_m <= other.high_y_m + reach_m && other.low_y_m <= high_y_m + reach_m;
  }
};

/// Thrown by GeosSession where GEOS gives up on a geometry; never leaves ingest/footprints.
class GeosFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// GEOS behind values: what we need of it, one session for each thread. Every function throws
/// GeosFailure. Overlays with a grid round every coordinate to a multiple of it and node what the
/// rounding makes meet (snap rounding), so that results never cross each other.
class GeosSession {
 public:
  struct Destroy {
    GEOSContextHandle_t context;
    void operator()(GEOSGeometry* geometry) const { GEOSGeom_destroy_r(context, geometry); }
  };
  using Geometry = std::unique_ptr<GEOSGeometry, Destroy>;

  GeosSession();
  ~GeosSession();
  GeosSession(const GeosSession&) = delete;
  GeosSession& operator=(const GeosSession&) = delete;

  Geometry polygon(const PlanePolygon& rings) const;
  Geometry collection(std::vector<Geometry> parts) const;
  Geometry clone(const Geometry& g) const;

  Geometry boundary(const Geometry& g) const;
  Geometry valid(const Geometry& g) const;
  /// Union of the parts of a collection: lines noded with each other, polygons dissolved.
  Geometry node(const Geometry& parts, double grid_m) const;
  /// As node, again and again until nothing moves: rounding may take a line into the reach of
  /// another corner. Then every corner keeps half a grid step away from the lines it is not part
  /// of.
  Geometry node_until_still(const Geometry& lines, double grid_m) const;
  Geometry polygonize(const Geometry& lines) const;
  /// Union of polygons that share whole edges, have all corners on the grid and do not overlap.
  Geometry coverage_union(const Geometry& polygons, double grid_m) const;
  Geometry intersection(const Geometry& a, const Geometry& b, double grid_m) const;
  Geometry difference(const Geometry& a, const Geometry& b, double grid_m) const;
  /// Grown (or with distance_m < 0 shrunk) with sharp corners.
  Geometry offset(const Geometry& g, double distance_m) const;

  bool is_empty(const Geometry& g) const;
  bool is_valid(const Geometry& g) const;
  double area_m2(const Geometry& g) const;
  double distance_m(const Geometry& a, const PlanePoint& p) const;
  bool contains(const Geometry& g, const PlanePoint& p) const;
  PlanePoint point_inside(const Geometry& g) const;
  PlaneBox box(const Geometry& g) const;

  /// All polygons of a geometry, lines and points left out.
  std::vector<PlanePolygon> polygons(const Geometry& g) const;
  /// All paths of a geometry of lines.
  std::vector<PlaneRing> lines(const Geometry& g) const;

 private:
  Geometry own(GEOSGeometry* geometry) const;
  PlaneRing path(const GEOSGeometry* line) const;

  GEOSContextHandle_t context_;
  mutable std::string reason_;
};

}  // namespace scarp
