#include "core/raster/occlusion_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Relative allowance for the rounding of depths to float and of their planes.
constexpr double kDepthRounding = 0x1p-20;

/// Half a pixel, and what is added around it.
constexpr double kReachPx = 0.5 + kEdgeMarginPx;

/// Calls visit(pixel index, x, y of its centre) for the pixels of a box, clipped to the map.
template <class Visit>
void for_pixels(const OcclusionMap& map, double left_px, double top_px, double right_px,
                double bottom_px, Visit visit) {
  const auto first = [](double px, int size) {
    return static_cast<int>(std::floor(std::clamp(px, -1.0, static_cast<double>(size))));
  };
  const int left = std::max(0, first(left_px, map.width_px));
  const int right = std::min(map.width_px - 1, first(right_px, map.width_px));
  const int top = std::max(0, first(top_px, map.height_px));
  const int bottom = std::min(map.height_px - 1, first(bottom_px, map.height_px));
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x)
      visit(static_cast<std::uint32_t>(y * map.width_px + x), x + 0.5, y + 0.5);
}

/// Twice the area that the edge a -> b spans with a point, and how much it changes over kReachPx.
struct EdgeSide {
  double x_px, y_px, dx_px, dy_px, slack;

  EdgeSide(double ax, double ay, double bx, double by)
      : x_px(ax),
        y_px(ay),
        dx_px(bx - ax),
        dy_px(by - ay),
        slack((std::abs(dx_px) + std::abs(dy_px)) * kReachPx) {}

  double at(double x, double y) const { return dx_px * (y - y_px) - dy_px * (x - x_px); }
};

float rounded_down(double depth) {
  return static_cast<float>(depth * (1 - kDepthRounding));
}
float rounded_up(double depth) {
  return static_cast<float>(depth * (1 + kDepthRounding));
}

/// Share of the way from a to b at which the near plane (z = w) is met.
double share_at_near(const ClipPosition& a, const ClipPosition& b) {
  return (a.w - a.z) / ((a.w - a.z) - (b.w - b.z));
}

ClipPosition between(const ClipPosition& a, const ClipPosition& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.z + share * (b.z - a.z),
          a.w + share * (b.w - a.w)};
}

}  // namespace

/// Which way round a triangle is seen: the sign of the volume that its corners span with the eye,
/// so that parts before the near plane turn as the rest does.
int OcclusionMapper::turn_of(TriangleIndex triangle) const {
  const auto& [a, b, c] = tin_.triangles[triangle];
  const ClipPosition p = projection_.project(tin_.vertices[a]);
  const ClipPosition q = projection_.project(tin_.vertices[b]);
  const ClipPosition r = projection_.project(tin_.vertices[c]);
  const double volume =
      p.x * (q.y * r.w - q.w * r.y) - p.y * (q.x * r.w - q.w * r.x) + p.w * (q.x * r.y - q.y * r.x);
  return volume > 0 ? 1 : volume < 0 ? -1 : 0;
}

/// Draws one triangle, in two parts where the near plane cuts off a corner.
void OcclusionMapper::add(TriangleIndex triangle, const OcclusionMap& map) {
  std::array<ClipPosition, 3> p;
  std::array<bool, 3> is_end;  // opposite to the corner
  const int turn = turn_of(triangle);
  int inside = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = projection_.project(tin_.vertices[tin_.triangles[triangle][i]]);
    inside += p[i].z <= p[i].w;
    const TriangleIndex beyond = tin_.neighbours[triangle][i];
    is_end[i] = beyond == kNone || !is_drawn_[beyond] || turn == 0 || turn_of(beyond) != turn;
  }
  const auto draw_part = [&](const std::array<ClipPosition, 3>& corners,
                             const std::array<bool, 3>& ends) {
    ScreenTriangle part;
    for (std::size_t i = 0; i < 3; ++i) {
      part.x_px[i] = (corners[i].x / corners[i].w + 1) * map.width_px / 2;
      part.y_px[i] = (1 - corners[i].y / corners[i].w) * map.height_px / 2;
      part.depth[i] = corners[i].z / corners[i].w;
    }
    part.is_end = ends;
    touch_pixels(part, turn, map);
  };
  if (inside == 3) return draw_part(p, is_end);
  if (inside == 0) return;
  // The corner that is alone on its side of the plane comes first.
  std::size_t alone = 0;
  while ((p[alone].z <= p[alone].w) != (inside == 1)) ++alone;
  const std::size_t next = (alone + 1) % 3, last = (alone + 2) % 3;
  const ClipPosition to_next = between(p[alone], p[next], share_at_near(p[alone], p[next]));
  const ClipPosition to_last = between(p[alone], p[last], share_at_near(p[alone], p[last]));
  if (inside == 1) {
    draw_part({p[alone], to_next, to_last}, {true, is_end[next], is_end[last]});
  } else {
    draw_part({to_next, p[next], p[last]}, {is_end[alone], false, is_end[last]});
    draw_part({to_next, p[last], to_last}, {is_end[next], true, false});
  }
}

void OcclusionMapper::touch_pixels(const ScreenTriangle& s, int turn, const OcclusionMap& map) {
  for (std::size_t i = 0; i < 3; ++i)
    if (s.is_end[i]) touch_end(s, i, map);
  const double x1 = s.x_px[1] - s.x_px[0], y1 = s.y_px[1] - s.y_px[0];
  const double x2 = s.x_px[2] - s.x_px[0], y2 = s.y_px[2] - s.y_px[0];
  const double twice_area = x1 * y2 - x2 * y1;
  // What is seen edge-on covers nothing, and all that it touches ends there.
  if (turn == 0 || twice_area == 0) return;
  const double z1 = s.depth[1] - s.depth[0], z2 = s.depth[2] - s.depth[0];
  const double depth_per_x = (z1 * y2 - z2 * y1) / twice_area;
  const double depth_per_y = (z2 * x1 - z1 * x2) / twice_area;
  const double reach = (std::abs(depth_per_x) + std::abs(depth_per_y)) * kReachPx;
  const auto [lowest, greatest] = std::minmax({s.depth[0], s.depth[1], s.depth[2]});
  const auto [left, right] = std::minmax({s.x_px[0], s.x_px[1], s.x_px[2]});
  const auto [top, bottom] = std::minmax({s.y_px[0], s.y_px[1], s.y_px[2]});
  const double sign = twice_area < 0 ? -1 : 1;
  const EdgeSide sides[3] = {{s.x_px[0], s.y_px[0], s.x_px[1], s.y_px[1]},
                             {s.x_px[1], s.y_px[1], s.x_px[2], s.y_px[2]},
                             {s.x_px[2], s.y_px[2], s.x_px[0], s.y_px[0]}};
  for_pixels(map, left - kEdgeMarginPx, top - kEdgeMarginPx, right + kEdgeMarginPx,
             bottom + kEdgeMarginPx, [&](std::uint32_t pixel, double x, double y) {
               bool is_at_centre = true;
               for (const EdgeSide& side : sides) {
                 const double at = side.at(x, y) * sign;
                 if (at < -side.slack) return;
                 is_at_centre &= at >= 0;
               }
               const double middle =
                   s.depth[0] + depth_per_x * (x - s.x_px[0]) + depth_per_y * (y - s.y_px[0]);
               const float low = rounded_down(std::max(lowest, middle - reach));
               const float high = rounded_up(std::min(greatest, middle + reach));
               // At other depths than the triangle, its plane runs beside it here.
               if (low > high) return;
               touches_.push_back({pixel, low, high, is_at_centre, false});
             });
}

void OcclusionMapper::touch_end(const ScreenTriangle& s, std::size_t corner,
                                const OcclusionMap& map) {
  const std::size_t a = (corner + 1) % 3, b = (corner + 2) % 3;
  const EdgeSide side(s.x_px[a], s.y_px[a], s.x_px[b], s.y_px[b]);
  const auto [lowest, greatest] = std::minmax(s.depth[a], s.depth[b]);
  const float low = rounded_down(lowest), high = rounded_up(greatest);
  const auto [left, right] = std::minmax(s.x_px[a], s.x_px[b]);
  const auto [top, bottom] = std::minmax(s.y_px[a], s.y_px[b]);
  for_pixels(map, left - kEdgeMarginPx, top - kEdgeMarginPx, right + kEdgeMarginPx,
             bottom + kEdgeMarginPx, [&](std::uint32_t pixel, double x, double y) {
               if (std::abs(side.at(x, y)) <= side.slack)
                 touches_.push_back({pixel, low, high, false, true});
             });
}

void OcclusionMapper::draw(const Projection& projection, std::span<const TriangleIndex> occluders,
                           OcclusionMap& map) {
  assert(map.width_px > 0 && map.height_px > 0);
  projection_ = projection;
  for (const TriangleIndex t : occluders) is_drawn_[t] = 1;
  touches_.clear();
  for (const TriangleIndex t : occluders) add(t, map);
  for (const TriangleIndex t : occluders) is_drawn_[t] = 0;

  const std::size_t pixels =
      static_cast<std::size_t>(map.width_px) * static_cast<std::size_t>(map.height_px);
  first_.assign(pixels + 1, 0);
  for (const Touch& touch : touches_) ++first_[touch.pixel + 1];
  for (std::size_t i = 0; i < pixels; ++i) first_[i + 1] += first_[i];
  by_pixel_.resize(touches_.size());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (const Touch& touch : touches_) by_pixel_[next[touch.pixel]++] = touch;

  map.depth.assign(pixels, 0);
  parallel_for(static_cast<std::size_t>(map.height_px), [&](std::size_t row) {
    for (std::size_t pixel = row * static_cast<std::size_t>(map.width_px);
         pixel < (row + 1) * static_cast<std::size_t>(map.width_px); ++pixel) {
      const auto begin = by_pixel_.begin() + first_[pixel];
      const auto end = by_pixel_.begin() + first_[pixel + 1];
      std::sort(begin, end, [](const Touch& a, const Touch& b) { return a.high > b.high; });
      for (auto at = begin; at != end;) {
        float low = at->low;
        bool covers = false, ends = false;
        for (; at != end && at->high >= low; ++at) {
          low = std::min(low, at->low);
          covers |= at->is_at_centre;
          ends |= at->is_end;
        }
        if (!covers || ends) continue;
        map.depth[pixel] = std::max(0.0F, low);
        break;
      }
    }
  });
}

}  // namespace scarp
