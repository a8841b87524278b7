#include "core/culling/drawn_outline.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

namespace scarp {
namespace {

/// Widths and heights are those of a picture at distance 1 whose up is plumb: a pixel is about
/// 1/1000 of them.

/// Narrower segments raise nothing: their slopes are made of rounding.
constexpr double kNarrowest = 0x1p-20;
/// What is nearer to the outline than this may be seen. Pictures round corners to 1/256 of a pixel,
/// of which this is a fortieth where the picture is 480 pixels high and 45 degrees wide; the
/// rounding of pieces as wide as kNarrowest is a millionth of it.
constexpr double kUnder = 0x1p-14;
/// Segments that lead higher or lower are steeper than any picture shows.
constexpr double kGreatest = 0x1p6;

/// A corner as the eye sees it.
struct SeenCorner {
  UpperOutline::Point at;
  double forward_m;  ///< along the horizontal part of the view
  double along_m;    ///< along the view
};

/// A frame at the eye whose up is plumb.
class PlumbFrame {
 public:
  explicit PlumbFrame(const View& view)
      : eye_(view.eye),
        look_{view.target.x_m - view.eye.x_m, view.target.y_m - view.eye.y_m,
              view.target.z_m - view.eye.z_m} {
    const double level_m = std::hypot(look_.x_m, look_.y_m);
    const double length_m = std::hypot(level_m, look_.z_m);
    look_ = {look_.x_m / length_m, look_.y_m / length_m, look_.z_m / length_m};
    // Straight down any direction will do: what is behind the eye is left as it is.
    if (level_m > 0) forward_ = {look_.x_m * length_m / level_m, look_.y_m * length_m / level_m, 0};
  }

  SeenCorner see(const Position& p) const {
    const double x_m = p.x_m - eye_.x_m, y_m = p.y_m - eye_.y_m, z_m = p.z_m - eye_.z_m;
    const double forward_m = x_m * forward_.x_m + y_m * forward_.y_m;
    const double right_m = x_m * forward_.y_m - y_m * forward_.x_m;
    return {{right_m / forward_m, z_m / forward_m},
            forward_m,
            x_m * look_.x_m + y_m * look_.y_m + z_m * look_.z_m};
  }

 private:
  Position eye_, look_, forward_{0, 1, 0};
};

struct Edge {
  double farthest_m;
  UpperOutline::Point a, b;

  friend bool operator<(const Edge& one, const Edge& other) {
    return one.farthest_m > other.farthest_m;  // the nearest is on top of a queue
  }
};

bool is_before_eye(const SeenCorner& corner, double near_m) {
  return corner.forward_m > 0 && corner.along_m > near_m && std::abs(corner.at.x) < kGreatest &&
         std::abs(corner.at.y) < kGreatest;
}

/// Seen from below: its corners turn the other way, and it is wider than what rounding may turn.
/// Where an edge lies in a plumb plane with the eye, it may be a border with nothing before it.
bool faces_away(const std::array<SeenCorner, 3>& corners) {
  const auto& [a, b, c] = corners;
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double dx = corners[(i + 1) % 3].at.x - corners[i].at.x;
    const double dy = corners[(i + 1) % 3].at.y - corners[i].at.y;
    if (std::abs(dx) < kUnder) return false;
    longest = std::max(longest, std::hypot(dx, dy));
  }
  const double twice_area =
      (b.at.x - a.at.x) * (c.at.y - a.at.y) - (b.at.y - a.at.y) * (c.at.x - a.at.x);
  return twice_area < -2 * kUnder * longest;
}

}  // namespace

void UpperOutline::keep(std::vector<Piece>& out, const Piece& piece, double from, double to) const {
  if (!(from < to)) return;
  if (!out.empty() && out.back().to == from && out.back().x0 == piece.x0 &&
      out.back().y0 == piece.y0 && out.back().slope == piece.slope) {
    out.back().to = to;
    return;
  }
  out.push_back(piece);
  out.back().from = from;
  out.back().to = to;
}

void UpperOutline::keep_higher(std::vector<Piece>& out, const Piece& a, const Piece& b, double from,
                               double to) const {
  const double at_from = a.at(from) - b.at(from), at_to = a.at(to) - b.at(to);
  if ((at_from >= 0) == (at_to >= 0)) return keep(out, at_from >= 0 ? a : b, from, to);
  const double cross = std::clamp(from + (to - from) * at_from / (at_from - at_to), from, to);
  keep(out, at_from >= 0 ? a : b, from, cross);
  keep(out, at_from >= 0 ? b : a, cross, to);
}

void UpperOutline::raise(Point a, Point b) {
  if (a.x > b.x) std::swap(a, b);
  if (b.x - a.x < kNarrowest) return;
  const Piece segment{a.x, b.x, a.x, a.y, (b.y - a.y) / (b.x - a.x)};
  const auto first = std::partition_point(pieces_.begin(), pieces_.end(),
                                          [&](const Piece& p) { return p.to <= a.x; });
  raised_.clear();
  double at = a.x;
  auto piece = first;
  for (; piece != pieces_.end() && piece->from < b.x; ++piece) {
    keep(raised_, *piece, piece->from, std::min(at, piece->to));
    keep(raised_, segment, at, piece->from);
    at = std::max(at, piece->from);
    const double end = std::min(piece->to, b.x);
    keep_higher(raised_, segment, *piece, at, end);
    keep(raised_, *piece, end, piece->to);
    at = end;
  }
  keep(raised_, segment, at, b.x);
  const auto met = static_cast<std::size_t>(piece - first);
  const auto place = first - pieces_.begin();
  const std::size_t over = std::min(met, raised_.size());
  std::copy_n(raised_.begin(), over, first);
  if (met > over)
    pieces_.erase(pieces_.begin() + place + static_cast<std::ptrdiff_t>(over),
                  pieces_.begin() + place + static_cast<std::ptrdiff_t>(met));
  else
    pieces_.insert(pieces_.begin() + place + static_cast<std::ptrdiff_t>(over),
                   raised_.begin() + static_cast<std::ptrdiff_t>(over), raised_.end());
}

bool UpperOutline::covers(Point a, Point b) const {
  if (a.x > b.x) std::swap(a, b);
  double slope = (b.y - a.y) / (b.x - a.x);
  if (b.x - a.x < kNarrowest) {
    a.y = std::max(a.y, b.y);
    slope = 0;
  }
  // Corners may be rounded sideways too.
  const double begin = a.x - kUnder, end = b.x + kUnder;
  auto piece = std::partition_point(pieces_.begin(), pieces_.end(),
                                    [&](const Piece& p) { return p.to < begin; });
  double at = begin;
  for (; piece != pieces_.end() && piece->from <= at; ++piece) {
    const double to = std::min(piece->to, end);
    const double under = kUnder * (1 + std::abs(slope) + std::abs(piece->slope));
    for (const double x : {at, to})
      if (a.y + slope * (std::clamp(x, a.x, b.x) - a.x) + under >= piece->at(x)) return false;
    if (to == end) return true;
    at = to;
  }
  return false;
}

std::vector<std::uint8_t> over_outline(const Shot& shot, std::span<const Position> vertices,
                                       std::span<const std::array<VertexIndex, 3>> triangles) {
  const PlumbFrame frame(shot.view);
  std::vector<std::array<SeenCorner, 3>> corners;
  std::vector<double> nearest_m;
  for (const auto& triangle : triangles) {
    auto& seen = corners.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) seen[i] = frame.see(vertices[triangle[i]]);
    nearest_m.push_back(std::min({seen[0].forward_m, seen[1].forward_m, seen[2].forward_m}));
  }
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return nearest_m[a] != nearest_m[b] ? nearest_m[a] < nearest_m[b] : a < b;
  });

  std::vector<std::uint8_t> may_be_seen(triangles.size(), 1);
  UpperOutline outline;
  std::priority_queue<Edge> edges;
  for (const std::uint32_t t : order) {
    for (; !edges.empty() && edges.top().farthest_m <= nearest_m[t]; edges.pop())
      outline.raise(edges.top().a, edges.top().b);
    const auto& seen = corners[t];
    std::array<bool, 3> is_before{};
    for (std::size_t i = 0; i < 3; ++i) is_before[i] = is_before_eye(seen[i], shot.view.near_m);
    if (is_before[0] && is_before[1] && is_before[2])
      may_be_seen[t] = !faces_away(seen) && !(outline.covers(seen[0].at, seen[1].at) &&
                                              outline.covers(seen[1].at, seen[2].at) &&
                                              outline.covers(seen[2].at, seen[0].at));
    if (!may_be_seen[t]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      if (is_before[i] && is_before[j])
        edges.push({std::max(seen[i].forward_m, seen[j].forward_m), seen[i].at, seen[j].at});
    }
  }
  return may_be_seen;
}

}  // namespace scarp
