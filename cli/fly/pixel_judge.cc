#include "cli/fly/pixel_judge.h"

#include <algorithm>
#include <cmath>

#include "core/sight/line_of_sight.h"

namespace scarp {
namespace {

Position minus(const Position& a, const Position& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
}

/// Where a line meets the plane of a triangle, as a multiple of its direction; NaN or infinite
/// where it runs along it.
double meets_plane_at(const Tin& tin, TriangleIndex t, const Position& eye,
                      const Position& direction) {
  const auto& [a, b, c] = tin.triangles[t];
  const Position u = minus(tin.vertices[b], tin.vertices[a]);
  const Position v = minus(tin.vertices[c], tin.vertices[a]);
  const Position normal{u.y_m * v.z_m - u.z_m * v.y_m, u.z_m * v.x_m - u.x_m * v.z_m,
                        u.x_m * v.y_m - u.y_m * v.x_m};
  const auto along = [&](const Position& p) {
    return normal.x_m * p.x_m + normal.y_m * p.y_m + normal.z_m * p.z_m;
  };
  return along(minus(tin.vertices[a], eye)) / along(direction);
}

Position ray_at(const Projection& projection, const Target& target, int x_px, int y_px) {
  return ray_through(projection, (2 * x_px + 1.0) / target.width_px - 1,
                     1 - (2 * y_px + 1.0) / target.height_px);
}

Position along_ray(const Position& eye, const Position& ray, double far) {
  return {eye.x_m + far * ray.x_m, eye.y_m + far * ray.y_m, eye.z_m + far * ray.z_m};
}

bool is_in_reach(const Position& p) {
  return std::max({std::abs(p.x_m), std::abs(p.y_m), std::abs(p.z_m)}) < kLatticeReachM;
}

}  // namespace

void PixelJudge::set_present(std::span<const std::uint8_t> is_there) {
  const Tin& tin = whole_.tin();
  rest_ = {};
  rest_.tin.vertices = tin.vertices;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    if (!is_there[t]) continue;
    rest_.tin.triangles.push_back(tin.triangles[t]);
    rest_.number.push_back(t);
  }
  connect_neighbours(rest_.tin);
  rest_.index = std::make_unique<TinIndex>(rest_.tin);
  index_ = rest_.index.get();
}

bool PixelJudge::is_wrong(const Position& eye, const Projection& projection, const Target& target,
                          int x_px, int y_px, TriangleIndex triangle,
                          std::span<const std::uint8_t> is_drawn) const {
  const Position ray = ray_at(projection, target, x_px, y_px);
  const double far = meets_plane_at(whole_.tin(), triangle, eye, ray);
  if (!(far > 0) || !std::isfinite(far)) return false;
  Position end = along_ray(eye, ray, far);
  if (!is_in_reach(end)) return false;
  end = round_to_lattice(end);
  // Rounding may have put it beside the triangle: then it is judged as the ground it is over.
  TriangleIndex under = index_->triangle_at(end.x_m, end.y_m);
  if (under == kNone) return false;
  if (rest_.index) under = rest_.number[under];
  if (is_drawn[under]) return false;
  const auto height_m = index_->ground_height_m(end.x_m, end.y_m);
  end.z_m = round_to_lattice(*height_m);
  while (*index_->above_ground(end) < 0) end.z_m += kLatticeStepM;
  return !is_blocked(*index_, eye, end);
}

bool PixelJudge::is_box_wrong(const Position& eye, const Projection& projection,
                              const Target& target, int x_px, int y_px, const Bounds& box) const {
  const Position ray = ray_at(projection, target, x_px, y_px);
  double first = 0, last = HUGE_VAL;
  for (double Position::*c : {&Position::x_m, &Position::y_m, &Position::z_m}) {
    const double a = (box.low.*c - eye.*c) / ray.*c, b = (box.high.*c - eye.*c) / ray.*c;
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  if (!(first <= last)) return false;
  const Position end = along_ray(eye, ray, first);
  return is_in_reach(end) && !is_blocked(*index_, eye, round_to_lattice(end));
}

}  // namespace scarp
