#include "core/occlusion/edge_correction.h"

#include <algorithm>
#include <cmath>

namespace scarp {
namespace {

struct Vector {
  double x, y, z;
};

Vector operator-(const Position& a, const Position& b) {
  return {a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
}

Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

Vector unit(const Vector& v) {
  const double length = std::sqrt(dot(v, v));
  return {v.x / length, v.y / length, v.z / length};
}

Position moved(const Position& p, const Vector& by, double metres) {
  return {p.x_m + metres * by.x, p.y_m + metres * by.y, p.z_m + metres * by.z};
}

/// Positive where d is on the side of the plane through a, b, c that a counter-clockwise triangle
/// has above it.
double side(const Position& a, const Position& b, const Position& c, const Position& d) {
  return dot(cross(b - a, c - a), d - a);
}

Vector normal_of(const Tin& tin, TriangleIndex t) {
  const auto& [a, b, c] = tin.triangles[t];
  return unit(cross(tin.vertices[b] - tin.vertices[a], tin.vertices[c] - tin.vertices[a]));
}

/// How far an edge stands out of the surface along its normal, at the edges of the surface that its
/// plane cuts.
double error_m(const TinIndex& surface, const Position& a, const Position& b, const Vector& normal,
               double reach_m) {
  const Vector along = b - a;
  const double length2 = dot(along, along);
  const Vector across = cross(along, normal);
  const std::array<Position, 4> hull = {a, b, moved(a, normal, -reach_m),
                                        moved(b, normal, -reach_m)};
  double error = 0;
  surface.visit_edges(hull, HeightFloor(), [&](std::uint32_t e) {
    const MeshEdge& edge = surface.edges()[e];
    const Position &p = surface.tin().vertices[edge.from], &q = surface.tin().vertices[edge.to];
    const double p_side = dot(across, p - a), q_side = dot(across, q - a);
    if (p_side * q_side > 0 || p_side == q_side) return false;
    const Position cut = moved(p, q - p, p_side / (p_side - q_side));
    const double share = dot(cut - a, along) / length2;
    if (share > 0 && share < 1) error = std::max(error, -dot(cut - a, normal));
    return false;
  });
  return std::min(error, reach_m);
}

}  // namespace

std::vector<CorrectedTriangle> correct_edges(const Tin& simplified, const TinIndex& surface,
                                             double reach_m) {
  std::vector<CorrectedTriangle> corrected;
  for (TriangleIndex t = 0; t < simplified.triangles.size(); ++t) {
    CorrectedTriangle occluder;
    for (std::size_t i = 0; i < 3; ++i)
      occluder.corners[i] = simplified.vertices[simplified.triangles[t][i]];
    for (std::size_t i = 0; i < 3; ++i) {
      const Position &a = occluder.corners[i], &b = occluder.corners[(i + 1) % 3];
      const TriangleIndex other = simplified.neighbours[t][(i + 2) % 3];
      Vector normal = normal_of(simplified, t);
      if (other != kNone) {
        const Vector beside = normal_of(simplified, other);
        normal = unit({normal.x + beside.x, normal.y + beside.y, normal.z + beside.z});
      }
      // What is left of `normal` at a right angle to the edge is normal itself: both triangles hold
      // the edge.
      const double by_m = -error_m(surface, a, b, normal, reach_m);
      occluder.edges[i] = {moved(a, normal, by_m), moved(b, normal, by_m)};
    }
    corrected.push_back(occluder);
  }
  return corrected;
}

bool claims_to_hide(const CorrectedTriangle& occluder, const Position& eye, const Bounds& targets) {
  const auto& [a, b, c] = occluder.corners;
  if (!(side(a, b, c, eye) > 0)) return false;
  for (unsigned k = 0; k < 8; ++k) {
    const Position target = {(k & 1) != 0 ? targets.high.x_m : targets.low.x_m,
                             (k & 2) != 0 ? targets.high.y_m : targets.low.y_m,
                             (k & 4) != 0 ? targets.high.z_m : targets.low.z_m};
    if (!(side(a, b, c, target) < 0)) return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& [from, to] = occluder.edges[i];
      // From an eye above a counter-clockwise triangle, its inside is left of each edge.
      if (!(side(from, to, eye, target) < 0)) return false;
    }
  }
  return true;
}

}  // namespace scarp
