#pragma once

#include <vector>

#include "cli/sight_surface.h"

namespace scarp {

/// The horizon in one direction; without a place where no known ground lies that way.
struct HorizonLine {
  double azimuth_deg = 0;
  bool over_void = false;
  bool found = false;
  double elevation_deg = 0, distance_m = 0;
  double x = 0, y = 0;  ///< longitude and latitude; map coordinates on the flat earth
};

/// The horizon around an eye in equal steps of azimuth from north on: the work of `scarp horizon
/// --at` and of the server.
std::vector<HorizonLine> horizon_of(const SightSurface& surface, const SightEnd& eye, int azimuths);

}  // namespace scarp
