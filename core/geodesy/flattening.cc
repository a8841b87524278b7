#include "core/geodesy/flattening.h"

#include <cassert>
#include <cmath>

namespace scarp {
namespace {

double dot(const EcefPoint& a, const EcefPoint& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}

EcefPoint difference(const EcefPoint& a, const EcefPoint& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
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

Flattening::Flattening(const EcefPoint& centre, double refraction, const EcefPoint& origin)
    : origin_(origin) {
  const EcefPoint radius = difference(centre, origin);
  scale_m_ = std::sqrt(dot(radius, radius));
  bend_m_ = refraction * scale_m_ * (scale_m_ / kEarthRadiusM);
  assert(scale_m_ > 0);
  assert(refraction >= 0 && refraction <= 1);
  up_ = unit(radius);
  // At a pole every direction is south; the x axis of ECEF serves as east there.
  const EcefPoint polar{0, 0, 1};
  const EcefPoint east = cross(polar, up_);
  east_ = dot(east, east) > 0 ? unit(east) : EcefPoint{1, 0, 0};
  north_ = cross(up_, east_);
}

Position Flattening::flatten(const EcefPoint& point) const {
  const EcefPoint radius = difference(point, origin_);
  const double height_m = dot(radius, up_);
  assert(height_m > 0);
  const double x = dot(radius, east_) / height_m;
  const double y = dot(radius, north_) / height_m;
  // sqrt(1 + s) - 1 = s / (sqrt(1 + s) + 1) keeps every digit near the centre.
  const double s = x * x + y * y;
  const double bend_m = bend_m_ * s / (std::sqrt(1 + s) + 1);
  return {scale_m_ * x, scale_m_ * y, scale_m_ * ((height_m - scale_m_) / height_m) + bend_m};
}

double Flattening::cosine_from_centre(const EcefPoint& point) const {
  return dot(unit(difference(point, origin_)), up_);
}

EcefPoint Flattening::unflatten(const Position& p) const {
  const double x = p.x_m / scale_m_;
  const double y = p.y_m / scale_m_;
  const double s = x * x + y * y;
  const double bend_m = bend_m_ * s / (std::sqrt(1 + s) + 1);
  const double height_m = scale_m_ / (1 - (p.z_m - bend_m) / scale_m_);
  return {origin_.x_m + height_m * (x * east_.x_m + y * north_.x_m + up_.x_m),
          origin_.y_m + height_m * (x * east_.y_m + y * north_.y_m + up_.y_m),
          origin_.z_m + height_m * (x * east_.z_m + y * north_.z_m + up_.z_m)};
}

}  // namespace scarp
