#include "ingest/mesh/ground.h"

#include <algorithm>
#include <cmath>

#include "ingest/mesh/mesh.h"

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

/// One grid line's runs. border(i) says whether the unit edge i of the line is border, and on which
/// side ground lies (0 none, 1, 2); node(i) is its i-th sample. Where the border turns the line's
/// edges end, and where it touches itself they change sides.
template <class Border, class Node>
void append_line(const SampleGrid& grid, std::int32_t units, const Border& border, const Node& node,
                 std::vector<BorderRun>& runs) {
  for (std::int32_t i = 0; i < units;) {
    const int side = border(i);
    std::int32_t end = i + 1;
    if (side != 0) {
      while (end < units && border(end) == side) ++end;
      append_split(grid, {node(i), node(end)}, runs);
    }
    i = end;
  }
}

}  // namespace

GroundCells::GroundCells(const SampleGrid& grid)
    : columns_(grid.columns), rows_(grid.rows), ground_(grid.positions.size(), 0) {
  for (std::int32_t row = 0; row + 1 < rows_; ++row) {
    const std::uint8_t* upper = grid.known.data() + grid.index(0, row);
    const std::uint8_t* lower = upper + columns_;
    std::uint8_t* out = ground_.data() + grid.index(0, row);
    for (std::int32_t c = 0; c + 1 < columns_; ++c) {
      out[c] = upper[c] && upper[c + 1] && lower[c] && lower[c + 1];
      count_ += out[c];
    }
  }
}

std::vector<BorderRun> ground_border(const SampleGrid& grid, const GroundCells& ground) {
  const auto side = [](bool one, bool other) { return one == other ? 0 : (one ? 1 : 2); };
  const auto across_row = [&](std::int32_t c, std::int32_t r) {  // edge (c, r) - (c+1, r)
    return side(ground(c, r - 1), ground(c, r));
  };
  const auto across_column = [&](std::int32_t c, std::int32_t r) {  // edge (c, r) - (c, r+1)
    return side(ground(c - 1, r), ground(c, r));
  };
  std::vector<BorderRun> runs;
  for (std::int32_t r = 0; r < grid.rows; ++r) {
    append_line(
        grid, grid.columns - 1, [&](std::int32_t c) { return across_row(c, r); },
        [&](std::int32_t c) {
          return GridNode{c, r};
        },
        runs);
  }
  for (std::int32_t c = 0; c < grid.columns; ++c) {
    append_line(
        grid, grid.rows - 1, [&](std::int32_t r) { return across_column(c, r); },
        [&](std::int32_t r) {
          return GridNode{c, r};
        },
        runs);
  }
  return runs;
}

std::uint32_t count_lost_samples(const SampleGrid& grid, const GroundCells& ground) {
  std::uint32_t lost = 0;
  for (std::int32_t r = 0; r < grid.rows; ++r)
    for (std::int32_t c = 0; c < grid.columns; ++c)
      lost += grid.is_known(c, r) && !ground.touches({c, r});
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
