#include "core/viewshed/view_limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/memory/large_array.h"
#include "core/viewshed/plan_frame.h"

namespace scarp {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

double dot(const EcefPoint& a, const EcefPoint& b) {
  return a.x_m * b.x_m + a.y_m * b.y_m + a.z_m * b.z_m;
}
EcefPoint cross(const EcefPoint& a, const EcefPoint& b) {
  return {a.y_m * b.z_m - a.z_m * b.y_m, a.z_m * b.x_m - a.x_m * b.z_m,
          a.x_m * b.y_m - a.y_m * b.x_m};
}

double azimuth_of(double east, double north) {
  const double azimuth = std::atan2(east, north);
  return azimuth < 0 ? azimuth + kTurn : azimuth;
}

}  // namespace

EyeBearings::EyeBearings(const Position& eye, const std::optional<EarthFrame>& earth)
    : eye_(eye), earth_(earth) {
  if (!earth_) return;
  eye_ecef_ = earth_->frame.unflatten(eye);
  const EllipsoidNormal normal = ellipsoid_normal(*earth_, eye_ecef_);
  up_ = normal.up;
  height_m_ = normal.height_m;
  // At a pole every direction is south; the x axis of ECEF serves as east there.
  const EcefPoint east = cross({0, 0, 1}, up_);
  const double length = std::sqrt(dot(east, east));
  east_ = length > 0 ? EcefPoint{east.x_m / length, east.y_m / length, 0} : EcefPoint{1, 0, 0};
  north_ = cross(up_, east_);
}

Bearing EyeBearings::to(const Position& target) const {
  if (!earth_) {
    const double east_m = target.x_m - eye_.x_m, north_m = target.y_m - eye_.y_m;
    const double distance_m = std::hypot(east_m, north_m);
    return {distance_m, azimuth_of(east_m, north_m), std::atan2(target.z_m - eye_.z_m, distance_m)};
  }
  const EcefPoint at = earth_->frame.unflatten(target);
  const EcefPoint line{at.x_m - eye_ecef_.x_m, at.y_m - eye_ecef_.y_m, at.z_m - eye_ecef_.z_m};
  const double east_m = dot(line, east_), north_m = dot(line, north_), up_m = dot(line, up_);
  const double level_m = std::hypot(east_m, north_m);
  const double azimuth_rad = azimuth_of(east_m, north_m);
  const EllipsoidNormal normal = ellipsoid_normal(*earth_, at);
  // Euler's radius of curvature in the direction of the line, halfway between its ends.
  const double e2 = earth_->flattening * (2 - earth_->flattening);
  const double middle_z = (normal.up.z_m + up_.z_m) / 2;
  const double w2 = 1 - e2 * middle_z * middle_z;
  const double normal_m = earth_->semi_major_m / std::sqrt(w2);
  const double meridian_m = normal_m * (1 - e2) / w2;
  const double sine = std::sin(azimuth_rad), cosine = std::cos(azimuth_rad);
  const double radius_m = 1 / (cosine * cosine / meridian_m + sine * sine / normal_m);
  const double rise_m = normal.height_m - height_m_;
  const double chord2 = (dot(line, line) - rise_m * rise_m) /
                        ((1 + height_m_ / radius_m) * (1 + normal.height_m / radius_m));
  const double half_chord = std::sqrt(std::max(chord2, 0.0)) / (2 * radius_m);
  return {2 * radius_m * std::asin(std::min(half_chord, 1.0)), azimuth_rad,
          std::atan2(up_m, level_m)};
}

bool EyeBearings::surely_within(const ViewLimits& limits, const Position& target) const {
  if (!limits.only_distance()) return false;
  const double reach_m = std::min(limits.max_distance_m, kShortM) / 1.01;
  if (!earth_) {
    const double east_m = target.x_m - eye_.x_m, north_m = target.y_m - eye_.y_m;
    return east_m * east_m + north_m * north_m < reach_m * reach_m;
  }
  const EcefPoint at = earth_->frame.unflatten(target);
  const EcefPoint line{at.x_m - eye_ecef_.x_m, at.y_m - eye_ecef_.y_m, at.z_m - eye_ecef_.z_m};
  return dot(line, line) < reach_m * reach_m;
}

double EyeBearings::apparent_pitch_rad(const Position& target) const {
  if (!earth_) return to(target).pitch_rad;
  // The tangent as the chord between two places of the ray, so near that it errs by rounding only.
  constexpr double kReachM = 16;
  const double run_x = target.x_m - eye_.x_m, run_y = target.y_m - eye_.y_m;
  const double share = kReachM / std::hypot(run_x, run_y, target.z_m - eye_.z_m);
  const auto at = [&](double part) {
    return earth_->frame.unflatten({eye_.x_m + part * run_x, eye_.y_m + part * run_y,
                                    eye_.z_m + part * (target.z_m - eye_.z_m)});
  };
  const EcefPoint behind = at(-share), ahead = at(share);
  const EcefPoint ray{ahead.x_m - behind.x_m, ahead.y_m - behind.y_m, ahead.z_m - behind.z_m};
  return std::atan2(dot(ray, up_), std::hypot(dot(ray, east_), dot(ray, north_)));
}

double EyeBearings::plane_direction_rad(double azimuth_rad) const {
  if (!earth_) return std::numbers::pi / 2 - azimuth_rad;
  constexpr double kHalfChordM = 500;
  const double east_m = kHalfChordM * std::sin(azimuth_rad);
  const double north_m = kHalfChordM * std::cos(azimuth_rad);
  const auto at = [&](double part) {
    return earth_->frame.flatten(
        {eye_ecef_.x_m + part * (east_m * east_.x_m + north_m * north_.x_m),
         eye_ecef_.y_m + part * (east_m * east_.y_m + north_m * north_.y_m),
         eye_ecef_.z_m + part * (east_m * east_.z_m + north_m * north_.z_m)});
  };
  const Position behind = at(-1), ahead = at(1);
  return std::atan2(ahead.y_m - behind.y_m, ahead.x_m - behind.x_m);
}

Bearing EyeBearings::to_far(const EcefPoint& ecef) const {
  const double east = earth_ ? dot(ecef, east_) : ecef.x_m;
  const double north = earth_ ? dot(ecef, north_) : ecef.y_m;
  const double up = earth_ ? dot(ecef, up_) : ecef.z_m;
  return {std::numeric_limits<double>::infinity(), azimuth_of(east, north),
          std::atan2(up, std::hypot(east, north))};
}

bool within(const ViewLimits& limits, const Bearing& bearing) {
  if (bearing.distance_m < limits.min_distance_m || bearing.distance_m > limits.max_distance_m)
    return false;
  if (bearing.pitch_rad < limits.min_pitch_rad || bearing.pitch_rad > limits.max_pitch_rad)
    return false;
  // What is under the eye has no azimuth.
  if (!limits.azimuth_begin_rad || bearing.distance_m == 0) return true;
  const double begin = *limits.azimuth_begin_rad, end = *limits.azimuth_end_rad;
  const double at = bearing.azimuth_rad;
  return begin <= end ? at >= begin && at <= end : at >= begin || at <= end;
}

SampleWindow whole_window(const GroundGrid& grid) {
  return {0, 0, grid.columns() - 1, grid.rows() - 1};
}

SampleWindow reach_window(const GroundGrid& grid, const Position& eye, const EyeBearings& bearings,
                          double max_distance_m) {
  const SampleWindow whole = whole_window(grid);
  const PlanFrame frame = plan_frame(grid, eye);
  const double samples_per_m =
      std::max(std::hypot(frame.across_x, frame.across_y), std::hypot(frame.down_x, frame.down_y));
  // The samples in reach are one piece around the eye: none is outside where the window's border
  // is out of reach. Where the map stretches, the first guess is too small.
  constexpr double kGrowth = 1.1;
  for (double reach = max_distance_m * samples_per_m * 1.01 + 3;; reach *= kGrowth) {
    const auto at = [](double index, std::int32_t last) {
      return static_cast<std::int32_t>(std::clamp(index, -1.0, last + 1.0));
    };
    SampleWindow window{at(std::floor(frame.eye_column - reach), whole.last_column),
                        at(std::floor(frame.eye_row - reach), whole.last_row),
                        at(std::ceil(frame.eye_column + reach), whole.last_column),
                        at(std::ceil(frame.eye_row + reach), whole.last_row)};
    const auto out_of_reach = [&](std::int32_t column, std::int32_t row) {
      if (column < 0 || row < 0 || column > whole.last_column || row > whole.last_row) return true;
      return bearings.to(grid.at(column, row)).distance_m > max_distance_m;
    };
    bool holds = true;
    for (std::int32_t c = window.first_column; holds && c <= window.last_column; ++c)
      holds = out_of_reach(c, window.first_row) && out_of_reach(c, window.last_row);
    for (std::int32_t r = window.first_row; holds && r <= window.last_row; ++r) {
      holds = out_of_reach(window.first_column, r) && out_of_reach(window.last_column, r);
      constexpr std::int32_t kRowsAtOnce = 64;  // each with pages of its own
      if (r % kRowsAtOnce == 0) relieve_large_memory();
    }
    if (!holds) continue;
    return {std::max(window.first_column, 0), std::max(window.first_row, 0),
            std::min(window.last_column, whole.last_column),
            std::min(window.last_row, whole.last_row)};
  }
}

}  // namespace scarp
