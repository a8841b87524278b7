#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tiles/layers/geotiff.h"
#include "tiles/store/part_file.h"

namespace scarp {

/// A point of a map, in units of its CRS: x east or longitude, y north or latitude.
struct RingPoint {
  double x;
  double y;
};

/// Corners of a closed ring in order; the first is not repeated.
using Ring = std::vector<RingPoint>;

/// A group as a feature. trace_groups gives its rings as vertices.
struct GroupPolygon {
  std::int64_t group = 0;
  std::int64_t parent = -1;  ///< -1: none, written as null
  std::int64_t triangles = 0;
  double area_m2 = 0;
  double height_min_m = 0;
  double height_max_m = 0;
  std::vector<std::vector<Ring>> polygons;  ///< each: outer ring, then holes
};

/// Writes the layer "groups" of a GeoPackage: a multipolygon a group with the fields group, parent,
/// triangles, area_m2, height_min_m, height_max_m, and a spatial index. The same groups give the
/// same bytes: the file's date is a fixed one.
///
/// @param crs_wkt  empty: none
///
/// Requires rings of at least three corners (asserted).
/// Errors: kResource with GDAL's own words or from the disk, kInput where the file exists and is
/// not to be replaced, or the CRS is not WKT. Nothing is left behind. Memory: the file, once more
/// beside the polygons.
void write_group_polygons(const std::string& path, std::span<const GroupPolygon> groups,
                          const std::string& crs_wkt, Existing existing);

/// Takes some of the groups.
using TakeGroups = std::function<void(std::span<const GroupPolygon>)>;

/// The same bytes for groups that are never held all at once: `give` hands them over in pieces.
///
/// @param work_path  where the file grows until it is whole, on the same file system as `path`, and
///                   ends in ".gpkg"; there is none at the end
/// Memory: a piece, and what SQLite keeps of a file, some megabytes. Errors: as above, and what
/// `give` throws.
void write_group_polygons_in_pieces(const std::string& path, const std::string& work_path,
                                    const std::function<void(const TakeGroups&)>& give,
                                    const std::string& crs_wkt, Existing existing);

/// Writes the outlines of what a raster of whole numbers shows: the layer "areas" of a GeoPackage,
/// a polygon for each piece of cells of one value that hang together by edges, with the field
/// `field`. Outlines follow the cells' edges. Cells of 0 and of nodata are left out.
///
/// @param layer  of uint8 or uint32 (asserted), values below 2^31 but for nodata; north-up
/// Errors as write_group_polygons. Memory: nine bytes a cell, and the file twice.
void write_area_polygons(const std::string& path, const RasterLayer& layer,
                         const std::string& field, Existing existing);

/// The same outlines as a GeoJSON text (RFC 7946): in longitude and latitude, 7 digits.
/// Requires (asserted) besides a layer with a CRS. Errors: kResource with GDAL's own words, kInput
/// where the CRS is not WKT.
std::string area_polygons_geojson(const RasterLayer& layer, const std::string& field);

}  // namespace scarp
