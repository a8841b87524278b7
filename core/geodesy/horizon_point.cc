#include "core/geodesy/horizon_point.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Allowance for the rounding of angles, radians: 60 nm on the ground.
constexpr double kAngleRounding = 1e-14;

/// No farther out than this many radii: beyond, the point would tell single bits of an angle.
constexpr double kGreatestAngle = std::numbers::pi / 2 - 1e-6;

double length(const EcefPoint& p) {
  return std::sqrt(p.x_m * p.x_m + p.y_m * p.y_m + p.z_m * p.z_m);
}

}  // namespace

std::optional<EcefPoint> horizon_point(std::span<const EcefPoint> points, const EcefPoint& towards,
                                       const Ellipsoid& ellipsoid, double depth_m) {
  assert(depth_m >= 0 && depth_m < ellipsoid.semi_minor_m());
  const double a = ellipsoid.semi_major_m, b = ellipsoid.semi_minor_m();
  const auto scaled = [&](const EcefPoint& p) {
    return EcefPoint{p.x_m / a, p.y_m / a, p.z_m / b};
  };
  EcefPoint d = scaled(towards);
  const double size = length(d);
  d = {d.x_m / size, d.y_m / size, d.z_m / size};
  const double rho = 1 - depth_m / b;
  double widest = 0;
  for (const EcefPoint& point : points) {
    const EcefPoint q = scaled(point);
    const double radius = length(q);
    const EcefPoint cross = {d.y_m * q.z_m - d.z_m * q.y_m, d.z_m * q.x_m - d.x_m * q.z_m,
                             d.x_m * q.y_m - d.y_m * q.x_m};
    // atan2 keeps small angles, which acos would lose.
    const double alpha = std::atan2(length(cross), d.x_m * q.x_m + d.y_m * q.y_m + d.z_m * q.z_m);
    const double beta = std::acos(std::min(1.0, rho / radius));
    widest = std::max(widest, alpha + beta);
  }
  const double angle = widest + std::acos(rho) + kAngleRounding;
  if (!(angle < kGreatestAngle)) return {};
  const double out = 1 / std::cos(angle);
  return EcefPoint{d.x_m * out, d.y_m * out, d.z_m * out};
}

}  // namespace scarp
