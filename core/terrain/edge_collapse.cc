#include "core/terrain/edge_collapse.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <optional>
#include <queue>
#include <tuple>

#include "core/geodesy/predicates.h"
#include "core/terrain/occluder.h"

namespace scarp {
namespace {

/// Vertices with more neighbours stay: their fans would be slivers.
constexpr std::size_t kMostNeighbours = 24;

double side(const Position& a, const Position& b, const Position& c) {
  return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m);
}

/// The neighbours of a vertex, counter-clockwise; the first and the last lie on the border where
/// the vertex does.
struct Ring {
  std::vector<VertexIndex> around;
  bool is_closed = false;

  std::size_t triangles() const { return is_closed ? around.size() : around.size() - 1; }
  VertexIndex next(std::size_t i) const { return around[(i + 1) % around.size()]; }
};

struct Candidate {
  double cost = std::numeric_limits<double>::infinity();
  VertexIndex kept = kNone;
  double above_m = 0, below_m = 0;
};

class Simplifier {
 public:
  Simplifier(const Tin& tin, const CollapseOptions& options)
      : places_(tin.vertices), options_(options), around_(tin.vertices.size()) {
    history_.triangles = tin.triangles;
    history_.original_triangles = static_cast<TriangleIndex>(tin.triangles.size());
    history_.removed_by.assign(tin.triangles.size(), kNone);
    above_m_.assign(tin.triangles.size(), 0);
    below_m_.assign(tin.triangles.size(), 0);
    left_ = tin.triangles.size();
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
      for (const VertexIndex v : tin.triangles[t]) around_[v].push_back(t);
    stamp_.assign(tin.vertices.size(), 0);
    best_.resize(tin.vertices.size());
  }

  CollapseHistory run() && {
    for (VertexIndex v = 0; v < around_.size(); ++v) weigh(v);
    while (left_ > options_.triangles_left && !queue_.empty()) {
      const auto [cost, vertex, stamp] = queue_.top();
      queue_.pop();
      if (stamp == stamp_[vertex]) collapse(vertex);
    }
    return std::move(history_);
  }

 private:
  using Entry = std::tuple<double, VertexIndex, std::uint32_t>;

  const Position& at(VertexIndex v) const { return places_[v]; }

  /// Nothing where the triangles around a vertex are not one fan.
  bool find_ring(VertexIndex vertex, Ring& ring) const {
    const std::vector<TriangleIndex>& fan = around_[vertex];
    ring.around.clear();
    if (fan.empty() || fan.size() > kMostNeighbours) return false;
    std::array<std::array<VertexIndex, 2>, kMostNeighbours> edges;
    for (std::size_t i = 0; i < fan.size(); ++i) {
      const auto& t = history_.triangles[fan[i]];
      const std::size_t corner = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
      edges[i] = {t[(corner + 1) % 3], t[(corner + 2) % 3]};
    }
    const auto begin = edges.begin(), end = edges.begin() + static_cast<std::ptrdiff_t>(fan.size());
    auto first = std::find_if(begin, end, [&](const auto& edge) {
      return std::none_of(begin, end, [&](const auto& other) { return other[1] == edge[0]; });
    });
    ring.is_closed = first == end;
    if (ring.is_closed) first = begin;
    ring.around.push_back((*first)[0]);
    VertexIndex at = (*first)[1];
    for (std::size_t steps = 1; steps < fan.size(); ++steps) {
      ring.around.push_back(at);
      const auto next = std::find_if(begin, end, [&](const auto& edge) { return edge[0] == at; });
      if (next == end) return false;
      at = (*next)[1];
    }
    if (!ring.is_closed) ring.around.push_back(at);
    return ring.is_closed ? at == ring.around.front() : true;
  }

  bool may_leave_border(VertexIndex vertex, const Ring& ring) const {
    const int bend = orient2d(at(ring.around.front()), at(ring.around.back()), at(vertex));
    return bend == 0 || (options_.may_shrink && bend > 0);
  }

  /// The fan around ring.around[kept] covers what the triangles around the vertex cover.
  bool is_fan_proper(const Ring& ring, std::size_t kept) const {
    const VertexIndex v = ring.around[kept];
    for (std::size_t i = 0; i < ring.triangles(); ++i) {
      if (ring.around[i] == v || ring.next(i) == v) continue;
      if (orient2d(at(v), at(ring.around[i]), at(ring.next(i))) <= 0) return false;
    }
    return true;
  }

  /// Gap at the vertex itself, and where an old spoke runs under or over a new one: the corners of
  /// the overlay of the old triangles and the new ones.
  SurfaceGap measure(VertexIndex vertex, const Ring& ring, std::size_t kept) const {
    SurfaceGap gap;
    const auto take = [&](double above_m) {
      gap.above_m = std::max(gap.above_m, above_m + kGapRoundingM);
      gap.below_m = std::max(gap.below_m, kGapRoundingM - above_m);
    };
    const Position &u = at(vertex), &v = at(ring.around[kept]);
    for (std::size_t i = 0; i < ring.triangles(); ++i) {
      const Position &a = at(ring.around[i]), &b = at(ring.next(i));
      if (ring.around[i] == ring.around[kept] || ring.next(i) == ring.around[kept]) continue;
      const double from_v = side(a, b, u), from_a = side(b, v, u), from_b = side(v, a, u);
      if (from_v < 0 || from_a < 0 || from_b < 0) continue;
      const double whole = from_v + from_a + from_b;
      take((from_v * v.z_m + from_a * a.z_m + from_b * b.z_m) / whole - u.z_m);
    }
    for (const VertexIndex p : ring.around) {
      for (const VertexIndex q : ring.around) {
        if (p == q || p == ring.around[kept] || q == ring.around[kept]) continue;
        const Position &old_end = at(p), &new_end = at(q);
        const double u_side = side(v, new_end, u), p_side = side(v, new_end, old_end);
        const double v_side = side(u, old_end, v), q_side = side(u, old_end, new_end);
        if (!(u_side * p_side < 0) || !(v_side * q_side < 0)) continue;
        const double old_share = u_side / (u_side - p_side), new_share = v_side / (v_side - q_side);
        take(v.z_m + new_share * (new_end.z_m - v.z_m) -
             (u.z_m + old_share * (old_end.z_m - u.z_m)));
      }
    }
    return gap;
  }

  /// What the solid under the triangles around a vertex loses, m3, and twice what is added at most.
  double volume_cost(VertexIndex vertex, const Ring& ring, std::size_t kept, double above_m) const {
    double floor_m = at(vertex).z_m;
    for (const VertexIndex p : ring.around) floor_m = std::min(floor_m, at(p).z_m);
    const auto volume = [&](const Position& a, const Position& b, const Position& c) {
      return side(a, b, c) * (a.z_m + b.z_m + c.z_m - 3 * floor_m) / 6;
    };
    double lost_m3 = 0, area_m2 = 0;
    for (std::size_t i = 0; i < ring.triangles(); ++i) {
      const Position &a = at(ring.around[i]), &b = at(ring.next(i)), &v = at(ring.around[kept]);
      lost_m3 += volume(at(vertex), a, b) - volume(v, a, b);
      area_m2 += side(at(vertex), a, b) / 2;
    }
    return std::max(0.0, lost_m3) + 2 * area_m2 * above_m;
  }

  void weigh(VertexIndex vertex) {
    ++stamp_[vertex];
    Ring& ring = ring_;
    if (!find_ring(vertex, ring)) return;
    if (!ring.is_closed && !may_leave_border(vertex, ring)) return;
    double above_m = 0, below_m = 0;
    for (const TriangleIndex t : around_[vertex]) {
      above_m = std::max(above_m, above_m_[t]);
      below_m = std::max(below_m, below_m_[t]);
    }
    Candidate best;
    for (std::size_t i = 0; i < ring.around.size(); ++i) {
      if (!ring.is_closed && i != 0 && i + 1 != ring.around.size()) continue;
      if (!is_fan_proper(ring, i)) continue;
      const SurfaceGap gap = measure(vertex, ring, i);
      Candidate candidate{0, ring.around[i], above_m + gap.above_m, below_m + gap.below_m};
      if (candidate.above_m > options_.most_above_m || candidate.below_m > options_.most_below_m)
        continue;
      candidate.cost = options_.cost == CollapseCost::kError
                           ? std::max(candidate.above_m, candidate.below_m)
                           : volume_cost(vertex, ring, i, gap.above_m);
      if (candidate.cost < best.cost) best = candidate;
    }
    if (best.kept == kNone) return;
    best_[vertex] = best;
    queue_.emplace(best.cost, vertex, stamp_[vertex]);
  }

  void collapse(VertexIndex vertex) {
    Ring ring;
    [[maybe_unused]] const bool is_fan = find_ring(vertex, ring);
    assert(is_fan);
    const Candidate& how = best_[vertex];
    const auto index = static_cast<std::uint32_t>(history_.collapses.size());
    history_.collapses.push_back({vertex, how.kept,
                                  static_cast<TriangleIndex>(history_.triangles.size()),
                                  how.above_m, how.below_m});
    for (const TriangleIndex t : around_[vertex]) {
      history_.removed_by[t] = index;
      for (const VertexIndex v : history_.triangles[t])
        if (v != vertex) std::erase(around_[v], t);
    }
    left_ -= around_[vertex].size();
    around_[vertex].clear();
    ++stamp_[vertex];
    for (std::size_t i = 0; i < ring.triangles(); ++i) {
      if (ring.around[i] == how.kept || ring.next(i) == how.kept) continue;
      const auto t = static_cast<TriangleIndex>(history_.triangles.size());
      history_.triangles.push_back({how.kept, ring.around[i], ring.next(i)});
      history_.removed_by.push_back(kNone);
      above_m_.push_back(how.above_m);
      below_m_.push_back(how.below_m);
      for (const VertexIndex v : history_.triangles[t]) around_[v].push_back(t);
      ++left_;
    }
    for (const VertexIndex v : ring.around) weigh(v);
  }

  const std::vector<Position>& places_;
  const CollapseOptions& options_;
  CollapseHistory history_;
  std::vector<std::vector<TriangleIndex>> around_;  // [vertices]
  std::vector<double> above_m_, below_m_;           // [triangles]
  std::size_t left_ = 0;
  Ring ring_;  // memory of weigh
  std::vector<std::uint32_t> stamp_;
  std::vector<Candidate> best_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

}  // namespace

CollapseHistory collapse_edges(const Tin& tin, const CollapseOptions& options) {
  return Simplifier(tin, options).run();
}

Tin simplified(const Tin& tin, const CollapseHistory& history,
               std::vector<std::int64_t>* vertex_of) {
  Tin left;
  std::vector<VertexIndex> renamed(tin.vertices.size(), kNone);
  for (std::size_t t = 0; t < history.triangles.size(); ++t)
    if (history.removed_by[t] == kNone) {
      left.triangles.push_back(history.triangles[t]);
      for (const VertexIndex v : history.triangles[t]) renamed[v] = 0;
    }
  if (vertex_of != nullptr) vertex_of->clear();
  for (std::size_t v = 0; v < renamed.size(); ++v) {
    if (renamed[v] == kNone) continue;
    renamed[v] = static_cast<VertexIndex>(left.vertices.size());
    left.vertices.push_back(tin.vertices[v]);
    if (vertex_of != nullptr) vertex_of->push_back(static_cast<std::int64_t>(v));
  }
  for (auto& triangle : left.triangles)
    for (VertexIndex& v : triangle) v = renamed[v];
  connect_neighbours(left);
  return left;
}

}  // namespace scarp
