#include "core/viewshed/ray_horizon.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {

Position ray_end(const Position& eye, double direction_rad, double reach_m) {
  const double x = std::cos(direction_rad), y = std::sin(direction_rad);
  const auto inside_m = [](double from_m, double step) {
    const double room_m = step < 0 ? from_m + kLatticeReachM : kLatticeReachM - from_m;
    return step == 0 ? kLatticeReachM : room_m / std::abs(step);
  };
  const double run_m = std::min({reach_m, inside_m(eye.x_m, x), inside_m(eye.y_m, y)});
  return round_to_lattice(Position{eye.x_m + run_m * x, eye.y_m + run_m * y, eye.z_m});
}

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
