#include "cli/fly/flight_path.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>

#include "cli/fly/valley_way.h"
#include "core/error/error.h"
#include "core/occlusion/splitmix64.h"

namespace scarp {

namespace {

constexpr char kHeader[] = "x,y,height_m,azimuth_deg,pitch_deg";

/// How a kind of path is travelled.
struct Travel {
  double step_m;   ///< between frames
  double above_m;  ///< ground
  double pitch_deg;
  double look_ahead_m;  ///< how far along the way the camera looks
};

Travel travel_of(Route route) {
  switch (route) {
    case Route::kStreet:
    case Route::kWalk:
      return {2, 2, 0, 60};
    case Route::kDrive:
      return {15, 2, 0, 200};
    case Route::kHelicopter:
      return {40, 100, -5, 600};
    case Route::kAirliner:
      break;
  }
  return {250, 10'000, -12, 5000};
}

[[noreturn]] void refuse_line(const std::string& file, std::size_t line, const std::string& text) {
  throw Error(ErrorCode::kInput,
              fmt::format("'{}', line {}: '{}' is not a camera; five numbers {} were expected",
                          file, line, text, kHeader));
}

Waypoint parse_waypoint(const std::string& file, std::size_t line, const std::string& text) {
  std::array<double, 5> numbers;
  const char* at = text.data();
  const char* end = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto [rest, failure] = std::from_chars(at, end, numbers[i]);
    const bool is_last = i + 1 == numbers.size();
    if (failure != std::errc() || !std::isfinite(numbers[i]) ||
        (is_last ? rest != end : rest == end || *rest != ','))
      refuse_line(file, line, text);
    at = is_last ? rest : rest + 1;
  }
  if (std::abs(numbers[4]) > 90) refuse_line(file, line, text);
  return {{numbers[0], numbers[1], numbers[2]}, numbers[3], numbers[4]};
}

/// A polyline in plan by distance along it.
class Way {
 public:
  explicit Way(std::vector<PlanPoint> points) : points_(std::move(points)) {
    for (std::size_t i = 1; i < points_.size(); ++i)
      along_m_.push_back(along_m_.back() + std::hypot(points_[i].x_m - points_[i - 1].x_m,
                                                      points_[i].y_m - points_[i - 1].y_m));
  }

  double length_m() const { return along_m_.back(); }

  PlanPoint at(double along_m) const {
    const auto next = static_cast<std::size_t>(
        std::upper_bound(along_m_.begin() + 1, along_m_.end() - 1, along_m) - along_m_.begin());
    const double step_m = along_m_[next] - along_m_[next - 1];
    const double share = step_m > 0 ? (along_m - along_m_[next - 1]) / step_m : 0;
    const PlanPoint &a = points_[next - 1], &b = points_[next];
    return {a.x_m + share * (b.x_m - a.x_m), a.y_m + share * (b.y_m - a.y_m)};
  }

 private:
  std::vector<PlanPoint> points_;
  std::vector<double> along_m_ = {0};
};

/// A straight line over the middle of the scene.
std::vector<PlanPoint> straight_way(const Bounds& bounds, std::uint64_t seed) {
  SplitMix64 random(seed);
  const double turn_rad = 2 * std::numbers::pi * random.unit();
  const double reach_m =
      std::min(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m) / 2;
  const double x_m = (bounds.low.x_m + bounds.high.x_m) / 2;
  const double y_m = (bounds.low.y_m + bounds.high.y_m) / 2;
  const double dx_m = reach_m * std::cos(turn_rad), dy_m = reach_m * std::sin(turn_rad);
  return {{x_m - dx_m, y_m - dy_m}, {x_m + dx_m, y_m + dy_m}};
}

/// The azimuth that leaves a point in a direction of the plane: directions fall as azimuths rise,
/// nearly as fast, so that a few corrections find it.
double azimuth_deg(const GeoFrame::Placer& placer, const MapPoint& from, double direction_rad) {
  double azimuth = 0;
  for (int i = 0; i < 4; ++i) {
    const double off_rad = std::remainder(placer.plane_direction_rad(from, azimuth) - direction_rad,
                                          2 * std::numbers::pi);
    azimuth += off_rad * 180 / std::numbers::pi;
  }
  return azimuth - 360 * std::floor(azimuth / 360);
}

double mean_height_m(const Tin& tin) {
  double sum_m = 0;
  for (const Position& p : tin.vertices) sum_m += p.z_m;
  return sum_m / static_cast<double>(tin.vertices.size());
}

}  // namespace

Route route_of(const std::string& name) {
  if (name == "street") return Route::kStreet;
  if (name == "walk") return Route::kWalk;
  if (name == "drive") return Route::kDrive;
  return name == "helicopter" ? Route::kHelicopter : Route::kAirliner;
}

std::vector<Waypoint> read_path(const std::string& file) {
  std::ifstream in(file);
  std::string text;
  if (!in || !std::getline(in, text))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': cannot be read; a path was expected: {}, then a line a frame",
                            file, kHeader));
  const auto without_return = [&] {
    if (!text.empty() && text.back() == '\r') text.pop_back();
  };
  without_return();
  if (text != kHeader)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': begins with '{}'; {} was expected", file, text, kHeader));
  std::vector<Waypoint> path;
  for (std::size_t line = 2; std::getline(in, text); ++line) {
    without_return();
    if (!text.empty()) path.push_back(parse_waypoint(file, line, text));
  }
  if (path.empty())
    throw Error(ErrorCode::kInput, fmt::format("'{}': no frame; at least one was expected", file));
  return path;
}

std::string to_csv(const std::vector<Waypoint>& path) {
  std::string csv = std::string(kHeader) + "\n";
  for (const Waypoint& w : path)
    csv += fmt::format("{:.10g},{:.10g},{:.3f},{:.4f},{:.4f}\n", w.eye.x, w.eye.y, w.eye.height_m,
                       w.azimuth_deg, w.pitch_deg);
  return csv;
}

std::vector<Waypoint> find_path(const FlownGround& ground, Route route, int frames,
                                std::uint64_t seed) {
  const Travel travel = travel_of(route);
  std::vector<PlanPoint> points = route == Route::kAirliner
                                      ? straight_way(bounds_of(ground.tin.vertices), seed)
                                  : route == Route::kStreet ? street_way(ground.index, seed)
                                                            : valley_way(ground.index, seed);
  if (points.size() < 2)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': has no two places of ground that are connected; give --path",
                            ground.name));
  const Way way(std::move(points));
  const GeoFrame::Placer placer(ground.frame);
  const double mean_m = mean_height_m(ground.tin);
  std::vector<Waypoint> path;
  for (int i = 0; i < frames; ++i) {
    const double along_m = i * travel.step_m;
    if (along_m + travel.look_ahead_m > way.length_m() && i > 0) break;
    const PlanPoint at = way.at(along_m);
    const PlanPoint ahead = way.at(std::min(along_m + travel.look_ahead_m, way.length_m()));
    Position p = round_to_lattice(Position{at.x_m, at.y_m, 0});
    const auto ground_m = ground.index.ground_height_m(p.x_m, p.y_m);
    if (route == Route::kAirliner)
      p.z_m = mean_m + travel.above_m;
    else if (ground_m)
      p.z_m = *ground_m + travel.above_m;
    else
      continue;  // a small void on the way
    Waypoint waypoint{placer.unplace(p), 0, travel.pitch_deg};
    waypoint.azimuth_deg =
        azimuth_deg(placer, waypoint.eye, std::atan2(ahead.y_m - at.y_m, ahead.x_m - at.x_m));
    path.push_back(waypoint);
  }
  return path;
}

Shot shot_at(const GeoFrame::Placer& placer, const Waypoint& waypoint, const Lens& lens) {
  constexpr double kAheadM = 1000;  // any length will do
  const double direction_rad = placer.plane_direction_rad(waypoint.eye, waypoint.azimuth_deg);
  const double pitch_rad = waypoint.pitch_deg * std::numbers::pi / 180;
  Shot shot;
  shot.width_px = lens.width_px;
  shot.height_px = lens.height_px;
  shot.view.eye = placer.place(waypoint.eye);
  shot.view.target = {shot.view.eye.x_m + kAheadM * std::cos(direction_rad) * std::cos(pitch_rad),
                      shot.view.eye.y_m + kAheadM * std::sin(direction_rad) * std::cos(pitch_rad),
                      shot.view.eye.z_m + kAheadM * std::sin(pitch_rad)};
  shot.view.vertical_field_of_view_rad = lens.vertical_field_of_view_deg * std::numbers::pi / 180;
  return shot;
}

}  // namespace scarp
