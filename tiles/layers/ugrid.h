#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tiles/layers/geopackage.h"
#include "tiles/store/part_file.h"

namespace scarp {

/// A number for each triangle of a mesh.
struct FaceValues {
  std::string name;            ///< of letters, digits and '_'
  std::string description;     ///< long_name
  std::string unit;            ///< UDUNITS; "1" for numbers without one
  std::vector<double> values;  ///< [triangles], NaN where there is none
};

/// Triangles over a map, for programs that show meshes.
struct MapMesh {
  std::vector<RingPoint> places;                        ///< of vertices, units of the CRS
  std::vector<double> heights_m;                        ///< [vertices]
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise on the map
  std::vector<std::int32_t> group_of_triangle;          ///< [triangles], -1 for none
  std::vector<FaceValues> values;
  std::string crs_wkt;  ///< empty: none
};

/// Writes a mesh as netCDF (the 64-bit-offset variant of the classic format) after the conventions
/// UGRID 1.0 and CF 1.8, which QGIS opens as a mesh layer with its values as datasets.
/// docs/formats.md has the variables. The same mesh gives the same bytes.
///
/// Requires sizes that fit, fewer than 2^31 vertices and triangles (asserted).
/// Errors: kResource from the library or the disk, kInput where the file exists and is not to be
/// replaced, or the CRS is not WKT. Nothing is left behind.
void write_ugrid(const std::string& path, const MapMesh& mesh, Existing existing);

}  // namespace scarp
