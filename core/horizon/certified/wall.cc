#include "core/horizon/certified/wall.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace scarp {
namespace {

/// A chain is followed this far each way.
constexpr int kMostSteps = 48;

/// A chain must not run nearly along the fan: its edges turn from the axis by this tangent at
/// least. Guides the search; that rays cross an edge one way is asked for besides.
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

  /// Whether all rays of the fan cross an edge from behind to beyond; p has the lesser v.
  bool is_crossed(const FanPlace& p, const FanPlace& q) const {
    const double least = std::max(view_.fan.tan_half, kLeastTurn);
    return q.v_m - p.v_m > std::abs(q.u_m - p.u_m) * least + 8 * view_.error_m;
  }

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

  /// The edge that rises most across the beam, as sight lines of the slope see it.
  std::optional<VertexIndex> highest_from(VertexIndex v, int side,
                                          std::span<const VertexIndex> left) const {
    const FanPlace& p = place(v);
    std::optional<VertexIndex> best, other_best;
    double best_rise = -HUGE_VAL, other_best_rise = -HUGE_VAL;
    for (const VertexIndex other : ridges_.around_of(v)) {
      const FanPlace& q = place(other);
      if (!(side > 0 ? is_rising(p, q) : is_rising(q, p))) continue;
      if (std::find(left.begin(), left.end(), other) != left.end()) continue;
      const double above_m = q.z_m - p.z_m - slope_ * (q.u_m - p.u_m);
      if (!(side > 0 ? is_crossed(p, q) : is_crossed(q, p))) {
        if (above_m > other_best_rise) other_best = other, other_best_rise = above_m;
        continue;
      }
      const double rise = above_m / std::abs(q.v_m - p.v_m);
      if (rise > best_rise) best = other, best_rise = rise;
    }
    return best ? best : other_best;
  }

  const RidgeEdges& ridges_;
  const FanView& view_;
  const Beam& beam_;
  double slope_;
};

}  // namespace

bool raise_wall(const RidgeEdges& ridges, const FanView& view, const Beam& beam,
                const Places& targets, std::uint32_t edge, double slope, Wall& wall) {
  const std::vector<VertexIndex>& chain = wall.chain;
  if (!Chain(ridges, view, beam, slope).follow(ridges.edges[edge], wall.chain)) return false;
  wall.u_m = -HUGE_VAL;
  wall.planes.clear();
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const FanPlace &a = view.vertices[chain[i]], &b = view.vertices[chain[i + 1]];
    double from = 0, to = 1;
    cut(beam.low.at(a), beam.low.at(b), from, to);
    cut(beam.high.at(a), beam.high.at(b), from, to);
    if (!(from <= to)) continue;
    const std::array<FanPlace, 2> ends{between(a, b, from), between(a, b, to)};
    EdgePlane plane(view, a, b);
    plane.hold(targets);
    for (const FanPlace& end : ends) {
      if (!(beam.ahead.at(end) > 8 * view.error_m)) return false;
      wall.u_m = std::max(wall.u_m, end.u_m);
    }
    if (plane.is_held()) {
      wall.planes.push_back(plane.plane(ends[0], ends[1]));
    }
    CurtainPlane curtain(view, ends[0], ends[1]);
    curtain.hold(targets);
    if (plane.is_held()) {
      if (!curtain.is_held()) continue;
      const SkyPlane level = curtain.plane();
      SkyPlane& sky = wall.planes.back();
      if (level.line_slope > sky.line_slope) {
        sky.line_slope = level.line_slope, sky.line_m = level.line_m;
      }
      continue;
    }
    if (!curtain.is_held()) return false;
    wall.planes.push_back(curtain.plane());
  }
  return !wall.planes.empty();
}

}  // namespace scarp
