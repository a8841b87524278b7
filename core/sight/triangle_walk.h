#pragma once

#include <optional>

#include "core/geodesy/position.h"
#include "core/sight/tin_index.h"

namespace scarp {

/// Height of a triangle's plane at a place, rounded as TinIndex::ground_height_m says.
double height_in_plane_m(const Tin& tin, TriangleIndex triangle, double x_m, double y_m);

/// TinIndex's look-ups for places that follow each other closely: where the triangle of the last
/// one holds the next one inside, it is the only one that does, and no bin is asked. The same
/// answers. For one thread; keeps a reference to the index.
class TriangleWalk {
 public:
  explicit TriangleWalk(const TinIndex& index) : index_(index) {}

  TriangleIndex triangle_at(double x_m, double y_m);
  std::optional<double> ground_height_m(double x_m, double y_m);
  std::optional<int> above_ground(const Position& p);
  /// Whether p is over ground and strictly under none of the triangles there. Exact.
  bool stands_clear(const Position& p);

 private:
  /// Whether the last triangle holds a place, its border left out.
  bool stays(double x_m, double y_m) const;
  int side_of_plane(TriangleIndex triangle, const Position& p) const;

  const TinIndex& index_;
  TriangleIndex last_ = kNone;
};

}  // namespace scarp
