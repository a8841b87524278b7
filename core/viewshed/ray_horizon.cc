#include "core/viewshed/ray_horizon.h"

#include <cmath>
#include <limits>

namespace scarp {

std::optional<RayHorizon> ray_horizon(const Position& eye, const Position& end,
                                      const GroundAlong& along) {
  const GroundCrossing* highest = nullptr;
  double greatest = -std::numeric_limits<double>::infinity();
  RayHorizon horizon;
  for (const GroundCrossing& crossing : along.crossings) {
    horizon.over_void = horizon.over_void || crossing.void_before;
    const double slope = (crossing.ground_z_m - eye.z_m) / to_double(crossing.at);
    if (slope < greatest) continue;
    greatest = slope;
    highest = &crossing;
  }
  if (!highest) return {};
  horizon.place = on_ground(eye, end, *highest);
  return horizon;
}

}  // namespace scarp
