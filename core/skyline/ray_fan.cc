#include "core/skyline/ray_fan.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scarp {
namespace {

/// Slopes up to this lean sideways with their verticals within slack_rate.
constexpr double kSteepestLean = 1.5;

/// Least allowance for a change of course over a scene, lanes a line.
constexpr double kSwerve = 0.05;

/// Rounding to the lattice of a cell and of what its ray meets, either axis, metres.
constexpr double kRoundingM = 4 * kLatticeStepM;
/// Neighbouring blocks of a BlockPlacement disagree by less, metres (ingest/dem).
constexpr double kBlockSeamM = 0.6e-3;

/// Plan positions between the samples, on the ellipsoid's surface, by lane and line.
class PlanMap {
 public:
  PlanMap(const GroundGrid& grid, March march) : grid_(grid), march_(march) {}

  double lanes() const { return march_ == March::kOverRows ? grid_.columns() : grid_.rows(); }
  double lines() const { return march_ == March::kOverRows ? grid_.rows() : grid_.columns(); }

  /// Requires a place within the grid.
  Position at(double lane, double line) const {
    const double column = march_ == March::kOverRows ? lane : line;
    const double row = march_ == March::kOverRows ? line : lane;
    const auto c = std::clamp(static_cast<std::int32_t>(column), 0, grid_.columns() - 1);
    const auto r = std::clamp(static_cast<std::int32_t>(row), 0, grid_.rows() - 1);
    const double right = column - c, below = row - r;
    if (const auto* blocks = std::get_if<BlockPlacement>(&grid_.placement())) {
      const auto value = [&](BlockPlacement::Quantity quantity) {
        return BlockPlacement::Along(*blocks, quantity, c, r, below)
            .at(blocks->local(c) + right * (2.0 / blocks->side));
      };
      const double z = value(BlockPlacement::kHeight);
      return {value(BlockPlacement::kX) + value(BlockPlacement::kTiltX) * z,
              value(BlockPlacement::kY) + value(BlockPlacement::kTiltY) * z, z};
    }
    const std::int32_t next_c = std::min(c + 1, grid_.columns() - 1);
    const std::int32_t next_r = std::min(r + 1, grid_.rows() - 1);
    const auto between = [&](double Position::*axis) {
      const double north =
          grid_.at(c, r).*axis + right * (grid_.at(next_c, r).*axis - grid_.at(c, r).*axis);
      const double south = grid_.at(c, next_r).*axis +
                           right * (grid_.at(next_c, next_r).*axis - grid_.at(c, next_r).*axis);
      return north + below * (south - north);
    };
    return {between(&Position::x_m), between(&Position::y_m), 0};
  }

  /// Change of the place from one lane, or one line, to the next.
  std::array<double, 2> lane_step(double lane, double line) const {
    const double from = std::min(lane, lanes() - 2);
    return difference(at(from, line), at(from + 1, line));
  }
  std::array<double, 2> line_step(double lane, double line) const {
    const double from = std::min(line, lines() - 2);
    return difference(at(lane, from), at(lane, from + 1));
  }

  double seam_m() const {
    return std::holds_alternative<BlockPlacement>(grid_.placement()) ? kBlockSeamM : 0;
  }
  bool is_separable() const {
    return std::holds_alternative<SeparablePlacement>(grid_.placement());
  }

 private:
  static std::array<double, 2> difference(const Position& from, const Position& to) {
    return {to.x_m - from.x_m, to.y_m - from.y_m};
  }

  const GroundGrid& grid_;
  March march_;
};

/// A ray in the plane from a place of the map.
struct PlanRay {
  double lane, line;
  Position from;
  double x, y;  ///< unit direction

  PlanRay(const PlanMap& map, const std::optional<EarthFrame>& earth, double at_lane,
          double at_line, const AzimuthAt& azimuth)
      : lane(at_lane), line(at_line), from(map.at(at_lane, at_line)) {
    const EyeBearings bearings(from, earth);
    const double direction_rad = bearings.plane_direction_rad(azimuth(bearings));
    x = std::cos(direction_rad);
    y = std::sin(direction_rad);
  }

  /// How the ray begins: lanes and lines a metre.
  std::array<double, 2> course(const PlanMap& map) const {
    const auto a = map.lane_step(lane, line), b = map.line_step(lane, line);
    const double turn = a[0] * b[1] - a[1] * b[0];
    return {(x * b[1] - y * b[0]) / turn, (a[0] * y - a[1] * x) / turn};
  }

  struct Crossing {
    double place;  ///< lanes from the ray's begin
    double run_m;
  };

  /// Where it crosses a line; nothing outside the grid.
  std::optional<Crossing> cross(const PlanMap& map, double at_line, double guess_lanes) const {
    if (at_line < 0 || at_line > map.lines() - 1) return {};
    constexpr double kSettledLanes = 1e-11;
    double at = lane + guess_lanes;
    for (int i = 0; i < 4; ++i) {
      const double inside = std::clamp(at, 0.0, map.lanes() - 1);
      const Position p = map.at(inside, at_line);
      const auto step = map.lane_step(inside, at_line);
      const double off = (p.x_m - from.x_m) * y - (p.y_m - from.y_m) * x;
      const double before = at;
      at = inside - off / (step[0] * y - step[1] * x);
      if (std::abs(at - before) < kSettledLanes) break;
    }
    constexpr double kBorder = 1e-6;
    if (at < -kBorder || at > map.lanes() - 1 + kBorder) return {};
    const Position p = map.at(std::clamp(at, 0.0, map.lanes() - 1), at_line);
    return Crossing{at - lane, (p.x_m - from.x_m) * x + (p.y_m - from.y_m) * y};
  }
};

/// A polynomial of up to three terms through as many values (Newton's form).
struct Polynomial {
  std::array<double, 3> node{}, difference{};
  int terms = 0;

  void add(double at, double value) {
    double d = value - (*this)(at);
    for (int i = 0; i < terms; ++i) d /= at - node[static_cast<std::size_t>(i)];
    node[static_cast<std::size_t>(terms)] = at;
    difference[static_cast<std::size_t>(terms)] = d;
    ++terms;
  }
  double operator()(double at) const {
    double value = 0, factor = 1;
    for (int i = 0; i < terms; ++i) {
      value += difference[static_cast<std::size_t>(i)] * factor;
      factor *= at - node[static_cast<std::size_t>(i)];
    }
    return value;
  }
};

/// Makes a fan in steps that share much.
class FanMaker {
 public:
  FanMaker(const GroundGrid& grid, const std::optional<EarthFrame>& earth, double tilt, March march,
           const MarchTile& tile, const AzimuthAt& azimuth)
      : earth_(earth),
        tilt_(tilt),
        map_(grid, march),
        tile_(tile),
        azimuth_(azimuth),
        lane_(tile.first_lane + (tile.lanes - 1) / 2.0),
        line_(tile.first_line + (tile.lines - 1) / 2.0),
        middle_(map_, earth, lane_, line_, azimuth) {}

  RayFan make() {
    const auto course = middle_.course(map_);
    fan_.line_step = course[1] < 0 ? -1 : 1;
    along_ = course[0] / std::abs(course[1]);
    const auto lane_step = map_.lane_step(lane_, line_);
    lane_m_ = std::hypot(lane_step[0], lane_step[1]);
    line_run_m_ = 1 / std::abs(course[1]);
    fit_middle();
    fit_sides();
    fill_tables();
    measure();
    fit_elevation();
    return std::move(fan_);
  }

 private:
  /// Share of the way to the k-th line that a ray is off at, per line crossed.
  std::optional<PlanRay::Crossing> ratio(const PlanRay& ray, double k) const {
    auto found = ray.cross(map_, ray.line + fan_.line_step * k, along_ * k);
    if (found) {
      found->place /= k;
      found->run_m /= k;
    }
    return found;
  }

  /// The farthest line, counted from a ray's begin, at which it is still inside the grid.
  double reach(const PlanRay& ray) const {
    const double room_lines = fan_.line_step > 0 ? map_.lines() - 1 - ray.line : ray.line;
    const double room_lanes = along_ > 0 ? map_.lanes() - 1 - ray.lane : ray.lane;
    double k = std::min(room_lines, along_ == 0 ? room_lines : room_lanes / std::abs(along_));
    while (k >= 1 && !ratio(ray, k)) k = k * 0.98 - 0.01;
    return k;
  }

  void fit_middle() {
    const double reach_lines = reach(middle_);
    for (const double part : {1.0, 1 / 3.0, 2 / 3.0}) {
      const double k = reach_lines * part;
      if (k < 1) continue;
      const auto found = ratio(middle_, k);
      if (!found) continue;
      place_.add(k, found->place);
      run_.add(k, found->run_m);
    }
    if (place_.terms == 0) {
      place_.add(1, along_);
      run_.add(1, line_run_m_);
    }
    // The second derivative of k place(k), at its greatest.
    const double square = place_.terms > 1 ? std::abs(place_.difference[1]) : 0;
    const double cube = place_.terms > 2 ? std::abs(place_.difference[2]) : 0;
    const double lines = map_.lines();
    fan_.bulge = 2 * (square + 3 * cube * lines) + 1e-12;
    swerve_ = kSwerve + 2 * std::abs(place_(std::max(1.0, reach_lines)) - along_);
  }

  /// Slopes over the tile from the rays at the middles of its sides.
  void fit_sides() {
    fan_.stretch.middle = 1;
    const auto side = [&](double lanes_off, double lines_off, double& turn, double& stretch) {
      const double off = lanes_off + lines_off;  // one of them is 0
      if (off <= 0) return;
      double turn_sum = 0, stretch_sum = 0;
      int sides = 0;
      for (const double sign : {-1.0, 1.0}) {
        const PlanRay ray(map_, earth_, lane_ + sign * lanes_off, line_ + sign * lines_off,
                          azimuth_);
        const double k = std::max(1.0, reach(ray) / 2);
        const auto found = ratio(ray, k);
        if (!found) continue;
        turn_sum += sign * (found->place - place_(k)) / off;
        stretch_sum += sign * (found->run_m / run_(k) - 1) / off;
        ++sides;
      }
      if (sides == 0) return;
      turn = turn_sum / sides;
      stretch = stretch_sum / sides;
    };
    side((tile_.lanes - 1) / 2.0, 0, fan_.turn.per_lane, fan_.stretch.per_lane);
    side(0, (tile_.lines - 1) / 2.0, fan_.turn.per_line, fan_.stretch.per_line);
    if (is_exact()) fan_.turn = {};
    // What rounding makes of parallel rays; what it matters is measured.
    constexpr double kParallelLanes = 1e-6;
    if (std::abs(fan_.turn.per_lane) * tile_.lanes * map_.lines() < kParallelLanes)
      fan_.turn.per_lane = 0;
    if (std::abs(fan_.turn.per_line) * tile_.lines * map_.lines() < kParallelLanes)
      fan_.turn.per_line = 0;
  }

  /// Along a line of samples that all have the same x (or y) a ray keeps to it exactly.
  bool is_exact() const {
    constexpr double kAlongAxis = 1e-12;
    return map_.is_separable() && std::abs(along_) < kAlongAxis;
  }

  void fill_tables() {
    const std::int32_t last_line = tile_.first_line + tile_.lines - 1;
    const double room_lines = fan_.line_step > 0 ? map_.lines() - 1 - tile_.first_line : last_line;
    const std::int32_t last_lane = tile_.first_lane + tile_.lanes - 1;
    const double room_lanes = along_ > 0 ? map_.lanes() - 1 - tile_.first_lane : last_lane;
    // Beyond, every ray has left the grid sideways, whatever the course does on its way.
    const double along_least = std::abs(along_) - swerve_;
    const double lines = along_least <= 0
                             ? room_lines
                             : std::min(room_lines, std::ceil(room_lanes / along_least) + 2);
    const auto count = static_cast<std::size_t>(lines) + 1;
    fan_.place.resize(count);
    fan_.inverse_run.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto k = static_cast<double>(i);
      fan_.place[i] = is_exact() ? 0 : k * place_(k);
      fan_.inverse_run[i] = i == 0 ? 0 : 1 / (k * run_(k));
    }
  }

  /// Measures how far the model is off at the tile's corners and the middles of its sides.
  void measure() {
    const double rounding_m = kRoundingM + map_.seam_m();
    fan_.slack_fixed = is_exact() ? 0 : rounding_m / lane_m_ + 2e-7;
    double rate = 0, run_share = 0;
    for (const double x : {-1.0, 0.0, 1.0}) {
      for (const double y : {-1.0, 0.0, 1.0}) {
        const double p = x * (tile_.lanes - 1) / 2.0, q = y * (tile_.lines - 1) / 2.0;
        const PlanRay ray(map_, earth_, lane_ + p, line_ + q, azimuth_);
        const double reach_lines = reach(ray);
        for (const double part : {0.1, 0.45, 0.8, 1.0}) {
          const double k = std::max(1.0, reach_lines * part);
          const auto found = ratio(ray, k);
          if (!found) continue;
          const double off = std::abs(found->place - place_(k) - fan_.turn.at(p, q)) * k;
          rate = std::max(rate, (off - fan_.slack_fixed) / k);
          const double run_off = std::abs(found->run_m / (run_(k) * fan_.stretch.at(p, q)) - 1);
          run_share = std::max(run_share, run_off - rounding_m / (k * line_run_m_));
        }
      }
    }
    if (!is_exact())
      fan_.slack_rate = 2 * rate + 1e-9 + kSteepestLean * tilt_ * line_run_m_ / lane_m_;
    // |s| share <= (1 + s^2) share / 2; a lean moves what is seen to and fro as well.
    fan_.tangent_error = run_share + rounding_m / line_run_m_ / 2 + tilt_ + 3e-7;
  }

  /// tan(elevation) as level + s rise + s^2 bend, at a place of the map and a height over it.
  struct Elevation {
    double level, rise, bend;
  };
  Elevation elevation(double lane, double line, double height_m) const {
    const PlanRay ray(map_, earth_, lane, line, azimuth_);
    Position eye = ray.from;
    eye.z_m += height_m;
    const EyeBearings bearings(eye, earth_);
    constexpr double kRunM = 1000;
    const auto tangent = [&](double s) {
      return std::tan(bearings.apparent_pitch_rad(
          {eye.x_m + kRunM * ray.x, eye.y_m + kRunM * ray.y, eye.z_m + kRunM * s}));
    };
    const double down = tangent(-1), flat = tangent(0), up = tangent(1);
    return {flat, (up - down) / 2, (up + down) / 2 - flat};
  }

  void fit_elevation() {
    fan_.rise.middle = 1;
    if (!earth_) return;
    constexpr double kLowM = 0, kHighM = 3000;
    const double half_lanes = (tile_.lanes - 1) / 2.0, half_lines = (tile_.lines - 1) / 2.0;
    const Elevation low = elevation(lane_, line_, kLowM), high = elevation(lane_, line_, kHighM);
    fan_.level_z = (high.level - low.level) / (kHighM - kLowM);
    fan_.rise_z = (high.rise - low.rise) / (kHighM - kLowM);
    fan_.bend = low.bend;
    // As functions of z, not of the height over a surface that bends away.
    fan_.middle_z_m = map_.at(lane_, line_).z_m;
    fan_.level.middle = low.level;
    fan_.rise.middle = low.rise;
    const auto flat_z = [&](const Elevation& e, double lane, double line) {
      const double z = map_.at(lane, line).z_m - fan_.middle_z_m;
      return Elevation{e.level - z * fan_.level_z, e.rise - z * fan_.rise_z, e.bend};
    };
    const auto side = [&](double lanes_off, double lines_off, double& level, double& rise) {
      const double off = lanes_off + lines_off;
      if (off <= 0) return;
      const double l0 = lane_ - lanes_off, m0 = line_ - lines_off;
      const double l1 = lane_ + lanes_off, m1 = line_ + lines_off;
      const Elevation before = flat_z(elevation(l0, m0, kLowM), l0, m0);
      const Elevation after = flat_z(elevation(l1, m1, kLowM), l1, m1);
      level = (after.level - before.level) / (2 * off);
      rise = (after.rise - before.rise) / (2 * off);
    };
    side(half_lanes, 0, fan_.level.per_lane, fan_.rise.per_lane);
    side(0, half_lines, fan_.level.per_line, fan_.rise.per_line);
    double error = 0;
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        const double p = x * half_lanes, q = y * half_lines;
        for (const double h : {-500.0, 9000.0}) {
          const Elevation e = elevation(lane_ + p, line_ + q, h);
          const double z = map_.at(lane_ + p, line_ + q).z_m + h - fan_.middle_z_m;
          error = std::max({error, std::abs(fan_.level.at(p, q) + z * fan_.level_z - e.level),
                            std::abs(fan_.rise.at(p, q) + z * fan_.rise_z - e.rise),
                            std::abs(fan_.bend - e.bend)});
        }
      }
    }
    // Each of the three at most: |1|, |s| and s^2 are within 1.5 (1 + s^2) together.
    fan_.tangent_error += 2 * 1.5 * error;
  }

  const std::optional<EarthFrame>& earth_;
  const double tilt_;
  const PlanMap map_;
  const MarchTile& tile_;
  const AzimuthAt& azimuth_;
  const double lane_, line_;
  const PlanRay middle_;
  double along_ = 0, lane_m_ = 1, line_run_m_ = 1;
  double swerve_ = 0;       ///< lanes a line by which the course may change on the way
  Polynomial place_, run_;  // over k, each per line crossed
  RayFan fan_;
};

}  // namespace

Course course_of(const GroundGrid& grid, const std::optional<EarthFrame>& earth, March march,
                 double lane, double line, const AzimuthAt& azimuth) {
  const PlanMap map(grid, march);
  const auto course = PlanRay(map, earth, lane, line, azimuth).course(map);
  return {course[0] / std::abs(course[1]), course[1] < 0 ? -1 : 1};
}

double runs_along(const GroundGrid& grid, const std::optional<EarthFrame>& earth, March march,
                  const MarchTile& tile, const AzimuthAt& azimuth) {
  return std::abs(course_of(grid, earth, march, tile.first_lane + (tile.lanes - 1) / 2.0,
                            tile.first_line + (tile.lines - 1) / 2.0, azimuth)
                      .lanes_per_line);
}

double greatest_tilt(const GroundGrid& grid) {
  double most = 0;
  if (const auto* blocks = std::get_if<BlockPlacement>(&grid.placement()))
    for (const BlockPlacement::Block& block : blocks->blocks)
      most = std::max(
          most, std::hypot(block[BlockPlacement::kTiltX][0], block[BlockPlacement::kTiltY][0]));
  // The constants are those of the blocks' middles.
  constexpr double kBeyondMiddle = 1.1;
  return most * kBeyondMiddle;
}

RayFan ray_fan(const GroundGrid& grid, const std::optional<EarthFrame>& earth, double tilt,
               March march, const MarchTile& tile, const AzimuthAt& azimuth) {
  return FanMaker(grid, earth, tilt, march, tile, azimuth).make();
}

}  // namespace scarp
