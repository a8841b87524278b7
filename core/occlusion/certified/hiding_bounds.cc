#include "core/occlusion/certified/hiding_bounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/horizon/certified/fan.h"
#include "core/horizon/certified/ridges.h"
#include "core/horizon/certified/wall.h"
#include "core/occlusion/certified/group_edges.h"
#include "core/occlusion/certified/least_ground.h"
#include "core/occlusion/certified/piece_targets.h"
#include "core/occlusion/certified/reached_cells.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Directions that are worked on at once; their ridges are in memory together.
constexpr std::int32_t kFansAtOnce = 4;

constexpr float kEverything = std::numeric_limits<float>::infinity();

/// Groups that are worked on one after another, in the same memory.
constexpr std::size_t kGroupsAtOnce = 16;

/// An edge is halved this often at most.
constexpr std::size_t kMostHalvings = 6;

/// Cameras outside the data count as far out as this, in radii of the group.
constexpr double kOutsideRadii = 2;

/// As many ridges that carry no wall are taken out of sight, for what is behind them.
constexpr int kMostFailures = 24;

/// Ridges that are tried before a place goes without a wall.
constexpr int kMostTries = 8;

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
           const HidingOptions& options, std::optional<std::size_t> own_triangles)
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
    const std::size_t own = own_triangles.value_or(tin.triangles.size());
    double radius_m = 0;
    measure_groups(group_of_triangle);
    for (const Circle& circle : bounds_.circle) radius_m += circle.radius_m / groups;
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
    borders_ = borders_of(bounds_.layout);
    hint_at_ground();
    std::array<FanView, kFansAtOnce> views;
    std::array<Ridges, kFansAtOnce> ridges;
    std::array<Turns, kFansAtOnce> turns;
    const std::vector<std::int32_t> order = scattered_order(options_.fans);
    for (std::int32_t begin = 0; begin < options_.fans; begin += kFansAtOnce) {
      const auto count = static_cast<std::size_t>(std::min(kFansAtOnce, options_.fans - begin));
      parallel_for(count, [&](std::size_t i) {
        view_along(fan_of(options_.fans, order[static_cast<std::size_t>(begin) + i]), tin_,
                   origin_x_m_, origin_y_m_, views[i]);
        turns[i].turn_to(bounds_.layout, views[i].fan, rings);
        ridges[i].cross(ridge_edges_, views[i], options_.width * mean_unit_m_,
                        looked_from(views[i]));
      });
      parallel_for((groups() + kGroupsAtOnce - 1) / kGroupsAtOnce, [&](std::size_t chunk) {
        Workspace work;
        const std::size_t first = chunk * kGroupsAtOnce;
        const std::size_t end = std::min(groups(), first + kGroupsAtOnce);
        for (std::size_t group = first; group < end; ++group)
          number_corners(static_cast<GroupIndex>(group), work.numbered[group - first]);
        // Neighbours look at the same ridges: a fan is taken for all of them while it is at hand.
        for (std::size_t i = 0; i < count; ++i)
          for (std::size_t group = first; group < end; ++group)
            look_along(views[i], ridges[i], rings, turns[i], static_cast<GroupIndex>(group),
                       work.numbered[group - first], work);
      });
      if (progress) progress(static_cast<double>(begin + kFansAtOnce) / options_.fans);
    }
    turn_to_sectors();
    return std::move(bounds_);
  }

 private:
  std::size_t groups() const { return bounds_.circle.size(); }

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

  /// Distances between vertices: near voids a mesh is far finer than elsewhere.
  void measure_groups(std::span<const GroupIndex> group_of_triangle) {
    std::vector<double> area_m2(bounds_.circle.size(), 0), triangles(bounds_.circle.size(), 0);
    for (TriangleIndex t = 0; t < tin_.triangles.size(); ++t) {
      const GroupIndex group = group_of_triangle[t];
      if (group == kNone) continue;
      const auto& [a, b, c] = tin_.triangles[t];
      const Position &p = tin_.vertices[a], &q = tin_.vertices[b], &r = tin_.vertices[c];
      area_m2[group] += ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
      ++triangles[group];
    }
    for (std::size_t g = 0; g < area_m2.size(); ++g) {
      unit_m_.push_back(std::sqrt(2 * area_m2[g] / triangles[g]));
      mean_unit_m_ += unit_m_[g] / static_cast<double>(area_m2.size());
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

  /// Where cameras can be: about the slope to the ground in each cell, and no slope is enough where
  /// there is none.
  void hint_at_ground() {
    const LeastGround ground(tin_);
    std::vector<std::array<double, 2>> directions;
    for (std::int32_t s = 0; s < options_.sectors; ++s) {
      const double azimuth_rad = azimuth_at(bounds_.layout, s + 0.5);
      directions.push_back({std::cos(azimuth_rad), std::sin(azimuth_rad)});
    }
    least_.resize(bounds_.slope.size() + kHintsBeyond);
    parallel_for(bounds_.circle.size(), [&](std::size_t group) {
      const Circle& circle = bounds_.circle[group];
      std::uint16_t* hint = least_.data() + group * directions.size() * kRings;
      for (std::int32_t k = 0; k < kRings; ++k) {
        const double near_m = ring_start(bounds_.layout, k) * circle.radius_m;
        const double far_m = ring_start(bounds_.layout, k + 1) * circle.radius_m;
        const double middle_m = (near_m + far_m) / 2;
        for (const auto& [x, y] : directions) {
          const double x_m = circle.x_m + x * middle_m, y_m = circle.y_m + y * middle_m;
          *hint++ = slope_hint(kEverything);
          const double beyond_m = kOutsideRadii * circle.radius_m;
          if (!ground.is_inside(x_m - x * beyond_m, y_m - y * beyond_m)) continue;
          const double rise_m = ground.around(x_m, y_m, far_m - near_m) - bounds_.height_m[group];
          hint[-1] = slope_hint(static_cast<float>(rise_m / (rise_m < 0 ? near_m : far_m)));
        }
      }
    });
  }

  /// Bounds are worked out ring by ring, and handed out sector by sector.
  void turn_to_sectors() {
    const auto sectors = static_cast<std::size_t>(options_.sectors);
    parallel_for(bounds_.circle.size(), [&](std::size_t group) {
      float* bounds = bounds_.slope.data() + group * sectors * kRings;
      const std::vector<float> by_ring(bounds, bounds + sectors * kRings);
      for (std::size_t s = 0; s < sectors; ++s)
        for (std::size_t k = 0; k < kRings; ++k) bounds[s * kRings + k] = by_ring[k * sectors + s];
    });
  }

  /// A ridge that rises above all before it, and the slope of the sight lines that touch it.
  struct Sighted {
    std::uint32_t edge;
    double slope;
    float rise;  // of its line over the group's height at the centre, in radii
    std::ptrdiff_t crossing;
    bool is_tried = false, is_walled = false;
  };

  /// The crests and borders of a group, by the numbers of their corners.
  struct NumberedGroup {
    std::vector<VertexIndex> corners;
    std::vector<FanCrests::Ends> crests, borders;
  };

  /// Memory that Looks take one after another.
  struct Workspace {
    std::array<NumberedGroup, kGroupsAtOnce> numbered;
    FanCrests crests;
    std::vector<double> low_u_m, low_v_m, high_v_m;  // of crests
    std::vector<std::uint32_t> candidates;
    std::vector<FanEdge> exits;
    std::array<PieceTargets, kMostHalvings + 1> targets;
    std::array<ReachedCells, kMostHalvings + 1> reached_by_depth;
    std::vector<Sighted> sighted;
    std::vector<CellPlane> planes;
    Wall wall;
    std::vector<std::uint64_t> wanted;  // marks of cells
  };

  /// Works out one group for the rays of one fan.
  struct Look {
    const FanView& view;
    const Ridges& ridges;
    const RingTable& rings;
    const Turns& turns;
    FanPlace centre;
    double radius_m, height_m, unit_m;
    float* bounds;  // of the group: [kRings * sectors]
    ReachedCells::Known known;
    Workspace& work;
    FanCrests& crests = work.crests;
    std::vector<std::uint32_t>& candidates = work.candidates;
    std::vector<FanEdge>& exits = work.exits;  // all that rays can leave over
    std::array<PieceTargets, kMostHalvings + 1>& targets = work.targets;
    std::vector<Sighted>& sighted = work.sighted;
    std::vector<CellPlane>& planes = work.planes;
    Wall& wall = work.wall;
    std::size_t depth = 0;  // of halving
    int failures = 0;       // of ridges to carry a wall

    ReachedCells& reached() { return work.reached_by_depth[depth]; }
  };

  void number_corners(GroupIndex group, NumberedGroup& numbered) const {
    std::vector<VertexIndex>& corners = numbered.corners;
    for (const auto& edge : edges_.crests_of(group))
      corners.insert(corners.end(), edge.begin(), edge.end());
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    const auto ends_of = [&](const GroupEdges::Edge& edge) {
      FanCrests::Ends ends;
      for (std::size_t i = 0; i < 2; ++i)
        ends[i] = static_cast<std::uint32_t>(
            std::lower_bound(corners.begin(), corners.end(), edge[i]) - corners.begin());
      return ends;
    };
    for (const auto& edge : edges_.crests_of(group)) numbered.crests.push_back(ends_of(edge));
    for (const auto& edge : edges_.borders_of(group)) numbered.borders.push_back(ends_of(edge));
  }

  /// Places a group's corners, crests and exits in the fan's frame.
  static void place_group(const NumberedGroup& numbered, Look& look) {
    Workspace& work = look.work;
    look.crests.place_corners(look.view, numbered.corners);
    look.crests.ends = numbered.crests;
    const std::size_t size = look.crests.ends.size();
    work.low_u_m.resize(size), work.low_v_m.resize(size), work.high_v_m.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
      const auto [a, b] = look.crests.ends[i];
      work.low_u_m[i] = std::min(look.crests.u_m[a], look.crests.u_m[b]);
      work.low_v_m[i] = std::min(look.crests.v_m[a], look.crests.v_m[b]);
      work.high_v_m[i] = std::max(look.crests.v_m[a], look.crests.v_m[b]);
    }
    look.exits.clear();
    for (const auto& [a, b] : numbered.borders) {
      const FanEdge exit{look.crests.corner(a), look.crests.corner(b), a, b};
      if (!is_entry(look.view, exit)) look.exits.push_back(exit);
    }
    // What is high is seen first: it lowers bounds, and the rest needs no close look.
    std::sort(look.exits.begin(), look.exits.end(), [](const FanEdge& p, const FanEdge& q) {
      return p.a.z_m + p.b.z_m > q.a.z_m + q.b.z_m;
    });
  }

  void look_along(const FanView& view, const Ridges& ridges, const RingTable& rings,
                  const Turns& turns, GroupIndex group, const NumberedGroup& numbered,
                  Workspace& work) {
    const Circle& circle = bounds_.circle[group];
    work.wanted.resize(kRings / kCellsMarked * static_cast<std::size_t>(options_.sectors));
    const std::size_t first_cell =
        static_cast<std::size_t>(group) * static_cast<std::size_t>(options_.sectors) * kRings;
    float* bounds = bounds_.slope.data() + first_cell;
    Look look{view,
              ridges,
              rings,
              turns,
              {},
              circle.radius_m,
              bounds_.height_m[group],
              unit_m_[group],
              bounds,
              {bounds, least_.data() + first_cell, work.wanted.data()},
              work};
    look.centre =
        place_in(view.fan, circle.x_m - origin_x_m_, circle.y_m - origin_y_m_, look.height_m);
    place_group(numbered, look);
    look.reached().mark(turns, options_.sectors, look.known, work.wanted.data());
    for (const FanEdge& edge : look.exits) {
      behind(look, edge);
      look_from_piece(look, {edge.a, edge.b, &edge}, look.candidates);
    }
  }

  /// Finds the crests that rays over an edge can have come from.
  static void behind(Look& look, const FanEdge& edge) {
    const double drift_m = 2 * look.radius_m * look.view.fan.tan_half + 16 * look.view.error_m;
    const double low_v_m = std::min(edge.a.v_m, edge.b.v_m) - drift_m;
    const double high_v_m = std::max(edge.a.v_m, edge.b.v_m) + drift_m;
    const double high_u_m = std::max(edge.a.u_m, edge.b.u_m) + 16 * look.view.error_m;
    const Workspace& work = look.work;
    const std::size_t size = look.crests.ends.size();
    look.candidates.resize(size);
    std::size_t count = 0;
    // Without a branch: which crests are taken follows no pattern.
    for (std::uint32_t i = 0; i < size; ++i) {
      look.candidates[count] = i;
      count += static_cast<unsigned>(work.high_v_m[i] >= low_v_m) &
               static_cast<unsigned>(work.low_v_m[i] <= high_v_m) &
               static_cast<unsigned>(work.low_u_m[i] <= high_u_m);
    }
    look.candidates.resize(count);
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

  /// The cells that rays over a piece lead to; of a half, those that the whole leaves open.
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
    if (look.depth == 0)
      look.reached().reach(look.rings, look.turns, borders_, low, high, look.known);
    else
      look.reached().reach_part(look.work.reached_by_depth[look.depth - 1], low, high);
    // The outer of the lanes has the least reach.
    return high + low >= kLanes ? high : low;
  }

  CellPlane in_cells(const Look& look, const SkyPlane& plane) const {
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
    cell.rise = rise - std::abs(rise) * kSlopeRounding;
    // A camera's u is at least `forward` of its distance, which counts where the line rises, and
    // at most the distance, which counts where it falls.
    const double line_rise_m = plane.line_m + plane.line_slope * look.centre.u_m - look.height_m -
                               4 * look.view.height_error_m -
                               4 * std::abs(plane.line_slope) * look.view.error_m;
    const auto line_rise = static_cast<float>(line_rise_m / look.radius_m);
    cell.line_rise = line_rise - std::abs(line_rise) * kSlopeRounding;
    const auto line_slope = static_cast<float>(plane.line_slope);
    cell.rising = std::max(line_slope, 0.0F);
    cell.falling = std::min(line_slope, 0.0F) - std::abs(line_slope) * kSlopeRounding;
    cell.low_rad = static_cast<float>(-greatest_angle_rad(fan, -plane.low_turn)) - kAngleRounding;
    cell.high_rad = static_cast<float>(greatest_angle_rad(fan, plane.high_turn)) + kAngleRounding;
    return cell;
  }

  /// No less than the angle of a ray of the fan by its tangent, from terms of the series: the same
  /// bits everywhere, other than those of a library. Rays have no other angles than the fan's.
  static double greatest_angle_rad(const Fan& fan, double tangent) {
    const double t = std::clamp(tangent, -fan.tan_half, fan.tan_half), cube = t * t * t;
    return t - cube / 3 + (t > 0 ? cube * t * t / 5 : 0);
  }

  /// The first crossing from one on that is over a line. Most are not: many are passed at once,
  /// where the line is over the highest of them where it is lowest.
  static std::ptrdiff_t first_over(std::span<const RidgeCrossing> crossings,
                                   std::span<const float> highest, const Places::Line& line,
                                   std::size_t i) {
    const auto is_over = [&](float z_m, float u_m) {
      return static_cast<double>(z_m) > line.base_m + line.slope * static_cast<double>(u_m);
    };
    if (!(line.slope > -HUGE_VAL)) return static_cast<std::ptrdiff_t>(i);
    while (i < crossings.size()) {
      if (i % kCrossingsAtOnce == 0) {
        const std::size_t end = std::min(i + kCrossingsAtOnce, crossings.size());
        const float lowest_u_m = crossings[line.slope > 0 ? i : end - 1].u_m;
        if (!is_over(highest[i / kCrossingsAtOnce], lowest_u_m)) {
          i = end;
          continue;
        }
      }
      if (is_over(crossings[i].z_m, crossings[i].u_m)) break;
      ++i;
    }
    return static_cast<std::ptrdiff_t>(i);
  }

  /// Raises walls for the rays over a piece on the ridges that its middle ray sees.
  void raise_walls(Look& look, const ExitPiece& piece, const PieceTargets& targets,
                   std::size_t lane) {
    const FanView& view = look.view;
    ReachedCells& reached = look.reached();
    const auto& reach = look.rings.reach[lane];
    /// From which ring on, `first` or a later one, cameras are beyond a place.
    const auto ring_beyond = [&](double u_m, std::size_t first) {
      const double least = (u_m - look.centre.u_m + 4 * view.error_m) / look.radius_m;
      while (first < kRings && !(reach[first] > least)) ++first;
      return first;
    };
    const auto raise = [&](const Sighted& sighted) {
      Wall& wall = look.wall;
      if (!raise_wall(ridge_edges_, view, targets.beam, targets.places, sighted.edge, sighted.slope,
                      wall))
        return false;
      look.planes.clear();
      for (const SkyPlane& plane : wall.planes) {
        look.planes.push_back(in_cells(look, plane));
        look.planes.back().first_ring = ring_beyond(plane.beyond_m, 0);
      }
      reached.raise(look.planes);
      return true;
    };
    // A wall is raised on the last ridge before a ring that rises above all before it, if there
    // are rings for which it counts.
    look.sighted.clear();
    const double first_slope = targets.plane ? targets.plane->line_slope : -HUGE_VAL;
    constexpr Places::Line kNoLine{-HUGE_VAL, -HUGE_VAL};
    const auto line_of = [&](double slope) {
      return slope > -HUGE_VAL ? targets.places.tangent(slope) : kNoLine;
    };
    Places::Line line = line_of(first_slope);  // lowest over what has been seen
    std::size_t ring = 0;                      // all before have what they can get
    std::size_t open_end = reached.end_of_open();
    /// @return whether the last ridge carries a wall, if one is wanted
    const auto raise_before = [&](std::size_t end) {
      const std::size_t tries = std::min<std::size_t>(kMostTries, look.sighted.size());
      for (std::size_t i = 1; i <= tries; ++i) {
        Sighted& sighted = look.sighted[look.sighted.size() - i];
        if (!reached.is_promising(sighted.rise, static_cast<float>(sighted.slope), ring, end))
          return true;
        // Its wall counts for all rings beyond it: once is enough.
        const bool was_tried = std::exchange(sighted.is_tried, true);
        if (was_tried ? sighted.is_walled : (sighted.is_walled = raise(sighted))) return true;
        if (i == 1 && look.failures < kMostFailures) return false;
      }
      return true;
    };
    const auto crossings = look.ridges.along((piece.a.v_m + piece.b.v_m) / 2);
    const auto highest = look.ridges.highest_along((piece.a.v_m + piece.b.v_m) / 2);
    auto next = std::upper_bound(
        crossings.begin(), crossings.end(), std::max(piece.a.u_m, piece.b.u_m),
        [](double u_m, const RidgeCrossing& c) { return u_m < static_cast<double>(c.u_m); });
    for (look.failures = 0; ring < open_end; ++next) {
      next = crossings.begin() + first_over(crossings, highest, line,
                                            static_cast<std::size_t>(next - crossings.begin()));
      const bool is_last = next == crossings.end();
      const std::size_t end =
          is_last ? open_end : ring_beyond(static_cast<double>(next->u_m), ring);
      if (end > ring) {
        if (!raise_before(end)) {
          // As if the ridge were not there: it hid others from view.
          ++look.failures;
          next = crossings.begin() + look.sighted.back().crossing;
          look.sighted.pop_back();
          line = line_of(look.sighted.empty() ? first_slope : look.sighted.back().slope);
          continue;
        }
        ring = end;
        open_end = reached.end_of_open();
      }
      if (is_last) return;
      const auto u_m = static_cast<double>(next->u_m), z_m = static_cast<double>(next->z_m);
      line = targets.places.line_to(u_m, z_m, kLatticeStepM);
      const double rise_m = z_m + line.slope * (look.centre.u_m - u_m) - look.height_m;
      look.sighted.push_back({next->edge, line.slope, static_cast<float>(rise_m / look.radius_m),
                              next - crossings.begin()});
    }
  }

  /// Lowers the bounds of cells by what rays over a piece can see of the group. Looks closer, at
  /// halves, before it lowers any.
  /// @param candidates  crests behind the edge
  void look_from_piece(Look& look, const ExitPiece& piece,
                       std::span<const std::uint32_t> candidates) {
    if (is_passed(look, piece)) return;
    const std::size_t lane = reach_from(look, piece);
    if (!look.reached().is_open()) return look.reached().lower(look.bounds);
    PieceTargets& targets = look.targets[look.depth];
    find_targets(look.view, piece, look.crests, candidates, targets);
    if (targets.plane) {
      look.planes.assign(1, in_cells(look, *targets.plane));
      look.reached().raise(look.planes);
      if (!look.reached().is_open()) return look.reached().lower(look.bounds);
    }
    raise_walls(look, piece, targets, lane);
    if (!look.reached().is_open()) return look.reached().lower(look.bounds);
    const double du_m = piece.b.u_m - piece.a.u_m, dv_m = piece.b.v_m - piece.a.v_m;
    const double size_m = options_.piece * look.unit_m;
    if (look.depth < kMostHalvings && du_m * du_m + dv_m * dv_m > size_m * size_m) {
      const FanPlace middle{piece.a.u_m + du_m / 2, piece.a.v_m + dv_m / 2,
                            piece.a.z_m + (piece.b.z_m - piece.a.z_m) / 2};
      look.reached().lower_closed(look.bounds);
      ++look.depth;
      look_from_piece(look, {piece.a, middle, piece.edge}, targets.crests);
      look_from_piece(look, {middle, piece.b, piece.edge}, targets.crests);
      --look.depth;
      return;
    }
    look.reached().lower(look.bounds);
  }

  const Tin& tin_;
  const HidingOptions& options_;
  const GroupEdges edges_;
  const RidgeEdges ridge_edges_;
  std::vector<SectorBorders> borders_;
  float sagitta_ = 0;
  HidingBounds bounds_;
  std::vector<std::uint16_t> least_;  // slope hints: [groups * kRings * sectors]
  double origin_x_m_ = 0, origin_y_m_ = 0;
  std::vector<double> unit_m_;  // mean distance between vertices: [groups]
  double mean_unit_m_ = 0;
};

}  // namespace

HidingBounds bound_hiding(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                          std::uint32_t groups, const HidingOptions& options,
                          const Progress& progress, std::optional<std::size_t> own_triangles) {
  assert(group_of_triangle.size() == tin.triangles.size());
  if (groups == 0) return {};
  return Bounding(tin, group_of_triangle, groups, options, own_triangles).run(progress);
}

}  // namespace scarp
