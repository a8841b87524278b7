#include "tiles/layers/spatial_reference.h"

#include <fmt/format.h>

#include "core/error/error.h"

namespace scarp {

OGRSpatialReference spatial_reference(const std::string& wkt, const std::string& path) {
  OGRSpatialReference crs;
  if (crs.importFromWkt(wkt.c_str()) != OGRERR_NONE)
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': the CRS \"{:.60}\" is not understood; WKT was expected; give the "
                    "input a CRS that GDAL knows",
                    path, wkt));
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return crs;
}

}  // namespace scarp
