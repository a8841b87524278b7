#include "tests/judge/sight_twin.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <functional>
#include <random>
#include <vector>

namespace scarp::test {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Rational = CGAL::Exact_rational;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;

/// A point or vector with exact coordinates.
struct Exact {
  Rational x, y, z;
};
Exact exact(const Position& p) {
  return {p.x_m, p.y_m, p.z_m};
}
Exact operator-(const Exact& a, const Exact& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Rational turn(const Exact& a, const Exact& b) {
  return a.x * b.y - a.y * b.x;
}
Rational turn(const Exact& a, const Exact& b, const Exact& c) {
  return turn(b - a, c - a);
}

/// How far p lies above the plane of a, b, c, vertically.
Rational height_above(const Exact& a, const Exact& b, const Exact& c, const Exact& p) {
  const Exact u = b - a, v = c - a, w = p - a;
  return w.z - (turn(w, v) * u.z + turn(u, w) * v.z) / turn(u, v);
}

/// The corners of a convex polygon in plan, counter-clockwise; z is on the plane of the triangle.
using Polygon = std::vector<Exact>;

Rational doubled_area(const Polygon& polygon) {
  Rational area = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    area += turn(polygon[0], polygon[i - 1], polygon[i]);
  return area;
}

/// The part where the linear function, given at the corners, has the given sign or is zero.
Polygon clipped(const Polygon& polygon, const std::vector<Rational>& values, int sign) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t k = (i + 1) % polygon.size();
    const Rational here = sign * values[i], next = sign * values[k];
    if (here >= 0) kept.push_back(polygon[i]);
    if ((here > 0 && next < 0) || (here < 0 && next > 0)) {
      const Rational share = here / (here - next);
      const Exact step = polygon[k] - polygon[i];
      kept.push_back({polygon[i].x + share * step.x, polygon[i].y + share * step.y,
                      polygon[i].z + share * step.z});
    }
  }
  return kept;
}

/// Takes a shadow, the places where all the functions are at least zero, from pieces of `whole`.
template <class Functions>
void subtract(const Polygon& whole, std::vector<Polygon>& pieces, const Functions& functions) {
  for (const auto& function : functions)
    if (std::all_of(whole.begin(), whole.end(), [&](const Exact& q) { return function(q) <= 0; }))
      return;
  std::vector<Polygon> rest;
  for (Polygon& piece : pieces) {
    for (const auto& function : functions) {
      if (piece.empty()) break;
      std::vector<Rational> values;
      for (const Exact& q : piece) values.push_back(function(q));
      Polygon outside = clipped(piece, values, -1);
      if (outside.size() > 2 && doubled_area(outside) > 0) rest.push_back(std::move(outside));
      piece = clipped(piece, values, +1);
      if (piece.size() < 3 || doubled_area(piece) == 0) piece.clear();
    }
  }
  pieces.swap(rest);
}

}  // namespace

struct SightTwin::Tree {
  Triangles triangles;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;
  double top_m = 0;
};

SightTwin::SightTwin(const Tin& tin) : tin_(tin), tree_(std::make_unique<Tree>()) {
  const auto point = [&](VertexIndex v) {
    const Position& p = tin.vertices[v];
    tree_->top_m = std::max(tree_->top_m, p.z_m + 1);
    return Kernel::Point_3(p.x_m, p.y_m, p.z_m);
  };
  for (const auto& [a, b, c] : tin.triangles)
    tree_->triangles.emplace_back(point(a), point(b), point(c));
  tree_->tree.insert(tree_->triangles.cbegin(), tree_->triangles.cend());
  tree_->tree.build();
}

SightTwin::~SightTwin() = default;

namespace {

/// Whether the open segment a-b runs strictly under the closed triangle p, q, r. Along the segment,
/// with s in [0, 1], all conditions are linear in s.
bool runs_under(const Exact& a, const Exact& b, const Exact& p, const Exact& q, const Exact& r) {
  Rational first = 0, last = 1;
  for (const auto& [u, v] : {std::pair(p, q), std::pair(q, r), std::pair(r, p)}) {
    const Rational at_a = turn(u, v, a), at_b = turn(u, v, b);
    if (at_a < 0 && at_b < 0) return false;
    if (at_a < 0) first = std::max<Rational>(first, at_a / (at_a - at_b));
    if (at_b < 0) last = std::min<Rational>(last, at_a / (at_a - at_b));
  }
  if (first > last || (first == last && (first == 0 || last == 1))) return false;
  const Rational a_above = height_above(p, q, r, a), b_above = height_above(p, q, r, b);
  const auto above = [&](const Rational& s) -> Rational {
    return a_above + s * (b_above - a_above);
  };
  return above(first) < 0 || above(last) < 0;
}

}  // namespace

bool SightTwin::is_blocked(const Position& a, const Position& b) const {
  const Kernel::Point_3 low_a(a.x_m, a.y_m, a.z_m), low_b(b.x_m, b.y_m, b.z_m);
  const double top_m = std::max({tree_->top_m, a.z_m + 1, b.z_m + 1});
  const Kernel::Point_3 high_a(a.x_m, a.y_m, top_m), high_b(b.x_m, b.y_m, top_m);
  std::vector<Triangles::const_iterator> met;
  if (a.x_m == b.x_m && a.y_m == b.y_m) {
    const Kernel::Point_3& low = a.z_m < b.z_m ? low_a : low_b;
    tree_->tree.all_intersected_primitives(Kernel::Segment_3(low, high_a), std::back_inserter(met));
  } else {
    tree_->tree.all_intersected_primitives(Kernel::Triangle_3(low_a, low_b, high_a),
                                           std::back_inserter(met));
    tree_->tree.all_intersected_primitives(Kernel::Triangle_3(low_b, high_b, high_a),
                                           std::back_inserter(met));
  }
  const Exact from = exact(a), to = exact(b);
  for (const auto& triangle : met) {
    const auto& [p, q, r] =
        tin_.triangles[static_cast<std::size_t>(triangle - tree_->triangles.cbegin())];
    if (runs_under(from, to, exact(tin_.vertices[p]), exact(tin_.vertices[q]),
                   exact(tin_.vertices[r])))
      return true;
  }
  return false;
}

std::optional<bool> SightTwin::is_hidden(const Position& eye, TriangleIndex triangle) const {
  const Exact c = exact(eye);
  const auto corner = [&](TriangleIndex t, std::size_t i) {
    return exact(tin_.vertices[tin_.triangles[t][i % 3]]);
  };
  const Rational eye_above =
      height_above(corner(triangle, 0), corner(triangle, 1), corner(triangle, 2), c);
  if (eye_above < 0) return true;
  if (eye_above == 0) return {};
  using Function = std::function<Rational(const Exact&)>;
  const Polygon whole{corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)};
  std::vector<Polygon> pieces{whole};
  for (TriangleIndex t = 0; t < tin_.triangles.size() && !pieces.empty(); ++t) {
    bool holds_eye = true;
    std::vector<Function> into;  // the directions from the eye that stay over t for a while
    for (std::size_t i = 0; i < 3; ++i) {
      const Exact u = corner(t, i), v = corner(t, i + 1);
      const Rational eye_side = turn(u, v, c);
      if (eye_side < 0) holds_eye = false;
      if (eye_side == 0) into.push_back([u, v](const Exact& q) { return turn(u, v, q); });
      if (eye_side == 0 || t == triangle) continue;
      // Seen from the eye, counter-clockwise.
      const Exact right = eye_side > 0 ? u : v, left = eye_side > 0 ? v : u;
      subtract(whole, pieces,
               std::vector<Function>{
                   [&](const Exact& q) { return turn(c, right, q); },
                   [&](const Exact& q) { return turn(c, q, left); },
                   [&](const Exact& q) -> Rational { return -turn(right, left, q); },
                   [&](const Exact& q) -> Rational { return -height_above(c, right, left, q); }});
    }
    if (holds_eye && height_above(corner(t, 0), corner(t, 1), corner(t, 2), c) < 0)
      subtract(whole, pieces, into);
    if (holds_eye && into.empty() && height_above(corner(t, 0), corner(t, 1), corner(t, 2), c) < 0)
      return true;
  }
  return pieces.empty();
}

Tin delaunay_tin(std::vector<Position> points, double void_share, std::uint64_t seed) {
  using Vertex = CGAL::Triangulation_vertex_base_with_info_2<VertexIndex, Kernel>;
  using Structure = CGAL::Triangulation_data_structure_2<Vertex>;
  CGAL::Delaunay_triangulation_2<Kernel, Structure> delaunay;
  std::vector<std::pair<Kernel::Point_2, VertexIndex>> places;
  for (VertexIndex i = 0; i < points.size(); ++i)
    places.emplace_back(Kernel::Point_2(points[i].x_m, points[i].y_m), i);
  delaunay.insert(places.begin(), places.end());
  std::mt19937_64 random(seed);
  Tin tin;
  std::vector<VertexIndex> vertex(points.size(), kNone);
  for (const auto& face : delaunay.finite_face_handles()) {
    if (static_cast<double>(random() >> 11) * 0x1p-53 < void_share) continue;
    std::array<VertexIndex, 3> corners{};
    for (int i = 0; i < 3; ++i) {
      VertexIndex& v = vertex[face->vertex(i)->info()];
      if (v == kNone) {
        v = static_cast<VertexIndex>(tin.vertices.size());
        tin.vertices.push_back(points[face->vertex(i)->info()]);
      }
      corners[static_cast<std::size_t>(i)] = v;
    }
    tin.triangles.push_back(corners);
  }
  connect_neighbours(tin);
  return tin;
}

}  // namespace scarp::test
