#include "core/sight/triangle_walk.h"

#include "core/geodesy/predicates.h"

namespace scarp {

double height_in_plane_m(const Tin& tin, TriangleIndex triangle, double x_m, double y_m) {
  const Position& a = tin.vertices[tin.triangles[triangle][0]];
  const Position& b = tin.vertices[tin.triangles[triangle][1]];
  const Position& c = tin.vertices[tin.triangles[triangle][2]];
  const double bx = b.x_m - a.x_m, by = b.y_m - a.y_m, cx = c.x_m - a.x_m, cy = c.y_m - a.y_m;
  const double px = x_m - a.x_m, py = y_m - a.y_m;
  const double area = bx * cy - by * cx;
  const double towards_b = (px * cy - py * cx) / area, towards_c = (bx * py - by * px) / area;
  return a.z_m + towards_b * (b.z_m - a.z_m) + towards_c * (c.z_m - a.z_m);
}

bool TriangleWalk::stays(double x_m, double y_m) const {
  if (last_ == kNone) return false;
  const Tin& tin = index_.tin();
  const auto& [a, b, c] = tin.triangles[last_];
  const Position p{x_m, y_m, 0};
  return orient2d(tin.vertices[a], tin.vertices[b], p) > 0 &&
         orient2d(tin.vertices[b], tin.vertices[c], p) > 0 &&
         orient2d(tin.vertices[c], tin.vertices[a], p) > 0;
}

int TriangleWalk::side_of_plane(TriangleIndex triangle, const Position& p) const {
  const Tin& tin = index_.tin();
  const auto& [a, b, c] = tin.triangles[triangle];
  return orient3d(tin.vertices[a], tin.vertices[b], tin.vertices[c], p);
}

TriangleIndex TriangleWalk::triangle_at(double x_m, double y_m) {
  if (!stays(x_m, y_m)) last_ = index_.triangle_at(x_m, y_m);
  return last_;
}

std::optional<double> TriangleWalk::ground_height_m(double x_m, double y_m) {
  const TriangleIndex t = triangle_at(x_m, y_m);
  if (t == kNone) return {};
  return height_in_plane_m(index_.tin(), t, x_m, y_m);
}

std::optional<int> TriangleWalk::above_ground(const Position& p) {
  const TriangleIndex t = triangle_at(p.x_m, p.y_m);
  if (t == kNone) return {};
  return side_of_plane(t, p);
}

bool TriangleWalk::stands_clear(const Position& p) {
  if (stays(p.x_m, p.y_m)) return side_of_plane(last_, p) >= 0;
  last_ = kNone;
  bool is_under = false;
  index_.visit_triangles_at(p.x_m, p.y_m, [&](TriangleIndex t) {
    if (last_ == kNone) last_ = t;
    is_under |= side_of_plane(t, p) < 0;
  });
  return last_ != kNone && !is_under;
}

}  // namespace scarp
