#include "core/geodesy/flattening.h"

#include <cassert>
#include <cmath>

namespace scarp {
namespace {

double dot(const EcefPoint& a, const EcefPoint& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}

EcefPoint unit(const EcefPoint& a) {
  const double length = std::sqrt(dot(a, a));
  return {a.x_m / length, a.y_m / length, a.z_m / length};
}

EcefPoint cross(const EcefPoint& a, const EcefPoint& b) {
  return {a.y_m * b.z_m - a.z_m * b.y_m, a.z_m * b.x_m - a.x_m * b.z_m,
          a.x_m * b.y_m - a.y_m * b.x_m};
}

}  // namespace

Flattening::Flattening(const EcefPoint& centre, double refraction)
    : up_(unit(centre)), refraction_(refraction) {
  assert(dot(centre, centre) > 0);
  assert(refraction >= 0 && refraction <= 1);
  // At a pole every direction is south; the x axis of ECEF serves as east there.
  const EcefPoint polar{0, 0, 1};
  const EcefPoint east = cross(polar, up_);
  east_ = dot(east, east) > 0 ? unit(east) : EcefPoint{1, 0, 0};
  north_ = cross(up_, east_);
}

Position Flattening::flatten(const EcefPoint& point) const {
  const double height_m = dot(point, up_);
  assert(height_m > 0);
  const double x = dot(point, east_) / height_m;
  const double y = dot(point, north_) / height_m;
  // sqrt(1 + s) - 1 = s / (sqrt(1 + s) + 1) keeps every digit near the centre.
  const double s = x * x + y * y;
  const double bend = refraction_ * s / (std::sqrt(1 + s) + 1);
  return {kEarthRadiusM * x, kEarthRadiusM * y,
          kEarthRadiusM * ((height_m - kEarthRadiusM) / height_m + bend)};
}

EcefPoint Flattening::unflatten(const Position& p) const {
  const double x = p.x_m / kEarthRadiusM;
  const double y = p.y_m / kEarthRadiusM;
  const double s = x * x + y * y;
  const double bend = refraction_ * s / (std::sqrt(1 + s) + 1);
  const double height_m = kEarthRadiusM / (1 - (p.z_m / kEarthRadiusM - bend));
  return {height_m * (x * east_.x_m + y * north_.x_m + up_.x_m),
          height_m * (x * east_.y_m + y * north_.y_m + up_.y_m),
          height_m * (x * east_.z_m + y * north_.z_m + up_.z_m)};
}

}  // namespace scarp
