#include "core/culling/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

/// Far more than the rounding of a ray's direction, radians; and of a share of the picture.
constexpr double kViewWidening = 0x1p-30;

/// Whether the picture shows straight up (1) or straight down (-1).
bool shows_vertical(const Projection& projection, double up) {
  const double x = projection.rows[2] * up, y = projection.rows[6] * up;
  const double w = projection.rows[14] * up;
  return std::max(std::abs(x), std::abs(y)) <= w * (1 + kViewWidening) + kViewWidening;
}

}  // namespace

Camera camera_of(const Shot& shot) {
  const Projection projection = look_at(shot.view, shot.width_px, shot.height_px);
  Camera camera{shot.view.eye, {}, shot};
  // Where the vertical is in the picture it shows every azimuth.
  if (shows_vertical(projection, 1) || shows_vertical(projection, -1)) return camera;
  // Otherwise the rays make a convex cone beside the vertical: its corners reach farthest.
  const auto azimuth_rad = [&](double x, double y) {
    const Position ray = ray_through(projection, x, y);
    return std::atan2(ray.y_m, ray.x_m);
  };
  const double middle_rad = azimuth_rad(0, 0);
  double least_rad = 0, greatest_rad = 0;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0}) {
      const double turn_rad = std::remainder(azimuth_rad(x, y) - middle_rad, 2 * std::numbers::pi);
      least_rad = std::min(least_rad, turn_rad);
      greatest_rad = std::max(greatest_rad, turn_rad);
    }
  camera.view =
      ViewRange{middle_rad + least_rad - kViewWidening, middle_rad + greatest_rad + kViewWidening};
  return camera;
}

}  // namespace scarp
