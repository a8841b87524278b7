#pragma once

#include <ogr_spatialref.h>

#include <string>

namespace scarp {

/// The CRS of a WKT text, with x east (longitude) and y north (latitude).
/// Errors: kInput where the text is no CRS; `path` is the file that was to have it.
OGRSpatialReference spatial_reference(const std::string& wkt, const std::string& path);

}  // namespace scarp
