#include "tiles/tileset/tileset_frame.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/geodesy/earth_frame.h"

namespace scarp {
namespace {

double dot(const TilePoint& a, const TilePoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

TilePoint cross(const TilePoint& a, const TilePoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

TilePoint times(const TilePoint& a, double factor) {
  return {a[0] * factor, a[1] * factor, a[2] * factor};
}

TilePoint plus(const TilePoint& a, const TilePoint& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

TilePoint unit(const TilePoint& a) {
  return times(a, 1 / std::sqrt(dot(a, a)));
}

/// x made level, y to its left, z.
std::array<TilePoint, 3> level_axes(const TilePoint& x, const TilePoint& up) {
  const TilePoint y = unit(cross(up, x));
  return {cross(y, up), y, up};
}

}  // namespace

TilesetFrame::TilesetFrame(const EcefPoint& centre, const EcefPoint& ahead) : centre_(centre) {
  const EcefPoint up = ellipsoid_normal(kWgs84, centre).up;
  axes_ = level_axes({ahead.x_m - centre.x_m, ahead.y_m - centre.y_m, ahead.z_m - centre.z_m},
                     {up.x_m, up.y_m, up.z_m});
}

TilePoint TilesetFrame::from_ecef(const EcefPoint& p) const {
  const TilePoint d = {p.x_m - centre_.x_m, p.y_m - centre_.y_m, p.z_m - centre_.z_m};
  return {dot(d, axes_[0]), dot(d, axes_[1]), dot(d, axes_[2])};
}

EcefPoint TilesetFrame::to_ecef(const TilePoint& p) const {
  const auto along = [&](std::size_t i) {
    return p[0] * axes_[0][i] + p[1] * axes_[1][i] + p[2] * axes_[2][i];
  };
  return {centre_.x_m + along(0), centre_.y_m + along(1), centre_.z_m + along(2)};
}

TilePoint TilesetFrame::up_at(const TilePoint& p) const {
  const EcefPoint up = ellipsoid_normal(kWgs84, to_ecef(p)).up;
  const TilePoint d = {up.x_m, up.y_m, up.z_m};
  return {dot(d, axes_[0]), dot(d, axes_[1]), dot(d, axes_[2])};
}

std::array<double, 16> TilesetFrame::transform() const {
  const auto& [x, y, z] = axes_;
  return {x[0], x[1], x[2], 0, y[0],        y[1],        y[2],        0,
          z[0], z[1], z[2], 0, centre_.x_m, centre_.y_m, centre_.z_m, 1};
}

double step_for(double reach_m) {
  double step_m = kFinestStepM;
  while (step_m * kFloatSteps < reach_m) step_m *= 2;
  return step_m;
}

TilePoint round_to_step(const TilePoint& p, double step_m) {
  return {std::nearbyint(p[0] / step_m) * step_m, std::nearbyint(p[1] / step_m) * step_m,
          std::nearbyint(p[2] / step_m) * step_m};
}

std::array<double, 12> TileBox::numbers() const {
  std::array<double, 12> all{};
  std::copy(centre.begin(), centre.end(), all.begin());
  for (std::size_t i = 0; i < 3; ++i)
    std::copy(half_axes[i].begin(), half_axes[i].end(), all.begin() + 3 + 3 * static_cast<int>(i));
  return all;
}

std::array<TilePoint, 8> TileBox::corners() const {
  std::array<TilePoint, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    corners[i] = centre;
    for (std::size_t axis = 0; axis < 3; ++axis)
      corners[i] = plus(corners[i], times(half_axes[axis], (i >> axis & 1) != 0 ? 1 : -1));
  }
  return corners;
}

TileBox box_around(const TilesetFrame& frame, std::span<const TilePoint> points) {
  assert(!points.empty());
  TilePoint low = points[0], high = points[0];
  for (const TilePoint& p : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  const auto axes = level_axes({1, 0, 0}, frame.up_at(times(plus(low, high), 0.5)));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  TilePoint least = {kInfinity, kInfinity, kInfinity}, greatest = times(least, -1);
  for (const TilePoint& p : points) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double at = dot(p, axes[i]);
      least[i] = std::min(least[i], at);
      greatest[i] = std::max(greatest[i], at);
    }
  }
  // Rounding of the axes and sums, and what keeps a flat box from having no height.
  constexpr double kMarginM = 0.01;
  TileBox box;
  for (std::size_t i = 0; i < 3; ++i) {
    box.centre = plus(box.centre, times(axes[i], (least[i] + greatest[i]) / 2));
    box.half_axes[i] = times(axes[i], (greatest[i] - least[i]) / 2 + kMarginM);
  }
  return box;
}

}  // namespace scarp
