#include "core/occlusion/certified/hiding_bounds.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/horizon/certified/curtains.h"
#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/skyline.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Rays of one direction through a group are sorted by where they pass its centre, in lanes.
constexpr std::int32_t kLanes = 16;

/// Directions that are worked on at once; their curtains are in memory together.
constexpr std::int32_t kFansAtOnce = 4;

/// Relative allowance for the rounding of a slope in float: about ten operations of 2^-24 each.
constexpr float kSlopeRounding = 0x1p-19F;

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr float kEverything = std::numeric_limits<float>::infinity();

using RingRow = std::array<float, kRings>;
const RingRow kNothingYet = [] {
  RingRow row;
  row.fill(kNothing);
  return row;
}();

/// An edge is halved this often at most.
constexpr int kMostHalvings = 6;

/// Rings and lanes in units of a group's radius: the same for every group.
struct RingTable {
  RingRow near_inverse{}, far_inverse{};                   // of distances
  std::array<RingRow, kLanes> forward{};                   // least u of a camera by its distance
  std::array<std::array<double, kRings>, kLanes> reach{};  // least u of a camera
  std::array<std::array<double, kRings>, kLanes> turn_low{}, turn_high{};  // camera azimuth - ray's

  RingTable(const PolarLayout& layout, const Fan& fan) {
    for (std::size_t k = 0; k < kRings; ++k) {
      const auto ring = static_cast<std::int32_t>(k);
      const double near = ring_start(layout, ring) * kFirstRing * (1 - kCellOverlap);
      const double far = ring + 1 == kRings
                             ? HUGE_VAL
                             : ring_start(layout, ring + 1) * kFirstRing * (1 + kCellOverlap);
      near_inverse[k] = static_cast<float>(1 / near);
      far_inverse[k] = static_cast<float>(1 / far);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const double low = -1 + 2.0 * static_cast<double>(lane) / kLanes;
        const double high = low + 2.0 / kLanes;
        const double offset = std::max(std::abs(low), std::abs(high));
        const double least =
            std::sqrt(near * near - offset * offset) * fan.cos_half - offset * fan.sin_half;
        reach[lane][k] = least * (1 - 0x1p-40);
        forward[lane][k] = static_cast<float>(least / near);
        turn_low[lane][k] = std::asin(low / (low < 0 ? near : far)) - fan.half_rad - kCellOverlap;
        turn_high[lane][k] =
            std::asin(high / (high > 0 ? near : far)) + fan.half_rad + kCellOverlap;
      }
    }
  }
};

/// A line that hides what is beyond it, by the camera's u from the group's centre.
struct Line {
  double at_centre_m;  // above the group's height
  double slope;
};

/// The same in units of the group's radius.
struct RingLine {
  float near_rise = 0, far_rise = 0;  // the rise, rounded down, where it is below and above zero
  float ahead_weight = 0, slope_rest = kNothing;

  /// Least of (height - the group's height) / distance, over the distances of a ring.
  float least_slope(const RingTable& rings, const RingRow& forward, std::size_t ring) const {
    return near_rise * rings.near_inverse[ring] + far_rise * rings.far_inverse[ring] +
           (ahead_weight * forward[ring] + slope_rest);
  }
};

/// A camera's u is at least `forward` of its distance, which counts where the line rises, and at
/// most the distance, which counts where it falls.
RingLine ring_line(double rise, double slope) {
  const auto r = static_cast<float>(rise);
  const auto s = static_cast<float>(slope);
  RingLine line;
  const float sure = r - std::abs(r) * kSlopeRounding;
  line.near_rise = std::min(sure, 0.0F);
  line.far_rise = std::max(sure, 0.0F);
  line.ahead_weight = std::max(s, 0.0F);
  line.slope_rest = std::min(s, 0.0F) - std::abs(s) * kSlopeRounding;
  return line;
}

struct GroupParts {
  std::vector<std::size_t> first;        // [groups + 1]
  std::vector<TriangleIndex> triangles;  // by group; the order within one changes
};

class Bounding {
 public:
  Bounding(const Tin& tin, std::span<const GroupIndex> group_of_triangle, std::uint32_t groups,
           const HidingOptions& options)
      : tin_(tin), options_(options) {
    sort_by_group(group_of_triangle, groups);
    draw_circles(groups);
    const Bounds bounds = bounds_of(tin.vertices);
    const double width_m = bounds.high.x_m - bounds.low.x_m;
    const double depth_m = bounds.high.y_m - bounds.low.y_m;
    origin_x_m_ = round_to_lattice(bounds.low.x_m + width_m / 2);
    origin_y_m_ = round_to_lattice(bounds.low.y_m + depth_m / 2);
    double area_m2 = 0, radius_m = 0;
    for (const auto& [a, b, c] : tin.triangles) {
      const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
      area_m2 += ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
    }
    for (const Circle& circle : bounds_.circle) radius_m += circle.radius_m / groups;
    unit_m_ = std::sqrt(2 * area_m2 / static_cast<double>(tin.triangles.size()));
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i)
        if (tin.neighbours[t][i] == kNone)
          borders_.emplace_back(tin.triangles[t][(i + 1) % 3], tin.triangles[t][(i + 2) % 3]);
    bounds_.lowest_m = bounds.low.z_m;
    bounds_.highest_m = bounds.high.z_m;
    // The finer rings where they reach over the whole surface.
    const double reach = std::hypot(width_m, depth_m) / radius_m;
    bounds_.layout = {options.sectors, reach < ring_start({8, 3}, kRings - 1) ? 3 : 2};
    bounds_.slope.assign(
        static_cast<std::size_t>(groups) * static_cast<std::size_t>(options.sectors) * kRings,
        kEverything);
  }

  HidingBounds run(const Progress& progress) {
    const RingTable rings(bounds_.layout, fan_of(options_.fans, 0));
    std::array<FanView, kFansAtOnce> views;
    std::array<Curtains, kFansAtOnce> curtains;
    std::array<Turns, kFansAtOnce> turns;
    for (std::int32_t begin = 0; begin < options_.fans; begin += kFansAtOnce) {
      const auto count = static_cast<std::size_t>(std::min(kFansAtOnce, options_.fans - begin));
      parallel_for(count, [&](std::size_t i) {
        view_along(fan_of(options_.fans, begin + static_cast<std::int32_t>(i)), tin_, origin_x_m_,
                   origin_y_m_, views[i]);
        turns[i] = turns_of(views[i].fan, rings);
        curtains[i].raise(tin_, borders_, views[i], options_.spacing * unit_m_,
                          options_.width * unit_m_);
      });
      parallel_for(bounds_.circle.size(), [&](std::size_t group) {
        for (std::size_t i = 0; i < count; ++i)
          look_along(views[i], curtains[i], rings, turns[i], static_cast<GroupIndex>(group));
      });
      if (progress) progress(static_cast<double>(begin + kFansAtOnce) / options_.fans);
    }
    return std::move(bounds_);
  }

 private:
  void sort_by_group(std::span<const GroupIndex> group_of_triangle, std::uint32_t groups) {
    parts_.first.assign(groups + 1, 0);
    for (const GroupIndex g : group_of_triangle)
      if (g != kNone) ++parts_.first[g + 1];
    std::partial_sum(parts_.first.begin(), parts_.first.end(), parts_.first.begin());
    parts_.triangles.resize(parts_.first.back());
    std::vector<std::size_t> next = parts_.first;
    for (TriangleIndex t = 0; t < group_of_triangle.size(); ++t)
      if (group_of_triangle[t] != kNone) parts_.triangles[next[group_of_triangle[t]]++] = t;
  }

  void draw_circles(std::uint32_t groups) {
    for (GroupIndex g = 0; g < groups; ++g) {
      std::vector<Position> corners;
      double top_m = -HUGE_VAL;
      for (std::size_t i = parts_.first[g]; i < parts_.first[g + 1]; ++i)
        for (const VertexIndex v : tin_.triangles[parts_.triangles[i]]) {
          corners.push_back(tin_.vertices[v]);
          top_m = std::max(top_m, tin_.vertices[v].z_m);
        }
      bounds_.height_m.push_back(top_m);
      bounds_.circle.push_back(enclosing_circle(convex_hull(std::move(corners))));
    }
  }

  /// Sectors that cameras in a lane and ring of a fan can be in, modulo their number.
  struct Turns {
    std::array<std::array<std::int32_t, kRings>, kLanes> first, count;
  };

  Turns turns_of(const Fan& fan, const RingTable& rings) const {
    const std::int32_t sectors = options_.sectors;
    const auto sector_at = [&](double azimuth_rad) {
      return sector_of(bounds_.layout, std::cos(azimuth_rad), std::sin(azimuth_rad));
    };
    Turns turns{};
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t k = 0; k < kRings; ++k) {
        const std::int32_t from = sector_at(fan.middle_rad + rings.turn_low[lane][k]);
        const std::int32_t to = sector_at(fan.middle_rad + rings.turn_high[lane][k]);
        turns.first[lane][k] = from;
        turns.count[lane][k] = (to - from + sectors) % sectors + 1;
      }
    return turns;
  }

  /// Works out one group for the rays of one fan.
  struct Look {
    const FanView& view;
    const Curtains& curtains;
    const RingTable& rings;
    const Turns& turns;
    FanPlace centre;
    double radius_m, height_m;
    float* cells;   // of the group: [sectors * kRings]
    RingRow floor;  // no camera over the data is lower: bounds at or under it are given up
  };

  void look_along(const FanView& view, const Curtains& curtains, const RingTable& rings,
                  const Turns& turns, GroupIndex group) {
    const Circle& circle = bounds_.circle[group];
    float* cells = bounds_.slope.data() + static_cast<std::size_t>(group) *
                                              static_cast<std::size_t>(options_.sectors) * kRings;
    Look look{view,  curtains, rings, turns, {}, circle.radius_m, bounds_.height_m[group],
              cells, {}};
    look.centre =
        place_in(view.fan, circle.x_m - origin_x_m_, circle.y_m - origin_y_m_, look.height_m);
    for (std::size_t k = 0; k < kRings; ++k)
      look.floor[k] = static_cast<float>((bounds_.lowest_m - look.height_m) /
                                         (look.radius_m / rings.near_inverse[k]));
    const std::size_t first = parts_.first[group];
    for (std::size_t i = first; i < parts_.first[group + 1]; ++i) {
      const bool lowered = look_from_triangle(look, parts_.triangles[i]);
      // What is seen best along one fan is likely to be along the next: it lowers the bounds
      // first, and others need no second look.
      if (lowered) std::swap(parts_.triangles[i], parts_.triangles[first + (i - first) / 2]);
    }
  }

  /// The bounds that rays of some lanes would have to lower.
  RingRow goal_of(const Look& look, std::size_t from_lane, std::size_t to_lane) const {
    RingRow goal;
    goal.fill(kNothing);
    for (std::size_t lane = from_lane; lane <= to_lane; ++lane)
      for (std::size_t k = 0; k < kRings; ++k) {
        std::int32_t sector = look.turns.first[lane][k];
        for (std::int32_t n = look.turns.count[lane][k]; n > 0; --n) {
          goal[k] = std::max(goal[k], look.cells[static_cast<std::size_t>(sector) * kRings + k]);
          if (++sector == options_.sectors) sector = 0;
        }
      }
    return goal;
  }

  void lower(const Look& look, std::size_t from_lane, std::size_t to_lane, const RingRow& row) {
    for (std::size_t lane = from_lane; lane <= to_lane; ++lane)
      for (std::size_t k = 0; k < kRings; ++k) {
        std::int32_t sector = look.turns.first[lane][k];
        for (std::int32_t n = look.turns.count[lane][k]; n > 0; --n) {
          float& cell = look.cells[static_cast<std::size_t>(sector) * kRings + k];
          // Bounds under all ground are not refined, so they must not stay: nothing is hidden
          // there.
          cell = std::min(cell, row[k] > look.floor[k] ? row[k] : kNothing);
          if (++sector == options_.sectors) sector = 0;
        }
      }
  }

  bool look_from_triangle(Look& look, TriangleIndex triangle) {
    std::array<FanPlace, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
      corners[i] = look.view.vertices[tin_.triangles[triangle][i]];
    const double plane_slope = least_slope_of_plane(look.view, tin_.triangles[triangle]);
    bool lowered = false;
    for (std::size_t i = 0; i < 3; ++i) {
      const FanPlace &a = corners[i], &b = corners[(i + 1) % 3];
      const double du_m = b.u_m - a.u_m, dv_m = b.v_m - a.v_m;
      // Rays of the fan leave the triangle's inside over the edge's other side: v falls along it.
      if (-dv_m + std::abs(du_m) * look.view.fan.tan_half < -4 * look.view.error_m) continue;
      lowered |= look_from_piece(look, {a, b}, plane_slope, kNothingYet, 0);
    }
    return lowered;
  }

  /// Least rise of a triangle's plane for each metre of u along any ray of the fan.
  double least_slope_of_plane(const FanView& view, const std::array<VertexIndex, 3>& t) const {
    const Position &p = tin_.vertices[t[0]], &q = tin_.vertices[t[1]], &r = tin_.vertices[t[2]];
    const double ax = q.x_m - p.x_m, ay = q.y_m - p.y_m, az = q.z_m - p.z_m;
    const double bx = r.x_m - p.x_m, by = r.y_m - p.y_m, bz = r.z_m - p.z_m;
    const double area = ax * by - ay * bx;
    const double rise_x = az * by - ay * bz, rise_y = ax * bz - az * bx;
    // Differences are exact; each product and difference rounds once, the rotation and division
    // once or twice more: 2^-49 of the absolute products is more than all of it.
    const double size = std::abs(ax * by) + std::abs(ay * bx);
    if (!(area > 0x1p-30 * size)) return -HUGE_VAL;  // a sliver's plane is left unused
    const double along = rise_x * view.fan.axis_x + rise_y * view.fan.axis_y;
    const double across = rise_y * view.fan.axis_x - rise_x * view.fan.axis_y;
    const double sizes =
        std::abs(az * by) + std::abs(ay * bz) + std::abs(ax * bz) + std::abs(az * bx);
    const double slope = (along - std::abs(across) * view.fan.tan_half) / area;
    return slope - (0x1p-48 * sizes + std::abs(slope) * 0x1p-48 * size) / area * 2;
  }

  /// Lowers the bounds of the rays by what can be seen of a piece, if it does not hide at least as
  /// well as what lowered them before; looks closer, at halves, before it does so.
  /// @param known   what is known of rays from the piece already
  bool look_from_piece(Look& look, const Piece& piece, double plane_slope, const RingRow& known,
                       int depth) {
    // Lanes: where rays of the fan from the piece pass the centre.
    const FanView& view = look.view;
    const double ua = piece.a.u_m - look.centre.u_m, ub = piece.b.u_m - look.centre.u_m;
    const double va = piece.a.v_m - look.centre.v_m, vb = piece.b.v_m - look.centre.v_m;
    const double slack_m = std::max(std::abs(ua), std::abs(ub)) * view.fan.sin_half +
                           std::max(std::abs(va), std::abs(vb)) * (1 - view.fan.cos_half) +
                           8 * view.error_m;
    const auto lane_of = [&](double offset_m) {
      const double lane = (offset_m / look.radius_m + 1) * (kLanes / 2);
      return std::clamp(static_cast<std::int32_t>(std::floor(lane)), 0, kLanes - 1);
    };
    const auto from_lane = static_cast<std::size_t>(lane_of(std::min(va, vb) - slack_m));
    const auto to_lane = static_cast<std::size_t>(lane_of(std::max(va, vb) + slack_m));
    // The outer of the lanes has the least reach.
    const std::size_t outer =
        2 * std::max(from_lane, to_lane) >= kLanes && kLanes - 1 - to_lane < from_lane ? to_lane
                                                                                       : from_lane;
    const RingRow& forward = look.rings.forward[outer];
    const auto& reach = look.rings.reach[outer];
    const RingRow goal = goal_of(look, from_lane, to_lane);
    RingRow best = known;
    // A line is known until a steeper one comes; rings are filled up to where that one counts.
    RingLine line;
    std::size_t ring = 0;
    const auto fill = [&](std::size_t end) {
      for (; ring < end; ++ring)
        best[ring] = std::max(best[ring], line.least_slope(look.rings, forward, ring));
    };
    const auto aim = [&](const SkyLine& found) {
      const double u_m = found.u_m - look.centre.u_m;
      const double rise_m = found.height_m - found.slope * u_m - look.height_m -
                            4 * view.height_error_m - 4 * std::abs(found.slope) * view.error_m;
      line = ring_line(rise_m / look.radius_m, found.slope);
    };
    /// Whether the line hides as much as is asked for in all rings from `ring` on.
    const auto suffices = [&] {
      const auto is_open = [&](std::size_t k) {
        return std::max(best[k], line.least_slope(look.rings, forward, k)) < goal[k];
      };
      if (ring == kRings || is_open(kRings - 1) || is_open(ring)) return false;
      bool open = false;
      for (std::size_t k = ring; k < kRings; ++k) open |= is_open(k);
      return !open;
    };
    bool done = false;
    if (plane_slope > -HUGE_VAL) {
      const FanPlace& end =
          piece.a.z_m - plane_slope * ua < piece.b.z_m - plane_slope * ub ? piece.a : piece.b;
      aim({end.u_m, end.z_m, plane_slope});
      done = suffices();
    }
    if (!done) {
      const double error_m = 4 * view.error_m;
      const double last_u_m = look.centre.u_m + reach[kRings - 1] * look.radius_m - error_m;
      visit_skyline(look.curtains, view, piece, plane_slope, last_u_m, [&](const SkyLine& found) {
        const double u_m = found.u_m - look.centre.u_m + error_m;
        std::size_t end = ring;
        while (end < kRings && reach[end] * look.radius_m <= u_m) ++end;
        fill(end);
        aim(found);
        return ring == kRings || suffices();
      });
    }
    fill(kRings);
    bool open = false;
    for (std::size_t k = 0; k < kRings; ++k) open |= best[k] < goal[k];
    if (!open) return false;
    const double du_m = piece.b.u_m - piece.a.u_m, dv_m = piece.b.v_m - piece.a.v_m;
    const double size_m = options_.piece * unit_m_;
    if (depth < kMostHalvings && du_m * du_m + dv_m * dv_m > size_m * size_m) {
      const FanPlace middle{piece.a.u_m + du_m / 2, piece.a.v_m + dv_m / 2,
                            piece.a.z_m + (piece.b.z_m - piece.a.z_m) / 2};
      const bool first = look_from_piece(look, {piece.a, middle}, plane_slope, best, depth + 1);
      return look_from_piece(look, {middle, piece.b}, plane_slope, best, depth + 1) || first;
    }
    lower(look, from_lane, to_lane, best);
    return true;
  }

  const Tin& tin_;
  const HidingOptions& options_;
  GroupParts parts_;
  HidingBounds bounds_;
  std::vector<std::pair<VertexIndex, VertexIndex>> borders_;
  double origin_x_m_ = 0, origin_y_m_ = 0;
  double unit_m_ = 0;
};

}  // namespace

HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress) {
  assert(group_of_triangle.size() == tin.triangles.size());
  if (groups == 0) return {};
  return Bounding(tin, group_of_triangle, groups, options).run(progress);
}

}  // namespace scarp
