#include "core/horizon/certified/wall.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace scarp {
namespace {

/// Edges that are tried each way.
constexpr int kMostSteps = 48;

/// A chain should not run nearly along the fan: its edges turn from the axis by this tangent at
/// least, where there are such edges. Guides the search.
constexpr double kLeastTurn = 0.3;

class Chain {
 public:
  Chain(const RidgeEdges& ridges, const FanView& view, const Beam& beam, double slope)
      : ridges_(ridges), view_(view), beam_(beam), slope_(slope) {}

  /// @param vertices[out]  of the chain, by rising v
  /// @return whether it spans the beam
  bool follow(const RidgeEdges::Edge& edge, std::vector<VertexIndex>& vertices) const {
    VertexIndex low = edge[0], high = edge[1];
    if (place(low).v_m > place(high).v_m) std::swap(low, high);
    if (!is_rising(place(low), place(high))) return false;
    vertices.assign(1, low);
    if (!extend(beam_.low, -1, vertices)) return false;
    std::reverse(vertices.begin(), vertices.end());
    vertices.push_back(high);
    return extend(beam_.high, 1, vertices);
  }

 private:
  const FanPlace& place(VertexIndex v) const { return view_.vertices[v]; }

  bool is_rising(const FanPlace& p, const FanPlace& q) const {
    return q.v_m - p.v_m > 8 * view_.error_m;
  }

  /// Appends vertices until one lies beyond a side of the beam. Goes back from where no edge leads
  /// on, such as a tip of ground in a void.
  bool extend(const HalfPlane& side_line, int side, std::vector<VertexIndex>& vertices) const {
    const std::size_t begin = vertices.size();
    std::array<VertexIndex, kMostSteps> left;  // where it has been in vain
    std::size_t left_count = 0;
    for (int steps = 0; side_line.at(place(vertices.back())) >= 0; ++steps) {
      if (steps == kMostSteps) return false;
      const auto next = highest_from(vertices.back(), side, {left.data(), left_count});
      if (next) {
        vertices.push_back(*next);
        continue;
      }
      if (vertices.size() == begin) return false;
      left[left_count++] = vertices.back();
      vertices.pop_back();
    }
    return true;
  }

  /// The edge that rises most across the beam, as sight lines of the slope see it; where none leads
  /// across, the one that ends highest.
  /// @param left  not to these
  std::optional<VertexIndex> highest_from(VertexIndex v, int side,
                                          std::span<const VertexIndex> left) const {
    const FanPlace p = place(v);
    const double least_m = 8 * view_.error_m;
    VertexIndex best = kNone, other_best = kNone;
    double best_rise = -HUGE_VAL, other_best_rise = -HUGE_VAL;
    // Without branches, but for those that are nearly never taken: edges follow no pattern.
    for (const VertexIndex other : ridges_.around_of(v)) {
      const FanPlace& q = place(other);
      if (!left.empty() && std::find(left.begin(), left.end(), other) != left.end()) continue;
      const double du_m = q.u_m - p.u_m, dv_m = side > 0 ? q.v_m - p.v_m : p.v_m - q.v_m;
      const double above_m = q.z_m - p.z_m - slope_ * du_m;
      const bool is_across = dv_m > std::abs(du_m) * least_turn_ + least_m;
      const bool is_rising = dv_m > least_m;
      const double rise = is_across ? above_m / dv_m : -HUGE_VAL;
      const double other_rise = is_rising & !is_across ? above_m : -HUGE_VAL;
      best = rise > best_rise ? other : best;
      best_rise = rise > best_rise ? rise : best_rise;
      other_best = other_rise > other_best_rise ? other : other_best;
      other_best_rise = other_rise > other_best_rise ? other_rise : other_best_rise;
    }
    const VertexIndex found = best != kNone ? best : other_best;
    return found != kNone ? std::optional(found) : std::nullopt;
  }

  const RidgeEdges& ridges_;
  const FanView& view_;
  const Beam& beam_;
  double slope_;
  /// Chains should not run nearly along the fan.
  const double least_turn_ = std::max(view_.fan.tan_half, kLeastTurn);
};

/// Which way rays lead from the line that a beam begins at to a part of an edge: that is linear
/// over linear in both places, so the least and the most are at ends.
void turn_rays(const FanView& view, const Beam& beam, const std::array<FanPlace, 2>& part,
               SkyPlane& plane) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const FanPlace& p : {beam.from, beam.to})
    for (const FanPlace& q : part) {
      const double way_m = q.u_m - p.u_m;
      if (!(way_m > kTooNear * view.error_m)) return;
      const double turn = (q.v_m - p.v_m) / way_m;
      const double error = 16 * view.error_m * (1 + std::abs(turn)) / way_m;
      low = std::min(low, turn - error);
      high = std::max(high, turn + error);
    }
  plane.low_turn = low, plane.high_turn = high;
}

/// The plane that an edge of the chain holds, with the better of two lines along rays.
std::optional<SkyPlane> plane_over(const FanView& view, const std::array<FanPlace, 2>& edge,
                                   const std::array<FanPlace, 2>& part, const Places& targets) {
  EdgePlane through_edge(view, edge[0], edge[1]);
  CurtainPlane curtain(view, part[0], part[1]);
  const Places::Rises least = targets.least_rises(through_edge.line(), curtain.line());
  through_edge.hold_rise(least.edge);
  curtain.hold_slope(least.curtain);
  if (!through_edge.is_held())
    return curtain.is_held() ? std::optional(curtain.plane()) : std::nullopt;
  SkyPlane plane = through_edge.plane(part[0], part[1]);
  if (!curtain.is_held()) return plane;
  const SkyPlane level = curtain.plane();
  if (level.line_slope > plane.line_slope)
    plane.line_slope = level.line_slope, plane.line_m = level.line_m;
  return plane;
}

}  // namespace

bool raise_wall(const RidgeEdges& ridges, const FanView& view, const Beam& beam,
                const Places& targets, std::uint32_t edge, double slope, Wall& wall) {
  const std::vector<VertexIndex>& chain = wall.chain;
  if (!Chain(ridges, view, beam, slope).follow(ridges.edges[edge], wall.chain)) return false;
  wall.planes.clear();
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const FanPlace &a = view.vertices[chain[i]], &b = view.vertices[chain[i + 1]];
    double from = 0, to = 1;
    cut(beam.low.at(a), beam.low.at(b), from, to);
    cut(beam.high.at(a), beam.high.at(b), from, to);
    if (!(from <= to)) continue;
    const std::array<FanPlace, 2> ends{between(a, b, from), between(a, b, to)};
    for (const FanPlace& end : ends)
      if (!(beam.ahead.at(end) > 8 * view.error_m)) return false;
    auto plane = plane_over(view, {a, b}, ends, targets);
    if (!plane) return false;
    turn_rays(view, beam, ends, *plane);
    plane->beyond_m = std::max(ends[0].u_m, ends[1].u_m);
    wall.planes.push_back(*plane);
  }
  return !wall.planes.empty();
}

}  // namespace scarp
