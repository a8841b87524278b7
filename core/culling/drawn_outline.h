#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/culling/camera.h"
#include "core/terrain/tin.h"

namespace scarp {

/// The upper outline of what has been drawn so far: where it stands, as a chain of line pieces over
/// an axis x, with gaps where nothing is.
class UpperOutline {
 public:
  struct Point {
    double x, y;
  };

  /// Raises the outline to a segment where that is higher. Segments too narrow to hide anything
  /// (kNarrowest) leave it as it is. Cost: a memory move of the outline, and the pieces met.
  void raise(Point a, Point b);

  /// Whether a segment lies under the outline everywhere, by more than kUnder. Side: no is safe.
  bool covers(Point a, Point b) const;

  std::size_t pieces() const { return pieces_.size(); }

 private:
  /// Part of a line: y = y0 + slope (x - x0). Pieces share lines, so that nothing is added up.
  struct Piece {
    double from, to;
    double x0, y0, slope;

    double at(double x) const { return y0 + slope * (x - x0); }
  };

  void keep(std::vector<Piece>& out, const Piece& piece, double from, double to) const;
  void keep_higher(std::vector<Piece>& out, const Piece& a, const Piece& b, double from,
                   double to) const;

  std::vector<Piece> pieces_;  // ascending, apart from each other
  std::vector<Piece> raised_;
};

/// Which triangles of a drawn height field may be seen over what is drawn before them.
///
/// A point is hidden where the ray to it has run under the ground. So all that is farther than an
/// edge of the surface and lower in the picture is hidden, and so is a triangle that is seen from
/// below. Edges are taken from near to far, their upper outline is kept over the directions of the
/// picture, and a triangle is asked once all edges that are nearer than all of it are in. Where a
/// triangle is hidden, its edges are under the outline as it is.
///
/// @param triangles  of one height field without overlaps, counter-clockwise from above; what of
///   it is not drawn hides nothing
/// @return [triangles] 1 where it may be seen
/// Side: never 0 where a ray from the eye, which is above the surface, meets the triangle before
///   any other. Triangles that reach behind the eye or before the near plane are 1. Rounding is
///   paid by kUnder. Requires shot.view.eye above the surface, and no exaggeration.
/// Cost: O(n log n + n p), p pieces of the outline met by a triangle, about 0.3 us a triangle.
/// Source: the floating horizon of Wright 1973, with edges for rows, as a test of visibility after
///   Downs, Möller and Séquin 2001.
std::vector<std::uint8_t> over_outline(const Shot& shot, std::span<const Position> vertices,
                                       std::span<const std::array<VertexIndex, 3>> triangles);

}  // namespace scarp
