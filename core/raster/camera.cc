#include "core/raster/camera.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

Position minus(const Position& a, const Position& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
}

double dot(const Position& a, const Position& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}

Position cross(const Position& a, const Position& b) {
  return {a.y_m * b.z_m - a.z_m * b.y_m, a.z_m * b.x_m - a.x_m * b.z_m,
          a.x_m * b.y_m - a.y_m * b.x_m};
}

Position unit(const Position& a) {
  const double length = std::sqrt(dot(a, a));
  assert(length > 0);
  return {a.x_m / length, a.y_m / length, a.z_m / length};
}

/// The camera's axes as unit vectors.
struct Axes {
  Position right;
  Position up;
  Position forward;
};

Axes axes_of(const Position& forward_m, const Position& up_m) {
  // Below this sine between view and `up` the picture's up would be rounding noise.
  constexpr double kLeastSine = 1e-6;
  const Position forward = unit(forward_m);
  Position right = cross(forward, unit(up_m));
  if (dot(right, right) < kLeastSine * kLeastSine) right = cross(forward, {0, 1, 0});
  right = unit(right);
  return {right, cross(right, forward), forward};
}

/// Least whole-looking factor (1, 1.5, 2, 3, 5, ...) that lifts the relief to the wanted share.
double exaggeration_for(double relief_m, double extent_m) {
  constexpr double kWantedRelief = 0.1;
  if (relief_m <= 0) return 1;
  for (const double factor : {1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0}) {
    if (relief_m * factor >= kWantedRelief * extent_m) return factor;
  }
  return 20;
}

/// Finds the eye from which, looking along the axes, every point is just inside the picture: the
/// four side planes are pushed against the points, and the farther back of both directions decides.
class Fit {
 public:
  Fit(const Axes& axes, double tangent_x, double tangent_y)
      : axes_(axes), tangent_x_(tangent_x), tangent_y_(tangent_y) {}

  void add(const Position& p) {
    const double x = dot(p, axes_.right);
    const double y = dot(p, axes_.up);
    const double ahead = dot(p, axes_.forward);
    right_ = std::max(right_, x - tangent_x_ * ahead);
    left_ = std::max(left_, -x - tangent_x_ * ahead);
    top_ = std::max(top_, y - tangent_y_ * ahead);
    bottom_ = std::max(bottom_, -y - tangent_y_ * ahead);
  }

  /// Requires a point added. The eye is `back_m` farther back than it need be.
  Position eye(double back_m) const {
    const double x = (right_ - left_) / 2;
    const double y = (top_ - bottom_) / 2;
    const double ahead =
        std::min(-(right_ + left_) / (2 * tangent_x_), -(top_ + bottom_) / (2 * tangent_y_)) -
        back_m;
    const auto along = [&](double Position::*c) {
      return x * axes_.right.*c + y * axes_.up.*c + ahead * axes_.forward.*c;
    };
    return {along(&Position::x_m), along(&Position::y_m), along(&Position::z_m)};
  }

 private:
  static constexpr double kNothing = std::numeric_limits<double>::lowest();
  Axes axes_;
  double tangent_x_;
  double tangent_y_;
  double right_ = kNothing;
  double left_ = kNothing;
  double top_ = kNothing;
  double bottom_ = kNothing;
};

}  // namespace

ClipPosition Projection::project(const Position& p) const {
  const auto row = [&](std::size_t r) {
    return rows[4 * r] * p.x_m + rows[4 * r + 1] * p.y_m + rows[4 * r + 2] * p.z_m +
           rows[4 * r + 3];
  };
  return {row(0), row(1), row(2), row(3)};
}

Position exaggerated(const View& view, const Position& p) {
  return {p.x_m, p.y_m, view.base_z_m + (p.z_m - view.base_z_m) * view.vertical_exaggeration};
}

Projection look_at(const View& view, int width_px, int height_px) {
  assert(width_px > 0 && height_px > 0 && view.near_m > 0);
  assert(view.vertical_field_of_view_rad > 0 && view.vertical_field_of_view_rad < std::numbers::pi);
  const Axes axes = axes_of(minus(view.target, view.eye), view.up);
  const double scale_y = 1 / std::tan(view.vertical_field_of_view_rad / 2);
  const double scale_x = scale_y * height_px / width_px;

  Projection projection;
  const auto set_row = [&](std::size_t r, const Position& axis, double scale) {
    projection.rows[4 * r] = scale * axis.x_m;
    projection.rows[4 * r + 1] = scale * axis.y_m;
    projection.rows[4 * r + 2] = scale * axis.z_m;
    projection.rows[4 * r + 3] = -scale * dot(axis, view.eye);
  };
  set_row(0, axes.right, scale_x);
  set_row(1, axes.up, scale_y);
  projection.rows[11] = view.near_m;
  set_row(3, axes.forward, 1);
  return projection;
}

Position ray_through(const Projection& projection, double x, double y) {
  // The first two rows are axes times a scale, whose square is their length's.
  const auto row = [&](std::size_t r) {
    return Position{projection.rows[4 * r], projection.rows[4 * r + 1], projection.rows[4 * r + 2]};
  };
  const Position right = row(0), up = row(1), forward = row(3);
  const double along_right = x / dot(right, right), along_up = y / dot(up, up);
  const auto sum = [&](double Position::*c) {
    return forward.*c + along_right * right.*c + along_up * up.*c;
  };
  return {sum(&Position::x_m), sum(&Position::y_m), sum(&Position::z_m)};
}

Projection ortho_from_above(const Bounds& bounds, int width_px, int height_px, double margin_px) {
  assert(width_px > 2 * margin_px && height_px > 2 * margin_px);
  const double extent_x_m = bounds.high.x_m - bounds.low.x_m;
  const double extent_y_m = bounds.high.y_m - bounds.low.y_m;
  const double relief_m = bounds.high.z_m - bounds.low.z_m;
  double px_m =
      std::max(extent_x_m / (width_px - 2 * margin_px), extent_y_m / (height_px - 2 * margin_px));
  if (px_m <= 0) px_m = 1;  // a scene of one point

  Projection projection;
  projection.rows[0] = 2 / (px_m * width_px);
  projection.rows[3] = -projection.rows[0] * (bounds.low.x_m + extent_x_m / 2);
  projection.rows[5] = 2 / (px_m * height_px);
  projection.rows[7] = -projection.rows[5] * (bounds.low.y_m + extent_y_m / 2);
  projection.rows[10] = relief_m > 0 ? 1 / relief_m : 0;
  projection.rows[11] = -projection.rows[10] * bounds.low.z_m;
  projection.rows[15] = 1;
  return projection;
}

View default_view(std::span<const Position> ground, int width_px, int height_px) {
  constexpr double kAzimuthRad =
      200 * std::numbers::pi / 180;  // where the eye is: south-south-west
  constexpr double kElevationRad = 33 * std::numbers::pi / 180;
  constexpr double kFilled = 0.95;  // of the picture is taken by the ground
  const Bounds bounds = bounds_of(ground);
  const double extent_x_m = bounds.high.x_m - bounds.low.x_m;
  const double extent_y_m = bounds.high.y_m - bounds.low.y_m;
  const double extent_m = std::max({extent_x_m, extent_y_m, 1.0});

  View view;
  view.base_z_m = bounds.low.z_m;
  view.vertical_field_of_view_rad = 0.5;
  view.vertical_exaggeration =
      exaggeration_for(bounds.high.z_m - bounds.low.z_m, std::min(extent_x_m, extent_y_m));
  const Position forward = {-std::sin(kAzimuthRad) * std::cos(kElevationRad),
                            -std::cos(kAzimuthRad) * std::cos(kElevationRad),
                            -std::sin(kElevationRad)};
  const double tangent_y = kFilled * std::tan(view.vertical_field_of_view_rad / 2);
  Fit fit(axes_of(forward, view.up), tangent_y * width_px / height_px, tangent_y);
  const double block_base_z_m = bounds.low.z_m - kBlockBaseShare * extent_m;
  for (const Position& p : ground) {
    fit.add(exaggerated(view, p));
    fit.add({p.x_m, p.y_m, block_base_z_m});
  }
  // Ground without extent would put the eye into it: a little farther back, and a near plane.
  view.near_m = 0.001 * extent_m;
  view.eye = fit.eye(2 * view.near_m);
  view.target = {view.eye.x_m + extent_m * forward.x_m, view.eye.y_m + extent_m * forward.y_m,
                 view.eye.z_m + extent_m * forward.z_m};
  return view;
}

std::vector<ClipPosition> project_all(const Projection& projection,
                                      std::span<const Position> positions) {
  constexpr std::size_t kChunk = 1 << 14;
  std::vector<ClipPosition> clip(positions.size());
  parallel_for((positions.size() + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    const std::size_t end = std::min(positions.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) clip[i] = projection.project(positions[i]);
  });
  return clip;
}

}  // namespace scarp
