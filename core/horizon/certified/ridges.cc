#include "core/horizon/certified/ridges.h"

#include <algorithm>
#include <cmath>

namespace scarp {

RidgeEdges ridge_edges_of(const Tin& tin) {
  RidgeEdges ridges;
  ridges.first_around.assign(tin.vertices.size() + 1, 0);
  // Each edge once, as the one opposite to a corner of its first triangle.
  const auto visit_edges = [&](auto visit) {
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
      for (std::size_t i = 0; i < 3; ++i)
        if (const TriangleIndex other = tin.neighbours[t][i]; other == kNone || t < other)
          visit(t, i, tin.triangles[t][(i + 1) % 3], tin.triangles[t][(i + 2) % 3]);
  };
  visit_edges([&](TriangleIndex t, std::size_t i, VertexIndex from, VertexIndex to) {
    ++ridges.first_around[from + 1];
    ++ridges.first_around[to + 1];
    if (tin.neighbours[t][i] == kNone || bends_downwards(tin, t, i))
      ridges.edges.push_back({from, to});
  });
  for (std::size_t v = 0; v < tin.vertices.size(); ++v)
    ridges.first_around[v + 1] += ridges.first_around[v];
  ridges.around.resize(ridges.first_around.back());
  std::vector<std::uint32_t> next(ridges.first_around.begin(), ridges.first_around.end() - 1);
  visit_edges([&](TriangleIndex, std::size_t, VertexIndex from, VertexIndex to) {
    ridges.around[next[from]++] = to;
    ridges.around[next[to]++] = from;
  });
  return ridges;
}

void Ridges::cross(const RidgeEdges& ridges, const FanView& view, double width_m,
                   const RidgeRange& range) {
  width_m_ = width_m;
  low_v_m_ = view.low_v_m;
  const auto strip_of = [&](double v_m) {
    return static_cast<std::ptrdiff_t>((std::clamp(v_m, view.low_v_m, view.high_v_m) - low_v_m_) /
                                       width_m);
  };
  first_strip_ = strip_of(range.low_v_m);
  const std::ptrdiff_t last_strip = strip_of(range.high_v_m);
  const auto strips = static_cast<std::size_t>(last_strip - first_strip_ + 1);
  first_.assign(strips + 1, 0);
  /// Calls visit(strip, u, z) for the middle lines that an edge crosses.
  const auto visit_crossings = [&](const RidgeEdges::Edge& edge, auto visit) {
    const FanPlace& p = view.vertices[edge[0]];
    const FanPlace& q = view.vertices[edge[1]];
    if (p.u_m < range.low_u_m && q.u_m < range.low_u_m) return;
    const double low = (std::min(p.v_m, q.v_m) - low_v_m_) / width_m - 0.5;
    const double high = (std::max(p.v_m, q.v_m) - low_v_m_) / width_m - 0.5;
    const auto last = std::min(last_strip, static_cast<std::ptrdiff_t>(std::floor(high)));
    for (auto s = std::max(first_strip_, static_cast<std::ptrdiff_t>(std::ceil(low))); s <= last;
         ++s) {
      if (!(p.v_m != q.v_m)) continue;
      const double v_m = low_v_m_ + (static_cast<double>(s) + 0.5) * width_m;
      const double share = (v_m - p.v_m) / (q.v_m - p.v_m);
      visit(static_cast<std::size_t>(s - first_strip_), p.u_m + share * (q.u_m - p.u_m),
            p.z_m + share * (q.z_m - p.z_m));
    }
  };
  for (const auto& edge : ridges.edges)
    visit_crossings(edge, [&](std::size_t s, double, double) { ++first_[s + 1]; });
  for (std::size_t s = 0; s < strips; ++s) first_[s + 1] += first_[s];
  crossings_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t e = 0; e < ridges.edges.size(); ++e)
    visit_crossings(ridges.edges[e], [&](std::size_t s, double u_m, double z_m) {
      crossings_[next[s]++] = {static_cast<float>(u_m), static_cast<float>(z_m), e};
    });
  for (std::size_t s = 0; s < strips; ++s)
    std::sort(crossings_.begin() + static_cast<std::ptrdiff_t>(first_[s]),
              crossings_.begin() + static_cast<std::ptrdiff_t>(first_[s + 1]),
              [](const RidgeCrossing& a, const RidgeCrossing& b) {
                return a.u_m < b.u_m || (a.u_m == b.u_m && a.edge < b.edge);
              });
}

std::span<const RidgeCrossing> Ridges::along(double v_m) const {
  const double strip = (v_m - low_v_m_) / width_m_ - static_cast<double>(first_strip_);
  const auto s =
      static_cast<std::size_t>(std::clamp(strip, 0.0, static_cast<double>(first_.size() - 2)));
  return {crossings_.data() + first_[s], first_[s + 1] - first_[s]};
}

}  // namespace scarp
