#include "core/occlusion/certified/hiding_bounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/ridges.h"
#include "core/horizon/certified/wall.h"
#include "core/occlusion/certified/group_edges.h"
#include "core/occlusion/certified/piece_targets.h"
#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Rays of one direction through a group are sorted by where they pass its centre, in lanes.
constexpr std::int32_t kLanes = 128;

/// Directions that are worked on at once; their ridges are in memory together.
constexpr std::int32_t kFansAtOnce = 4;

/// Relative allowance for the rounding of a slope in float: about ten operations of 2^-24 each.
constexpr float kSlopeRounding = 0x1p-19F;

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr float kEverything = std::numeric_limits<float>::infinity();

using RingRow = std::array<float, kRings>;

/// An edge is halved this often at most.
constexpr std::size_t kMostHalvings = 6;

/// Bounds are not worked on to lower others by less than this slope: they do so as they are.
constexpr float kSlopeTolerance = 0.0003F;

/// Ridges that are tried before a place goes without a wall.
constexpr int kMostTries = 8;

/// Rings in units of a group's radius: the same for every group.
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
      near_inverse[k] = static_cast<float>(1 / near * (1 + 0x1p-23));
      far_inverse[k] = static_cast<float>(1 / far * (1 - 0x1p-23));
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

/// Directions of the two borders of a sector, widened by kCellOverlap.
struct SectorBorders {
  float low_x, low_y, high_x, high_y;
};

/// A plane as cells see it, in units of the group's radius: the slope from the centre, at the
/// group's height, to where the plane is over a camera.
struct CellPlane {
  RingRow along;  // the least of any ray of the beam
  RingRow rise;   // of the plane at the centre, by the distance: least in each ring
  float x, y;     // gradient
  float slope_error;

  float least_in(const SectorBorders& borders) const {
    return std::min(x * borders.low_x + y * borders.low_y,
                    x * borders.high_x + y * borders.high_y) -
           slope_error;
  }
};

/// The cells of one sector that rays over a piece lead to, rings from `begin` to `end`, and the
/// best bound that is known in each.
struct Reached {
  std::int32_t sector;
  std::size_t begin, end;
  RingRow best;
};

/// Raises bounds of rings from `first` to `end` to the lowest of some planes.
/// @param gradients  of the planes, in the bounds' sector
SCARP_FOR_EACH_TARGET
void raise_bounds(const CellPlane* planes, const float* gradients, std::size_t count,
                  std::size_t first, std::size_t end, float* best) {
  RingRow least;
  for (std::size_t k = first; k < end; ++k) least[k] = kEverything;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = first; k < end; ++k) {
      const float in_cell = planes[i].rise[k] + gradients[i], along = planes[i].along[k];
      const float bound = in_cell < along ? along : in_cell;
      least[k] = bound < least[k] ? bound : least[k];
    }
  for (std::size_t k = first; k < end; ++k) best[k] = best[k] < least[k] ? least[k] : best[k];
}

/// Whether one of some bounds is less than what it is compared with, less a tolerance.
SCARP_FOR_EACH_TARGET
bool is_any_less(const float* bounds, const float* others, float tolerance, std::size_t count) {
  std::int32_t any = 0;
  for (std::size_t k = 0; k < count; ++k) any |= bounds[k] < others[k] - tolerance ? 1 : 0;
  return any != 0;
}

/// The numbers below a count, widely spaced ones first.
std::vector<std::int32_t> scattered_order(std::int32_t count) {
  std::vector<std::int32_t> order;
  const int bits = std::bit_width(static_cast<std::uint32_t>(count));
  for (std::uint32_t i = 0; i < 1U << bits; ++i) {
    std::uint32_t reversed = 0;
    for (int b = 0; b < bits; ++b) reversed |= (i >> b & 1) << (bits - 1 - b);
    if (reversed < static_cast<std::uint32_t>(count))
      order.push_back(static_cast<std::int32_t>(reversed));
  }
  return order;
}

class Bounding {
 public:
  Bounding(const Tin& tin, std::span<const GroupIndex> group_of_triangle, std::uint32_t groups,
           const HidingOptions& options, const std::optional<Scenery>& scenery)
      : tin_(tin),
        options_(options),
        edges_(edges_of_groups(tin, group_of_triangle, groups)),
        ridge_edges_(ridge_edges_of(tin)) {
    draw_circles(groups);
    const Bounds bounds = bounds_of(tin.vertices);
    const double width_m = bounds.high.x_m - bounds.low.x_m;
    const double depth_m = bounds.high.y_m - bounds.low.y_m;
    origin_x_m_ = round_to_lattice(bounds.low.x_m + width_m / 2);
    origin_y_m_ = round_to_lattice(bounds.low.y_m + depth_m / 2);
    const std::size_t own = scenery ? scenery->own_triangles : tin.triangles.size();
    double area_m2 = 0, radius_m = 0;
    for (const auto& [a, b, c] : std::span(tin.triangles).first(own)) {
      const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
      area_m2 += ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
    }
    for (const Circle& circle : bounds_.circle) radius_m += circle.radius_m / groups;
    unit_m_ = std::sqrt(2 * area_m2 / static_cast<double>(own));
    lowest_m_ = scenery ? scenery->lowest_m : bounds.low.z_m;
    // The finer rings where they reach over the whole surface; the same for all tiles of a scene.
    const double reach = std::hypot(width_m, depth_m) / radius_m;
    const bool is_all = own == tin.triangles.size();
    bounds_.layout = {options.sectors, is_all && reach < ring_start({8, 3}, kRings - 1) ? 3 : 2};
    // No sector is as much as a tenth wider than equal ones would be.
    sagitta_ = static_cast<float>(1 - std::cos(1.1 * std::numbers::pi / options.sectors));
    bounds_.slope.assign(
        static_cast<std::size_t>(groups) * static_cast<std::size_t>(options.sectors) * kRings,
        kEverything);
  }

  HidingBounds run(const Progress& progress) {
    const RingTable rings(bounds_.layout, fan_of(options_.fans, 0));
    for (std::int32_t s = 0; s < options_.sectors; ++s) {
      const double low_rad = azimuth_at(bounds_.layout, s) - kCellOverlap;
      const double high_rad = azimuth_at(bounds_.layout, s + 1) + kCellOverlap;
      borders_.push_back(
          {static_cast<float>(std::cos(low_rad)), static_cast<float>(std::sin(low_rad)),
           static_cast<float>(std::cos(high_rad)), static_cast<float>(std::sin(high_rad))});
    }
    std::array<FanView, kFansAtOnce> views;
    std::array<Ridges, kFansAtOnce> ridges;
    std::array<Turns, kFansAtOnce> turns;
    const std::vector<std::int32_t> order = scattered_order(options_.fans);
    for (std::int32_t begin = 0; begin < options_.fans; begin += kFansAtOnce) {
      const auto count = static_cast<std::size_t>(std::min(kFansAtOnce, options_.fans - begin));
      parallel_for(count, [&](std::size_t i) {
        view_along(fan_of(options_.fans, order[static_cast<std::size_t>(begin) + i]), tin_,
                   origin_x_m_, origin_y_m_, views[i]);
        turns[i] = turns_of(views[i].fan, rings);
        ridges[i].cross(ridge_edges_, views[i], options_.width * unit_m_, looked_from(views[i]));
      });
      parallel_for(bounds_.circle.size(), [&](std::size_t group) {
        for (std::size_t i = 0; i < count; ++i)
          look_along(views[i], ridges[i], rings, turns[i], static_cast<GroupIndex>(group));
      });
      if (progress) progress(static_cast<double>(begin + kFansAtOnce) / options_.fans);
    }
    return std::move(bounds_);
  }

 private:
  void draw_circles(std::uint32_t groups) {
    for (GroupIndex g = 0; g < groups; ++g) {
      std::vector<Position> corners;
      double top_m = -HUGE_VAL;
      for (const auto& edge : edges_.crests_of(g))
        for (const VertexIndex v : edge) {
          corners.push_back(tin_.vertices[v]);
          top_m = std::max(top_m, tin_.vertices[v].z_m);
        }
      bounds_.height_m.push_back(top_m);
      bounds_.circle.push_back(enclosing_circle(convex_hull(std::move(corners))));
    }
  }

  /// Where the groups are, in the frame of a fan.
  RidgeRange looked_from(const FanView& view) const {
    RidgeRange range{HUGE_VAL, HUGE_VAL, -HUGE_VAL};
    for (const Circle& circle : bounds_.circle) {
      const FanPlace centre =
          place_in(view.fan, circle.x_m - origin_x_m_, circle.y_m - origin_y_m_, 0);
      const double reach_m = circle.radius_m * (1 + 0x1p-20) + 16 * view.error_m;
      range.low_u_m = std::min(range.low_u_m, centre.u_m - reach_m);
      range.low_v_m = std::min(range.low_v_m, centre.v_m - reach_m);
      range.high_v_m = std::max(range.high_v_m, centre.v_m + reach_m);
    }
    return range;
  }

  /// Sectors that cameras in a lane and ring of a fan can be in, from that of the fan's middle.
  struct Turns {
    std::int32_t middle;
    std::array<std::array<std::int32_t, kRings>, kLanes> first, last;
  };

  Turns turns_of(const Fan& fan, const RingTable& rings) const {
    const std::int32_t sectors = options_.sectors;
    const auto sector_at = [&](double azimuth_rad) {
      return sector_of(bounds_.layout, std::cos(azimuth_rad), std::sin(azimuth_rad));
    };
    Turns turns{};
    turns.middle = sector_at(fan.middle_rad);
    const auto from_middle = [&](std::int32_t sector) {
      return (sector - turns.middle + sectors + sectors / 2) % sectors - sectors / 2;
    };
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t k = 0; k < kRings; ++k) {
        turns.first[lane][k] = from_middle(sector_at(fan.middle_rad + rings.turn_low[lane][k]));
        turns.last[lane][k] = from_middle(sector_at(fan.middle_rad + rings.turn_high[lane][k]));
      }
    return turns;
  }

  /// A ridge that rises above all before it, and the slope of the sight lines that touch it.
  struct Sighted {
    std::uint32_t edge;
    double slope;
  };

  /// Works out one group for the rays of one fan.
  struct Look {
    const FanView& view;
    const Ridges& ridges;
    const RingTable& rings;
    const Turns& turns;
    FanPlace centre;
    double radius_m, height_m;
    float* cells;   // of the group: [sectors * kRings]
    RingRow floor;  // no camera over the data is lower
    std::vector<FanEdge> crests{};
    std::vector<FanEdge> exits{};  // all that rays can leave over
    std::array<PieceTargets, kMostHalvings + 1> targets{};
    std::vector<FanPlace> hull{};
    std::array<std::vector<Reached>, kMostHalvings + 1> reached_by_depth{};
    std::size_t depth = 0;  // of halving
    std::vector<Sighted> sighted{};
    std::vector<CellPlane> planes{};
    std::vector<float> gradients{};
    Wall wall{};

    std::vector<Reached>& reached() { return reached_by_depth[depth]; }
    const std::vector<Reached>& reached() const { return reached_by_depth[depth]; }
  };

  FanEdge in_fan(const FanView& view, const GroupEdges::Edge& edge) const {
    return {view.vertices[edge[0]], view.vertices[edge[1]], edge[0], edge[1]};
  }

  void look_along(const FanView& view, const Ridges& ridges, const RingTable& rings,
                  const Turns& turns, GroupIndex group) {
    const Circle& circle = bounds_.circle[group];
    float* cells = bounds_.slope.data() + static_cast<std::size_t>(group) *
                                              static_cast<std::size_t>(options_.sectors) * kRings;
    Look look{view, ridges, rings, turns, {}, circle.radius_m, bounds_.height_m[group], cells, {}};
    look.centre =
        place_in(view.fan, circle.x_m - origin_x_m_, circle.y_m - origin_y_m_, look.height_m);
    for (std::size_t k = 0; k < kRings; ++k)
      look.floor[k] =
          static_cast<float>((lowest_m_ - look.height_m) / look.radius_m) * rings.near_inverse[k];
    for (const auto& edge : edges_.crests_of(group)) look.crests.push_back(in_fan(view, edge));
    for (const auto& edge : edges_.borders_of(group)) {
      const FanEdge exit = in_fan(view, edge);
      if (!is_entry(view, exit)) look.exits.push_back(exit);
    }
    // What is high is seen first: it lowers bounds, and the rest needs no close look.
    std::sort(look.exits.begin(), look.exits.end(), [](const FanEdge& p, const FanEdge& q) {
      return p.a.z_m + p.b.z_m > q.a.z_m + q.b.z_m;
    });
    std::vector<std::uint32_t> all(look.crests.size());
    std::iota(all.begin(), all.end(), 0U);
    for (const FanEdge& edge : look.exits) look_from_piece(look, {edge.a, edge.b, &edge}, all);
  }

  /// Whether every ray over the piece leaves the group once more, over one edge: then it has been
  /// looked at from there.
  static bool is_passed(const Look& look, const ExitPiece& piece) {
    const FanView& view = look.view;
    const double drift_m = 2 * look.radius_m * view.fan.tan_half + 16 * view.error_m;
    const double low_v_m = std::min(piece.a.v_m, piece.b.v_m) - drift_m;
    const double high_v_m = std::max(piece.a.v_m, piece.b.v_m) + drift_m;
    for (const FanEdge& edge : look.exits) {
      if (&edge == piece.edge || !(edge.a.v_m < low_v_m && edge.b.v_m > high_v_m) ||
          !is_exit(view, edge))
        continue;
      const double du_m = edge.b.u_m - edge.a.u_m, dv_m = edge.b.v_m - edge.a.v_m;
      const auto behind = [&](const FanPlace& p) {
        return du_m * (p.v_m - edge.a.v_m) - dv_m * (p.u_m - edge.a.u_m) >
               16 * view.error_m * (std::abs(du_m) + std::abs(dv_m));
      };
      if (behind(piece.a) && behind(piece.b)) return true;
    }
    return false;
  }

  /// The cells that rays over a piece lead to, with what is known of the piece that it is half of.
  /// @return the lane whose reach holds for all these rays
  std::size_t reach_from(Look& look, const ExitPiece& piece) const {
    const FanView& view = look.view;
    const double ua = piece.a.u_m - look.centre.u_m, ub = piece.b.u_m - look.centre.u_m;
    const double va = piece.a.v_m - look.centre.v_m, vb = piece.b.v_m - look.centre.v_m;
    // Lanes: where rays of the fan over the piece pass the centre.
    const double slack_m = std::max(std::abs(ua), std::abs(ub)) * view.fan.sin_half +
                           std::max(std::abs(va), std::abs(vb)) * (1 - view.fan.cos_half) +
                           8 * view.error_m;
    const auto lane_of = [&](double offset_m) {
      const double lane = (offset_m / look.radius_m + 1) * (kLanes / 2);
      return static_cast<std::size_t>(std::clamp(std::floor(lane), 0.0, kLanes - 1.0));
    };
    const std::size_t low = lane_of(std::min(va, vb) - slack_m);
    const std::size_t high = lane_of(std::max(va, vb) + slack_m);
    const auto& first = look.turns.first[low];
    const auto& last = look.turns.last[high];
    const std::int32_t from = *std::min_element(first.begin(), first.end());
    const std::int32_t to = *std::max_element(last.begin(), last.end());
    look.reached().resize(static_cast<std::size_t>(to - from + 1));
    for (std::int32_t turn = from; turn <= to; ++turn) {
      Reached& reached = look.reached()[static_cast<std::size_t>(turn - from)];
      const std::int32_t sectors = options_.sectors;
      reached.sector = ((look.turns.middle + turn) % sectors + sectors) % sectors;
      reached.begin = kRings, reached.end = 0;
      reached.best.fill(kNothing);
      if (look.depth == 0) continue;
      for (const Reached& whole : look.reached_by_depth[look.depth - 1])
        if (whole.sector == reached.sector) reached.best = whole.best;
    }
    for (std::size_t k = 0; k < kRings; ++k)
      for (std::int32_t turn = first[k]; turn <= last[k]; ++turn) {
        Reached& reached = look.reached()[static_cast<std::size_t>(turn - from)];
        reached.begin = std::min(reached.begin, k);
        reached.end = k + 1;
      }
    // The outer of the lanes has the least reach.
    return high + low >= kLanes ? high : low;
  }

  CellPlane in_cells(const Look& look, const SkyPlane& plane, std::size_t lane) const {
    const Fan& fan = look.view.fan;
    CellPlane cell;
    cell.x = static_cast<float>(plane.ahead * fan.axis_x - plane.left * fan.axis_y);
    cell.y = static_cast<float>(plane.ahead * fan.axis_y + plane.left * fan.axis_x);
    const float steepness = std::abs(cell.x) + std::abs(cell.y);
    // Between its borders the least over a sector can be less by its sagitta.
    cell.slope_error =
        steepness * (sagitta_ + kSlopeRounding) + static_cast<float>(plane.slope_error * 2);
    const double du_m = look.centre.u_m - plane.u_m, dv_m = look.centre.v_m - plane.v_m;
    const double rise_m = plane.height_m - look.height_m + plane.ahead * du_m + plane.left * dv_m -
                          plane.error_m - (std::abs(du_m) + std::abs(dv_m)) * plane.slope_error -
                          4 * look.view.height_error_m;
    const auto rise = static_cast<float>(rise_m / look.radius_m);
    const float sure = rise - std::abs(rise) * kSlopeRounding;
    const RingRow& inverse = sure < 0 ? look.rings.near_inverse : look.rings.far_inverse;
    // A camera's u is at least `forward` of its distance, which counts where the line rises, and
    // at most the distance, which counts where it falls.
    const double line_rise_m = plane.line_m + plane.line_slope * look.centre.u_m - look.height_m -
                               4 * look.view.height_error_m -
                               4 * std::abs(plane.line_slope) * look.view.error_m;
    const auto line_rise = static_cast<float>(line_rise_m / look.radius_m);
    const float sure_line = line_rise - std::abs(line_rise) * kSlopeRounding;
    const RingRow& line_inverse = sure_line < 0 ? look.rings.near_inverse : look.rings.far_inverse;
    const RingRow& forward = look.rings.forward[lane];
    const auto line_slope = static_cast<float>(plane.line_slope);
    const float rising = std::max(line_slope, 0.0F);
    const float falling = std::min(line_slope, 0.0F) - std::abs(line_slope) * kSlopeRounding;
    for (std::size_t k = 0; k < kRings; ++k) {
      const float slope = sure * inverse[k];
      cell.rise[k] = slope - std::abs(slope) * kSlopeRounding;
      cell.along[k] = sure_line * line_inverse[k] + (rising * forward[k] + falling);
    }
    return cell;
  }

  /// Raises what is known of rings from `first` on to the lowest of look.planes.
  void raise_reached(Look& look, std::size_t first) const {
    look.gradients.resize(look.planes.size());
    for (Reached& reached : look.reached()) {
      const std::size_t begin = std::max(first, reached.begin);
      if (begin >= reached.end) continue;
      const SectorBorders& borders = borders_[static_cast<std::size_t>(reached.sector)];
      for (std::size_t i = 0; i < look.planes.size(); ++i)
        look.gradients[i] = look.planes[i].least_in(borders);
      raise_bounds(look.planes.data(), look.gradients.data(), look.planes.size(), begin,
                   reached.end, reached.best.data());
    }
  }

  /// Whether the piece would lower a bound in rings from `from` to `to` by more than a tolerance.
  static bool is_open(const Look& look, std::size_t from, std::size_t to) {
    for (const Reached& reached : look.reached()) {
      const float* cells = look.cells + static_cast<std::size_t>(reached.sector) * kRings;
      const std::size_t begin = std::max(from, reached.begin), end = std::min(to, reached.end);
      if (begin < end &&
          is_any_less(reached.best.data() + begin, cells + begin, kSlopeTolerance, end - begin))
        return true;
    }
    return false;
  }

  /// Raises walls for the rays over a piece on the ridges that its middle ray sees.
  void raise_walls(Look& look, const ExitPiece& piece, const PieceTargets& targets,
                   std::size_t lane) {
    const FanView& view = look.view;
    const auto& reach = look.rings.reach[lane];
    /// From which ring on cameras are beyond a place.
    const auto ring_beyond = [&](double u_m) {
      const double least = (u_m - look.centre.u_m + 4 * view.error_m) / look.radius_m;
      return static_cast<std::size_t>(std::upper_bound(reach.begin(), reach.end(), least) -
                                      reach.begin());
    };
    const auto raise = [&](const Sighted& sighted) {
      Wall& wall = look.wall;
      if (!raise_wall(ridge_edges_, view, targets.beam, targets.places, sighted.edge, sighted.slope,
                      wall))
        return false;
      look.planes.clear();
      for (const SkyPlane& plane : wall.planes) look.planes.push_back(in_cells(look, plane, lane));
      raise_reached(look, ring_beyond(wall.u_m));
      return true;
    };
    look.hull = targets.places;
    leave_upper_hull(look.hull);
    const auto tangent_m = [&](double slope) {
      double base_m = -HUGE_VAL;
      for (const FanPlace& p : look.hull) base_m = std::max(base_m, p.z_m - slope * p.u_m);
      return base_m;
    };
    // A wall is raised on the last ridge before a ring that rises above all before it, if there
    // are rings for which it counts.
    look.sighted.clear();
    double slope = targets.plane ? targets.plane->ahead : -HUGE_VAL;
    double base_m = slope > -HUGE_VAL ? tangent_m(slope) : -HUGE_VAL;
    std::size_t ring = 0;  // all before have what they can get
    const auto raise_before = [&](std::size_t end) {
      if (end > ring && is_open(look, ring, end)) {
        int raised = 0;
        const std::size_t tries = std::min<std::size_t>(kMostTries, look.sighted.size());
        for (std::size_t i = 1; i <= tries; ++i)
          if (raise(look.sighted[look.sighted.size() - i]) && ++raised == 2) break;
      }
      ring = std::max(ring, end);
    };
    const double near_u_m = std::max(piece.a.u_m, piece.b.u_m);
    const auto crossings = look.ridges.along((piece.a.v_m + piece.b.v_m) / 2);
    auto next = std::upper_bound(
        crossings.begin(), crossings.end(), near_u_m,
        [](double u_m, const RidgeCrossing& c) { return u_m < static_cast<double>(c.u_m); });
    for (; next != crossings.end() && ring < kRings; ++next) {
      const auto u_m = static_cast<double>(next->u_m), z_m = static_cast<double>(next->z_m);
      if (slope > -HUGE_VAL && !(z_m > base_m + slope * u_m)) continue;
      const std::size_t beyond = ring_beyond(u_m);
      if (beyond > ring) {
        raise_before(beyond);
        if (!is_open(look, ring, kRings)) return;
      }
      slope = HUGE_VAL;
      for (const FanPlace& p : look.hull)
        slope = std::min(slope, (z_m - p.z_m) / std::max(u_m - p.u_m, kLatticeStepM));
      base_m = tangent_m(slope);
      look.sighted.push_back({next->edge, slope});
    }
    raise_before(kRings);
  }

  /// Lowers the bounds of cells by what rays over a piece can see of the group. Looks closer, at
  /// halves, before it lowers any.
  /// @param candidates  crests behind the edge
  void look_from_piece(Look& look, const ExitPiece& piece,
                       std::span<const std::uint32_t> candidates) {
    if (is_passed(look, piece)) return;
    const std::size_t lane = reach_from(look, piece);
    if (!is_open(look, 0, kRings)) return lower_cells(look);
    PieceTargets& targets = look.targets[look.depth];
    find_targets(look.view, piece, look.crests, candidates, targets);
    if (targets.plane) {
      look.planes.assign(1, in_cells(look, *targets.plane, lane));
      raise_reached(look, 0);
      if (!is_open(look, 0, kRings)) return lower_cells(look);
    }
    raise_walls(look, piece, targets, lane);
    if (!is_open(look, 0, kRings)) return lower_cells(look);
    const double du_m = piece.b.u_m - piece.a.u_m, dv_m = piece.b.v_m - piece.a.v_m;
    const double size_m = options_.piece * unit_m_;
    if (look.depth < kMostHalvings && du_m * du_m + dv_m * dv_m > size_m * size_m) {
      const FanPlace middle{piece.a.u_m + du_m / 2, piece.a.v_m + dv_m / 2,
                            piece.a.z_m + (piece.b.z_m - piece.a.z_m) / 2};
      ++look.depth;
      look_from_piece(look, {piece.a, middle, piece.edge}, targets.crests);
      look_from_piece(look, {middle, piece.b, piece.edge}, targets.crests);
      --look.depth;
      return;
    }
    lower_cells(look);
  }

  static void lower_cells(Look& look) {
    for (const Reached& reached : look.reached()) {
      float* cells = look.cells + static_cast<std::size_t>(reached.sector) * kRings;
      for (std::size_t k = reached.begin; k < reached.end; ++k) {
        // Bounds under all ground are not refined, so they must not stay: nothing is hidden there.
        const float bound = reached.best[k] > look.floor[k] ? reached.best[k] : kNothing;
        cells[k] = std::min(cells[k], bound);
      }
    }
  }

  const Tin& tin_;
  const HidingOptions& options_;
  const GroupEdges edges_;
  const RidgeEdges ridge_edges_;
  std::vector<SectorBorders> borders_;
  float sagitta_ = 0;
  HidingBounds bounds_;
  double origin_x_m_ = 0, origin_y_m_ = 0;
  double unit_m_ = 0, lowest_m_ = 0;
};

}  // namespace

HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress, const std::optional<Scenery>& scenery) {
  assert(group_of_triangle.size() == tin.triangles.size());
  if (groups == 0) return {};
  return Bounding(tin, group_of_triangle, groups, options, scenery).run(progress);
}

}  // namespace scarp
