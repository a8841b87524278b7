#pragma once

#include <string>

#include "ingest/crs/geo_frame.h"

namespace scarp::test {

/// A frame around a place of a CRS, with all else as it is unless asked for.
inline FrameDescription frame_at(const std::string& crs, double x, double y) {
  FrameDescription description;
  description.crs_wkt = crs;
  description.centre_x = x;
  description.centre_y = y;
  return description;
}

}  // namespace scarp::test
