#pragma once

#include <memory>
#include <optional>

#include "core/terrain/tin.h"

namespace scarp::test {

/// The judge's judge: the same definition of visibility on the surface `tin`, decided another way,
/// with CGAL's exact arithmetic. It shares no code with core/sight and does not look at edges:
/// where a line runs under ground it runs under some triangle.
class SightTwin {
 public:
  explicit SightTwin(const Tin& tin);
  ~SightTwin();

  /// Whether the open segment a-b runs strictly under the ground. CGAL's AABB tree finds the
  /// triangles that the curtain standing on the segment meets; each is clipped to the segment's
  /// plan in rational numbers. Takes about a tenth of a millisecond.
  bool is_blocked(const Position& a, const Position& b) const;

  /// Whether nothing of a triangle's interior is visible: the shadows of all edges are subtracted
  /// from it as polygons with rational corners. Nothing where the eye lies in the triangle's
  /// plane, because then what is seen may be a line without area. Slow: for small scenes.
  std::optional<bool> is_hidden(const Position& eye, TriangleIndex triangle) const;

 private:
  struct Tree;
  const Tin& tin_;
  std::unique_ptr<Tree> tree_;
};

/// A Delaunay triangulation of scattered places: `points` without repeats in plan.
/// Each triangle is left out with the given probability, which makes voids of many shapes.
Tin delaunay_tin(std::vector<Position> points, double void_share, std::uint64_t seed);

}  // namespace scarp::test
