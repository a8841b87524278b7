#include "core/viewshed/sight_profile.h"

#include <cmath>

#include "core/viewshed/view_limits.h"

namespace scarp {
namespace {

EcefPoint on_earth(const std::optional<EarthFrame>& earth, const Position& p) {
  return earth ? earth->frame.unflatten(p) : EcefPoint{p.x_m, p.y_m, p.z_m};
}

double distance_m(const EcefPoint& a, const EcefPoint& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m);
}

}  // namespace

double fresnel_radius_m(double wavelength_m, double from_eye_m, double from_target_m) {
  return std::sqrt(wavelength_m * from_eye_m * from_target_m / (from_eye_m + from_target_m));
}

std::vector<ProfilePoint> sight_profile(const Position& eye, const Position& target,
                                        const GroundAlong& along,
                                        const std::optional<EarthFrame>& earth,
                                        double wavelength_m) {
  const EyeBearings bearings(eye, earth);
  const EcefPoint from = on_earth(earth, eye), to = on_earth(earth, target);
  std::vector<ProfilePoint> profile;
  profile.reserve(along.crossings.size());
  for (const GroundCrossing& crossing : along.crossings) {
    ProfilePoint point;
    point.ground = on_ground(eye, target, crossing);
    point.line = place_between(eye, target, to_double(crossing.at));
    point.distance_m = bearings.to(point.ground).distance_m;
    const EcefPoint line = on_earth(earth, point.line), ground = on_earth(earth, point.ground);
    point.clearance_m = std::copysign(distance_m(line, ground), point.line.z_m - point.ground.z_m);
    point.fresnel_radius_m =
        fresnel_radius_m(wavelength_m, distance_m(from, line), distance_m(line, to));
    point.blocks = crossing.blocks;
    point.void_before = crossing.void_before;
    profile.push_back(point);
  }
  return profile;
}

std::optional<double> least_free_height_m(const std::function<bool(double)>& is_free) {
  if (is_free(0)) return 0;
  if (!is_free(kGreatestFreeHeightM)) return {};
  double hidden_m = 0, free_m = kGreatestFreeHeightM;
  while (free_m - hidden_m > kLatticeStepM) {
    const double middle_m = round_to_lattice((hidden_m + free_m) / 2);
    (is_free(middle_m) ? free_m : hidden_m) = middle_m;
  }
  return free_m;
}

}  // namespace scarp
