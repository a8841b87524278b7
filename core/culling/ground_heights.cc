#include "core/culling/ground_heights.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace scarp {
namespace {

/// What of a polygon lies on one side of a line x = at or y = at.
void cut(std::vector<Position>& polygon, double Position::*c, double at_m, bool keeps_above,
         std::vector<Position>& kept) {
  kept.clear();
  const auto is_kept = [&](const Position& p) { return keeps_above ? p.*c >= at_m : p.*c <= at_m; };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Position &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    if (is_kept(p)) kept.push_back(p);
    if (is_kept(p) == is_kept(q)) continue;
    const double share = (at_m - p.*c) / (q.*c - p.*c);
    kept.push_back({p.x_m + share * (q.x_m - p.x_m), p.y_m + share * (q.y_m - p.y_m),
                    p.z_m + share * (q.z_m - p.z_m)});
  }
  polygon.swap(kept);
}

}  // namespace

GroundHeights::GroundHeights(const Tin& tin)
    : tin_(tin), bins_(tin.vertices, tin.triangles.size()) {
  bins_.fill(static_cast<std::uint32_t>(tin.triangles.size()),
             [&](std::uint32_t t) { return corners_of(t); });
}

std::optional<std::array<double, 2>> GroundHeights::over(const Bounds& rectangle) const {
  const auto& [low, high] = rectangle;
  const std::array<Position, 4> corners = {
      {{low.x_m, low.y_m}, {high.x_m, low.y_m}, {high.x_m, high.y_m}, {low.x_m, high.y_m}}};
  std::vector<std::uint32_t> found;
  bins_.find(corners, found);
  std::vector<Position> polygon, kept;
  double least_m = std::numeric_limits<double>::infinity(), greatest_m = -least_m;
  for (const std::uint32_t t : found) {
    const auto triangle = corners_of(t);
    polygon.assign(triangle.begin(), triangle.end());
    cut(polygon, &Position::x_m, low.x_m, true, kept);
    cut(polygon, &Position::x_m, high.x_m, false, kept);
    cut(polygon, &Position::y_m, low.y_m, true, kept);
    cut(polygon, &Position::y_m, high.y_m, false, kept);
    for (const Position& p : polygon) {
      least_m = std::min(least_m, p.z_m);
      greatest_m = std::max(greatest_m, p.z_m);
    }
  }
  if (least_m > greatest_m) return std::nullopt;
  return std::array{least_m, greatest_m};
}

}  // namespace scarp
