#include "ingest/footprints/plane_graph.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace scarp {
namespace {

using Wide = __int128;
using Point = std::array<std::int64_t, 2>;

int side(const Point& a, const Point& b, const Point& c) {
  const Wide det = Wide{b[0] - a[0]} * (c[1] - a[1]) - Wide{b[1] - a[1]} * (c[0] - a[0]);
  return (det > 0) - (det < 0);
}

/// Whether c, on the line through a and b, lies between them or at one of them.
bool between(const Point& a, const Point& b, const Point& c) {
  return std::min(a[0], b[0]) <= c[0] && c[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= c[1] && c[1] <= std::max(a[1], b[1]);
}

class ConflictSearch {
 public:
  ConflictSearch(const PlaneGraph& graph, double clearance_m)
      : graph_(graph), clearance_m_(clearance_m) {}

  std::optional<std::array<std::uint32_t, 2>> run() const {
    std::vector<std::uint32_t> order(graph_.edges.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto low_x = [&](std::uint32_t e) { return std::min(end(e, 0)[0], end(e, 1)[0]); };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(low_x(a), a) < std::pair(low_x(b), b);
    });
    const auto reach_x = static_cast<std::int64_t>(std::ceil(clearance_m_ / graph_.step_x_m));
    const auto reach_y = static_cast<std::int64_t>(std::ceil(clearance_m_ / graph_.step_y_m));
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Point &a = end(order[i], 0), &b = end(order[i], 1);
      const std::int64_t high_x = std::max(a[0], b[0]) + reach_x;
      const auto [low_y, high_y] = std::minmax(a[1], b[1]);
      for (std::size_t j = i + 1; j < order.size() && low_x(order[j]) <= high_x; ++j) {
        const Point &c = end(order[j], 0), &d = end(order[j], 1);
        if (std::min(c[1], d[1]) > high_y + reach_y || std::max(c[1], d[1]) < low_y - reach_y)
          continue;
        if (conflict(order[i], order[j])) return std::array{order[i], order[j]};
      }
    }
    return {};
  }

 private:
  const Point& end(std::uint32_t edge, std::size_t i) const {
    return graph_.points[graph_.edges[edge][i]];
  }

  bool conflict(std::uint32_t one, std::uint32_t other) const {
    auto [a, b] = graph_.edges[one];
    auto [c, d] = graph_.edges[other];
    if (a == d || b == d) std::swap(c, d);
    if (b == c) std::swap(a, b);
    const auto at = [&](std::uint32_t v) -> const Point& { return graph_.points[v]; };
    if (a == c) {
      if (b == d) return true;
      const bool folded = side(at(a), at(b), at(d)) == 0 &&
                          (between(at(a), at(b), at(d)) || between(at(a), at(d), at(b)));
      return folded || near(at(b), at(c), at(d)) || near(at(d), at(a), at(b));
    }
    const int sc = side(at(a), at(b), at(c)), sd = side(at(a), at(b), at(d));
    const int sa = side(at(c), at(d), at(a)), sb = side(at(c), at(d), at(b));
    if (sc * sd < 0 && sa * sb < 0) return true;
    if ((sc == 0 && between(at(a), at(b), at(c))) || (sd == 0 && between(at(a), at(b), at(d))) ||
        (sa == 0 && between(at(c), at(d), at(a))) || (sb == 0 && between(at(c), at(d), at(b))))
      return true;
    return near(at(a), at(c), at(d)) || near(at(b), at(c), at(d)) || near(at(c), at(a), at(b)) ||
           near(at(d), at(a), at(b));
  }

  /// Whether p is nearer to the segment a - b than the clearance.
  bool near(const Point& p, const Point& a, const Point& b) const {
    if (clearance_m_ <= 0) return false;
    const auto metres = [&](const Point& from, const Point& to) {
      return std::array{static_cast<double>(to[0] - from[0]) * graph_.step_x_m,
                        static_cast<double>(to[1] - from[1]) * graph_.step_y_m};
    };
    const auto [ux, uy] = metres(a, b);
    const auto [vx, vy] = metres(a, p);
    const double along = std::clamp((ux * vx + uy * vy) / (ux * ux + uy * uy), 0.0, 1.0);
    return std::hypot(vx - along * ux, vy - along * uy) < clearance_m_;
  }

  const PlaneGraph& graph_;
  const double clearance_m_;
};

}  // namespace

std::optional<std::array<std::uint32_t, 2>> find_conflict(const PlaneGraph& graph,
                                                          double clearance_m) {
  return ConflictSearch(graph, clearance_m).run();
}

}  // namespace scarp
