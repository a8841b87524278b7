#include "ingest/mesh/ground.h"

#include <algorithm>
#include <cmath>

#include "ingest/mesh/mesh.h"
#include "ingest/mesh/shared_edge.h"

namespace scarp {
namespace {

/// Distance of p from the line a -> b in the plane, metres.
double distance_from_line_m(const Position& a, const Position& b, const Position& p) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  return std::abs(dx * (p.y_m - a.y_m) - dy * (p.x_m - a.x_m)) / std::hypot(dx, dy);
}

/// Appends the run, cut at the sample farthest from its chord until all are near enough.
void append_split(const SampleGrid& grid, const BorderRun& run, std::vector<BorderRun>& runs) {
  const double allowed_m = kBorderDeviationCells * std::min(grid.cell_x_m, grid.cell_y_m);
  std::vector<BorderRun> open{run};
  while (!open.empty()) {
    const BorderRun piece = open.back();
    open.pop_back();
    const std::int32_t columns = piece.to.column - piece.from.column;
    const std::int32_t length = columns + piece.to.row - piece.from.row;
    const GridNode step{columns > 0 ? 1 : 0, columns > 0 ? 0 : 1};
    const Position& a = grid.at(piece.from.column, piece.from.row);
    const Position& b = grid.at(piece.to.column, piece.to.row);
    double farthest_m = allowed_m;
    GridNode cut = piece.from;
    for (std::int32_t i = 1; i < length; ++i) {
      const GridNode n{piece.from.column + i * step.column, piece.from.row + i * step.row};
      const double away_m = distance_from_line_m(a, b, grid.at(n.column, n.row));
      if (away_m > farthest_m) {
        farthest_m = away_m;
        cut = n;
      }
    }
    if (cut == piece.from) {
      runs.push_back(piece);
    } else {
      open.push_back({cut, piece.to});
      open.push_back({piece.from, cut});
    }
  }
}

/// Added to the side of an edge of a tile that has ground beyond.
constexpr int kShared = 2;

/// One grid line's runs. side(i) says whether the unit edge i of the line is border, and on which
/// side ground lies (0 none, 1, 2; kShared more with ground on both); node(i) is its i-th sample.
/// Where the border turns the line's edges end, and where it touches itself they change sides.
template <class Side, class Node, class Append>
void append_line(std::int32_t first, std::int32_t last, const Side& side, const Node& node,
                 const Append& append) {
  for (std::int32_t i = first; i < last;) {
    const int here = side(i);
    std::int32_t end = i + 1;
    if (here != 0) {
      while (end < last && side(end) == here) ++end;
      append(here, BorderRun{node(i), node(end)});
    }
    i = end;
  }
}

/// Appends an edge between two tiles.
void append_shared(const SharedEdge& edge, const SampleRange& range, const BorderRun& run,
                   TileBorder& border) {
  const auto is_corner = [&](const GridNode& n) {
    return (n.column == range.first.column || n.column == range.last.column) &&
           (n.row == range.first.row || n.row == range.last.row);
  };
  std::vector<GridNode> vertices;
  edge.cut(run.from, run.to, is_corner(run.from), is_corner(run.to), vertices);
  const GridNode step{run.to.column > run.from.column, run.to.row > run.from.row};
  for (std::size_t i = 0; i + 1 < vertices.size(); ++i) {
    border.runs.push_back({vertices[i], vertices[i + 1]});
    for (GridNode n = vertices[i];;) {
      n = {n.column + step.column, n.row + step.row};
      if (n == vertices[i + 1]) break;
      border.locked.push_back(n);
    }
  }
}

}  // namespace

GroundCells::GroundCells(const SampleGrid& grid, const SampleRange& range)
    : columns_(grid.columns), rows_(grid.rows), ground_(grid.positions.size(), 0) {
  for (std::int32_t row = range.first.row; row < range.last.row; ++row) {
    const std::uint8_t* upper = grid.known.data() + grid.index(0, row);
    const std::uint8_t* lower = upper + columns_;
    std::uint8_t* out = ground_.data() + grid.index(0, row);
    for (std::int32_t c = range.first.column; c < range.last.column; ++c)
      out[c] = upper[c] && upper[c + 1] && lower[c] && lower[c + 1];
    if (!grid.void_cells.empty())
      for (std::int32_t c = range.first.column; c < range.last.column; ++c)
        out[c] = out[c] && !grid.void_cells[grid.index(c, row)];
    for (std::int32_t c = range.first.column; c < range.last.column; ++c) count_ += out[c];
  }
}

std::vector<BorderRun> ground_border(const SampleGrid& grid, const GroundCells& ground) {
  return tile_border(grid, ground, all_samples(grid), 0, MeshBound::kSurface).runs;
}

TileBorder tile_border(const SampleGrid& grid, const GroundCells& ground, const SampleRange& range,
                       double max_error_m, MeshBound bound) {
  TileBorder border;
  const SharedEdge shared(grid, max_error_m, bound);
  const auto append = [&](int side, const BorderRun& run) {
    if (side <= kShared)
      append_split(grid, run, border.runs);
    else
      append_shared(shared, range, run, border);
  };
  /// Cells on both sides of a unit edge: which of them is the tile's ground, and whether ground
  /// lies across the edge of the tile.
  const auto side_of = [&](const GridNode& one, const GridNode& other) {
    const bool at_one = ground(one.column, one.row), at_other = ground(other.column, other.row);
    if (at_one == at_other) return 0;
    const GridNode& beyond = at_one ? other : one;
    const bool is_shared = grid.is_ground_cell(beyond.column, beyond.row);
    return (at_one ? 1 : 2) + (is_shared ? kShared : 0);
  };
  for (std::int32_t r = range.first.row; r <= range.last.row; ++r) {
    append_line(
        range.first.column, range.last.column,
        [&](std::int32_t c) {
          return side_of({c, r - 1}, {c, r});
        },
        [&](std::int32_t c) {
          return GridNode{c, r};
        },
        append);
  }
  for (std::int32_t c = range.first.column; c <= range.last.column; ++c) {
    append_line(
        range.first.row, range.last.row,
        [&](std::int32_t r) {
          return side_of({c - 1, r}, {c, r});
        },
        [&](std::int32_t r) {
          return GridNode{c, r};
        },
        append);
  }
  return border;
}

std::uint32_t count_lost_samples(const SampleGrid& grid, const SampleRange& range) {
  const std::int32_t columns_end =
      range.last.column + 1 == grid.columns ? grid.columns : range.last.column;
  const std::int32_t rows_end = range.last.row + 1 == grid.rows ? grid.rows : range.last.row;
  std::uint32_t lost = 0;
  for (std::int32_t r = range.first.row; r < rows_end; ++r)
    for (std::int32_t c = range.first.column; c < columns_end; ++c)
      lost += grid.is_known(c, r) && !grid.is_ground_cell(c, r) && !grid.is_ground_cell(c - 1, r) &&
              !grid.is_ground_cell(c, r - 1) && !grid.is_ground_cell(c - 1, r - 1);
  return lost;
}

SamplePlane sample_plane_of(const SampleGrid& grid) {
  const double wanted = grid.cell_x_m / grid.cell_y_m;
  SamplePlane best;
  double best_miss = std::abs(std::log(wanted));
  for (std::int32_t x = 1; x <= 32; ++x) {
    for (std::int32_t y = 1; y <= 32; ++y) {
      const double miss = std::abs(std::log(wanted * y / x));
      // Small steps first; a better fit must be one worth larger numbers.
      if (miss < 0.999 * best_miss && miss < best_miss - 1e-6) {
        best_miss = miss;
        best = {x, y};
      }
    }
  }
  return best;
}

}  // namespace scarp
