#include "cli/fly/frame_picture.h"

#include <algorithm>
#include <cmath>

namespace scarp {
namespace {

constexpr Rgb kSky = {0.80, 0.87, 0.94};
constexpr Rgb kMover = {0.10, 0.10, 0.12};
constexpr int kMarkReachPx = 1;

/// Light from the north-west, 45 degrees high.
double light_on(const Tin& tin, TriangleIndex t) {
  const auto& [a, b, c] = tin.triangles[t];
  const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
  const double ux = q.x_m - p.x_m, uy = q.y_m - p.y_m, uz = q.z_m - p.z_m;
  const double vx = r.x_m - p.x_m, vy = r.y_m - p.y_m, vz = r.z_m - p.z_m;
  const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
  const double along =
      (-0.5 * nx + 0.5 * ny + std::sqrt(0.5) * nz) / std::sqrt(nx * nx + ny * ny + nz * nz);
  return 0.35 + 0.65 * std::max(0.0, along);
}

}  // namespace

Picture frame_picture(const Tin& tin, const Groups& groups, const Target& whole,
                      const Target& drawn) {
  Picture picture{drawn.width_px, drawn.height_px, {}};
  const auto paint = [&](std::size_t pixel, const Rgb& colour, double light) {
    const auto byte = [&](double value) {
      return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value * light, 0.0, 1.0)));
    };
    picture.rgb[3 * pixel] = byte(colour.r);
    picture.rgb[3 * pixel + 1] = byte(colour.g);
    picture.rgb[3 * pixel + 2] = byte(colour.b);
  };
  picture.rgb.resize(3 * drawn.object.size());
  for (std::size_t i = 0; i < drawn.object.size(); ++i) {
    const std::uint32_t triangle = drawn.object[i];
    if (triangle == kNone) {
      paint(i, kSky, 1);
      continue;
    }
    if (triangle >= tin.triangles.size()) {
      paint(i, kMover, 1);
      continue;
    }
    const GroupIndex group = groups.group_of_triangle[triangle];
    paint(i, group == kNone ? kOrphan : group_colour(group), light_on(tin, triangle));
  }
  for (int y = 0; y < drawn.height_px; ++y)
    for (int x = 0; x < drawn.width_px; ++x) {
      if (whole.object[whole.index(x, y)] == drawn.object[drawn.index(x, y)]) continue;
      for (int ny = std::max(0, y - kMarkReachPx);
           ny <= std::min(drawn.height_px - 1, y + kMarkReachPx); ++ny)
        for (int nx = std::max(0, x - kMarkReachPx);
             nx <= std::min(drawn.width_px - 1, x + kMarkReachPx); ++nx)
          paint(drawn.index(nx, ny), kMark, 1);
    }
  return picture;
}

}  // namespace scarp
