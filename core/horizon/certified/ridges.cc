#include "core/horizon/certified/ridges.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/threads/for_each_target.h"

namespace scarp {

namespace {

/// Strips and what they hold.
struct Strips {
  double low_v_m, width_m, low_u_m;
  std::int32_t first, last;
};

/// For each edge the strips whose middle lines it crosses, from strips.first on: [first, end),
/// first == end where there is none.
SCARP_FOR_EACH_TARGET
void find_strips(const RidgeEdges::Edge* edges, std::size_t count, const FanPlace* vertices,
                 const Strips& strips, std::int32_t* first, std::int32_t* end) {
  const Strips in = strips;
  for (std::size_t e = 0; e < count; ++e) {
    const FanPlace& p = vertices[edges[e][0]];
    const FanPlace& q = vertices[edges[e][1]];
    const bool is_ahead = !(p.u_m < in.low_u_m && q.u_m < in.low_u_m);
    const double low_m = p.v_m < q.v_m ? p.v_m : q.v_m, high_m = p.v_m < q.v_m ? q.v_m : p.v_m;
    const auto low = static_cast<std::int32_t>(std::ceil((low_m - in.low_v_m) / in.width_m - 0.5));
    const auto high =
        static_cast<std::int32_t>(std::floor((high_m - in.low_v_m) / in.width_m - 0.5));
    const std::int32_t from = low > in.first ? low : in.first;
    const std::int32_t to = high < in.last ? high : in.last;
    const bool is_crossed = is_ahead & (from <= to) & (low_m < high_m);
    first[e] = is_crossed ? from - in.first : 0;
    end[e] = is_crossed ? to + 1 - in.first : 0;
  }
}

}  // namespace

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
  first_edge_strip_.resize(ridges.edges.size()), end_edge_strip_.resize(ridges.edges.size());
  find_strips(ridges.edges.data(), ridges.edges.size(), view.vertices.data(),
              {low_v_m_, width_m, range.low_u_m, static_cast<std::int32_t>(first_strip_),
               static_cast<std::int32_t>(last_strip)},
              first_edge_strip_.data(), end_edge_strip_.data());
  // How many more cross a strip than the one before; then how many cross it and all before.
  first_.assign(strips + 2, 0);
  for (std::size_t e = 0; e < ridges.edges.size(); ++e) {
    ++first_[static_cast<std::size_t>(first_edge_strip_[e]) + 1];
    --first_[static_cast<std::size_t>(end_edge_strip_[e]) + 1];
  }
  first_.pop_back();
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  crossings_.resize(first_.back());
  next_.assign(first_.begin(), first_.end() - 1);
  for (std::uint32_t e = 0; e < ridges.edges.size(); ++e) {
    const std::int32_t end = end_edge_strip_[e];
    if (first_edge_strip_[e] == end) continue;
    const FanPlace& p = view.vertices[ridges.edges[e][0]];
    const FanPlace& q = view.vertices[ridges.edges[e][1]];
    for (std::int32_t s = first_edge_strip_[e]; s < end; ++s) {
      const double v_m = low_v_m_ + (static_cast<double>(first_strip_ + s) + 0.5) * width_m;
      const double share = (v_m - p.v_m) / (q.v_m - p.v_m);
      crossings_[next_[static_cast<std::size_t>(s)]++] = {
          static_cast<float>(p.u_m + share * (q.u_m - p.u_m)),
          static_cast<float>(p.z_m + share * (q.z_m - p.z_m)), e};
    }
  }
  for (std::size_t s = 0; s < strips; ++s)
    std::sort(crossings_.begin() + static_cast<std::ptrdiff_t>(first_[s]),
              crossings_.begin() + static_cast<std::ptrdiff_t>(first_[s + 1]),
              [](const RidgeCrossing& a, const RidgeCrossing& b) {
                return a.u_m < b.u_m || (a.u_m == b.u_m && a.edge < b.edge);
              });
  highest_.assign(first_highest(strips), -HUGE_VALF);
  for (std::size_t s = 0; s < strips; ++s)
    for (std::size_t i = first_[s]; i < first_[s + 1]; ++i) {
      float& highest = highest_[first_highest(s) + (i - first_[s]) / kCrossingsAtOnce];
      highest = std::max(highest, crossings_[i].z_m);
    }
}

std::size_t Ridges::strip_at(double v_m) const {
  const double strip = (v_m - low_v_m_) / width_m_ - static_cast<double>(first_strip_);
  return static_cast<std::size_t>(std::clamp(strip, 0.0, static_cast<double>(first_.size() - 2)));
}

std::span<const RidgeCrossing> Ridges::along(double v_m) const {
  const std::size_t s = strip_at(v_m);
  return {crossings_.data() + first_[s], first_[s + 1] - first_[s]};
}

std::span<const float> Ridges::highest_along(double v_m) const {
  const std::size_t s = strip_at(v_m), count = first_[s + 1] - first_[s];
  return {highest_.data() + first_highest(s), (count + kCrossingsAtOnce - 1) / kCrossingsAtOnce};
}

}  // namespace scarp
