#pragma once

#include <array>
#include <cstdint>

#include "ingest/mesh/sample_plane.h"

namespace scarp {

/// Follows the straight line from sample a to sample b through the cells of a grid and reports
/// every crossing with the inside of a grid edge or of a cell's diagonal. Only the sides of samples
/// decide, so the walk is exact where they are; grid lines need not be straight, cells convex only.
///
/// @param side      side(node): > 0 left of a -> b seen from above, < 0 right, 0 on the line
/// @param enterable enterable(column, row): whether the walk may pass the cell
/// @param crossing  crossing(p, q, column, row): line crosses segment p - q of that cell
/// @return false where the line leaves the enterable cells; what was reported until then holds
///
/// Cost: two looks at side and at most four crossings a cell.
template <class Side, class Enterable, class Crossing>
bool walk_cells(const GridNode& a, const GridNode& b, const Side& side, const Enterable& enterable,
                const Crossing& crossing);

// -------------------------------------------------------------------------------------------------

namespace cell_walk {

inline GridNode corner_cell(const GridNode& p, const GridNode& opposite) {
  return {p.column < opposite.column ? p.column : opposite.column,
          p.row < opposite.row ? p.row : opposite.row};
}

/// Where the line leaves a sample: along a grid edge to `next`, or into the cell between `right`
/// and `left`.
struct Departure {
  bool along_edge = false;
  bool found = false;
  GridNode next, right, left, opposite;
};

template <class Side>
Departure depart(const GridNode& n, const GridNode& a, const GridNode& b, const Side& side) {
  const std::int32_t dc = b.column - a.column, dr = b.row - a.row;
  // The likely quadrant first; a bent grid can turn an axis-parallel line into its neighbour.
  const std::int32_t sx = dc >= 0 ? 1 : -1, sy = dr >= 0 ? 1 : -1;
  const std::array<std::array<std::int32_t, 2>, 4> quadrants{
      {{sx, sy},
       {dc == 0 ? -sx : sx, dc == 0 ? sy : -sy},
       {dc == 0 ? sx : -sx, dc == 0 ? -sy : sy},
       {-sx, -sy}}};
  for (const auto& [qx, qy] : quadrants) {
    const GridNode h{n.column + qx, n.row}, v{n.column, n.row + qy};
    const auto side_h = side(h), side_v = side(v);
    if (side_h == 0 && dc * qx > 0) return {true, true, h, {}, {}, {}};
    if (side_v == 0 && dr * qy > 0) return {true, true, v, {}, {}, {}};
    const bool h_is_right = qx * qy < 0;
    const auto side_right = h_is_right ? side_h : side_v, side_left = h_is_right ? side_v : side_h;
    if (side_right < 0 && side_left > 0) {
      return {false, true, {}, h_is_right ? h : v, h_is_right ? v : h, {h.column, v.row}};
    }
  }
  return {};
}

}  // namespace cell_walk

template <class Side, class Enterable, class Crossing>
bool walk_cells(const GridNode& a, const GridNode& b, const Side& side, const Enterable& enterable,
                const Crossing& crossing) {
  using cell_walk::corner_cell;
  GridNode n = a;
  while (!(n == b)) {
    const cell_walk::Departure out = cell_walk::depart(n, a, b, side);
    if (!out.found) return false;
    if (out.along_edge) {
      n = out.next;
      continue;
    }
    GridNode cell = corner_cell(n, out.opposite);
    if (!enterable(cell.column, cell.row)) return false;
    crossing(out.right, out.left, cell.column, cell.row);
    if (out.opposite == b) return true;
    const auto side_opposite = side(out.opposite);
    if (side_opposite == 0) {
      n = out.opposite;
      continue;
    }
    // The line now leaves each cell through an edge, with one end on its right and one on its left.
    GridNode right = side_opposite > 0 ? out.right : out.opposite;
    GridNode left = side_opposite > 0 ? out.opposite : out.left;
    for (;;) {
      crossing(right, left, cell.column, cell.row);
      const std::int32_t fc = right.row - left.row, fr = left.column - right.column;
      const GridNode far_right{right.column + fc, right.row + fr};
      const GridNode far_left{left.column + fc, left.row + fr};
      cell = corner_cell(right, far_left);
      if (!enterable(cell.column, cell.row)) return false;
      const auto side_right = side(far_right), side_left = side(far_left);
      if (side_left > 0) crossing(right, far_left, cell.column, cell.row);
      if (side_right < 0) crossing(far_right, left, cell.column, cell.row);
      if (side_right == 0 || side_left == 0) {
        n = side_right == 0 ? far_right : far_left;
        break;
      }
      if (side_right > 0) {
        left = far_right;
      } else if (side_left < 0) {
        right = far_left;
      } else {
        right = far_right;
        left = far_left;
      }
    }
  }
  return true;
}

}  // namespace scarp
