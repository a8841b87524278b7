#pragma once

#include <optional>
#include <string>

#include "cli/options.h"
#include "core/geodesy/position.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// An eye over a DEM.
struct GroundEye {
  Position position;               ///< of the frame, on the same normals as the samples
  MapPoint map;                    ///< in the CRS of the data; height above its height datum
  std::optional<double> ground_m;  ///< the ground's height there, in the same way; none over void
};

/// Places a point of the CRS of the data. @param text  the position as given, for messages
/// Throws as place_eye.
GroundEye place_eye(const MapPoint& point, bool above_datum, const std::string& text,
                    const Ground& ground);

/// Places a typed position. Over the data its plan position is between its samples' as they are
/// placed, and ground is bilinear; outside the data it is placed by the CRS.
/// @param crs  of the position; empty: the data's
///
/// Throws Error{kInput} where the CRS is not known, and where a height above ground is asked for
/// outside the data or over void ground.
GroundEye place_eye(const TypedPosition& typed, const std::string& crs, const Ground& ground);

/// The same for a point in the CRS of the data, its height above the height datum.
GroundEye place_eye(const MapPoint& map, const Ground& ground, const GeoFrame::Placer& placer);

}  // namespace scarp
