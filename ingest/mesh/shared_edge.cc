#include "ingest/mesh/shared_edge.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/mesh/height_plane.h"

namespace scarp {
namespace {

/// A piece strays from its samples by a quarter of bend times length squared. This much bend keeps
/// it as near to them as borders are, and triangles that have a sample next to it for apex sound
/// (GreedyMesher::shape_repair).
constexpr double kMostBendCells = 4 * kBorderDeviationCells;

constexpr std::array<int, 2> kSides = {-1, 1};

}  // namespace

/// The samples of the edge's grid line and those beside it, by their place along the line.
struct SharedEdge::Line {
  const SampleGrid& grid;
  GridNode first, step;

  GridNode node(std::int32_t i) const {
    return {first.column + i * step.column, first.row + i * step.row};
  }
  const Position& on(std::int32_t i) const { return beside(i, 0); }
  const Position& beside(std::int32_t i, int side) const {
    const GridNode n = node(i);
    return grid.at(n.column + side * step.row, n.row + side * step.column);
  }
};

/// The worst place of a piece, and the sample of the line that mends it.
struct SharedEdge::Worst {
  double error_m;
  std::int32_t cut = 0;

  void take(double other_m, std::int32_t at) {
    if (!(other_m > error_m)) return;
    error_m = other_m;
    cut = at;
  }
};

SharedEdge::SharedEdge(const SampleGrid& grid, double max_error_m, MeshBound bound)
    : grid_(grid), max_error_m_(max_error_m), bound_(bound), longest_cells_(kLongestPieceCells) {
  const double short_m = std::min(grid.cell_x_m, grid.cell_y_m);
  const double long_m = std::max(grid.cell_x_m, grid.cell_y_m);
  if (grid.bend_cells > 0) {
    const double most = std::sqrt(kMostBendCells * short_m / (long_m * grid.bend_cells));
    longest_cells_ = static_cast<std::int32_t>(std::clamp(most, 1.0, double{kLongestPieceCells}));
  }
}

void SharedEdge::cut(const GridNode& from, const GridNode& to, bool from_corner, bool to_corner,
                     std::vector<GridNode>& vertices) const {
  const Line line{grid_, from, {to.column > from.column, to.row > from.row}};
  const std::int32_t cells = to.column - from.column + to.row - from.row;
  std::vector<std::int32_t> open{cells};  // ends of pieces still to be tried, the next on top
  if (to_corner && cells > 2) open.push_back(cells - 1);
  if (from_corner && cells > 1) open.push_back(1);
  vertices.push_back(from);
  for (std::int32_t begin = 0; !open.empty();) {
    const std::int32_t at = place_to_cut(line, begin, open.back());
    if (at != begin) {
      open.push_back(at);
      continue;
    }
    begin = open.back();
    open.pop_back();
    vertices.push_back(line.node(begin));
  }
}

/// Where a piece has to be cut, or its beginning where it is good.
std::int32_t SharedEdge::place_to_cut(const Line& line, std::int32_t from, std::int32_t to) const {
  if (to - from == 1) return from;
  if (to - from > longest_cells_) return from + (to - from) / 2;
  Worst worst{max_error_m_, from};
  for (const int side : kSides) look_along_samples(line, from, to, side, worst);
  if (worst.cut != from || bound_ == MeshBound::kSamples) return worst.cut;
  for (const int side : kSides) look_along_fans(line, from, to, side, worst);
  return worst.cut;
}

/// Samples of the line against the triangle that the piece is a side of. Its apex is the sample
/// beside the middle; of two such either.
void SharedEdge::look_along_samples(const Line& line, std::int32_t from, std::int32_t to, int side,
                                    Worst& worst) const {
  const std::int32_t low = from + (to - from) / 2, high = to - (to - from) / 2;
  for (std::int32_t apex = low; apex <= high; ++apex) {
    const HeightPlane plane(line.on(from), line.on(to), line.beside(apex, side));
    for (std::int32_t i = from + 1; i < to; ++i) worst.take(plane.error_m(line.on(i)), i);
  }
}

/// Edges from both ends of the piece to the samples beside it, where they cross grid lines and
/// diagonals of cells.
void SharedEdge::look_along_fans(const Line& line, std::int32_t from, std::int32_t to, int side,
                                 Worst& worst) const {
  const std::int32_t low = from + (to - from) / 2, high = to - (to - from) / 2;
  const auto look = [&](std::int32_t end, std::int32_t apex, std::int32_t on, std::int32_t beside) {
    const Position &a = line.on(end), &b = line.beside(apex, side);
    const double error_m = crossing_error_m(a, b, line.on(on), line.beside(beside, side));
    // A vertex at either sample of the line mends a diagonal; the ends are vertices already.
    worst.take(error_m, std::clamp(on, from + 1, to - 1));
  };
  for (std::int32_t apex = from + 1; apex <= high; ++apex)
    for (std::int32_t i = from + 1; i <= apex; ++i) {
      look(from, apex, i, i - 1);
      if (i < apex) look(from, apex, i, i);
      if (i > from + 1) look(from, apex, i - 1, i);
    }
  for (std::int32_t apex = to - 1; apex >= low; --apex)
    for (std::int32_t i = to - 1; i >= apex; --i) {
      look(to, apex, i, i + 1);
      if (i > apex) look(to, apex, i, i);
      if (i < to - 1) look(to, apex, i + 1, i);
    }
}

}  // namespace scarp
