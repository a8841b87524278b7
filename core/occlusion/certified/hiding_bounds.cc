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
#include "core/occlusion/certified/group_edges.h"
#include "core/occlusion/certified/group_look.h"
#include "core/occlusion/certified/least_ground.h"
#include "core/occlusion/certified/reached_cells.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Directions that are worked on at once; their ridges are in memory together.
constexpr std::int32_t kFansAtOnce = 4;

constexpr float kEverything = std::numeric_limits<float>::infinity();

/// Groups that are worked on one after another, in the same memory.
constexpr std::size_t kGroupsAtOnce = 16;

/// Cameras outside the data count as far out as this, in radii of the group.
constexpr double kOutsideRadii = 2;

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
    bounds_.slope.assign(
        static_cast<std::size_t>(groups) * static_cast<std::size_t>(options.sectors) * kRings,
        kEverything);
  }

  HidingBounds run(const Progress& progress) {
    const RingTable rings(bounds_.layout, fan_of(options_.fans, 0));
    const std::vector<SectorBorders> borders = borders_of(bounds_.layout);
    hint_at_ground();
    // No sector is as much as a tenth wider than equal ones would be.
    const auto sagitta =
        static_cast<float>(1 - std::cos(1.1 * std::numbers::pi / options_.sectors));
    const LookSettings settings{ridge_edges_,
                                borders,
                                sagitta,
                                options_.piece,
                                options_.fan_halvings,
                                kMostDrift * mean_unit_m_};
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
        GroupLook look(settings);
        std::array<NumberedGroup, kGroupsAtOnce> numbered;
        const std::size_t first = chunk * kGroupsAtOnce;
        const std::size_t end = std::min(groups(), first + kGroupsAtOnce);
        for (std::size_t group = first; group < end; ++group) {
          const auto g = static_cast<GroupIndex>(group);
          numbered[group - first] = NumberedGroup(edges_.crests_of(g), edges_.borders_of(g));
        }
        // Neighbours look at the same ridges: a fan is taken for all of them while it is at hand.
        for (std::size_t i = 0; i < count; ++i)
          for (std::size_t group = first; group < end; ++group)
            look.look(views[i], ridges[i], rings, turns[i], numbered[group - first],
                      looked_at(group, views[i].fan));
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
    // As far as lines that are looked along can leave the middle of the fan.
    range.low_v_m -= kMostDrift * mean_unit_m_, range.high_v_m += kMostDrift * mean_unit_m_;
    return range;
  }

  LookedGroup looked_at(std::size_t group, const Fan& fan) {
    const Circle& circle = bounds_.circle[group];
    const double height_m = bounds_.height_m[group];
    const std::size_t first_cell = group * static_cast<std::size_t>(options_.sectors) * kRings;
    return {place_in(fan, circle.x_m - origin_x_m_, circle.y_m - origin_y_m_, height_m),
            circle.radius_m,
            height_m,
            unit_m_[group],
            bounds_.slope.data() + first_cell,
            least_.data() + first_cell};
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

  const Tin& tin_;
  const HidingOptions& options_;
  const GroupEdges edges_;
  const RidgeEdges ridge_edges_;
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
