#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "ingest/mesh/mesh.h"
#include "ingest/mesh/sample_plane.h"

namespace scarp {
namespace {

using Wide = __int128;

struct PlanePoint {
  std::int64_t x, y;
};

class MeshCheck {
 public:
  MeshCheck(const SampleGrid& grid, const Mesh& mesh, std::optional<std::int32_t> tile_cells)
      : grid_(grid), mesh_(mesh), tile_cells_(tile_cells), plane_(sample_plane_of(grid)) {}

  std::optional<std::string> run() const {
    if (auto broken = check_tin(mesh_.tin)) return broken;
    if (auto broken = check_vertices()) return broken;
    if (auto broken = check_tiles()) return broken;
    if (auto broken = check_delaunay()) return broken;
    if (auto broken = check_border()) return broken;
    return check_area();
  }

 private:
  GridNode node(VertexIndex v) const {
    const std::int64_t sample = mesh_.sample_of_vertex[v];
    return {static_cast<std::int32_t>(sample % grid_.columns),
            static_cast<std::int32_t>(sample / grid_.columns)};
  }
  PlanePoint point(VertexIndex v) const { return {plane_.x(node(v)), plane_.y(node(v))}; }

  std::optional<std::string> check_vertices() const {
    if (mesh_.sample_of_vertex.size() != mesh_.tin.vertices.size())
      return "samples of vertices are missing";
    for (std::size_t v = 0; v < mesh_.tin.vertices.size(); ++v) {
      const std::int64_t sample = mesh_.sample_of_vertex[v];
      const std::string name = "vertex " + std::to_string(v);
      if (sample < 0 || sample >= static_cast<std::int64_t>(grid_.positions.size()))
        return name + " is no sample";
      if (v > 0 && sample <= mesh_.sample_of_vertex[v - 1]) return name + " is out of order";
      if (!grid_.known[static_cast<std::size_t>(sample)]) return name + " is void";
      if (!(grid_.positions[static_cast<std::size_t>(sample)] == mesh_.tin.vertices[v]))
        return name + " is not where its sample is";
    }
    return {};
  }

  static bool in_circle(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c,
                        const PlanePoint& d) {
    const auto lift = [&](const PlanePoint& p) {
      return Wide{p.x - d.x} * (p.x - d.x) + Wide{p.y - d.y} * (p.y - d.y);
    };
    const auto minor = [&](const PlanePoint& p, const PlanePoint& q) {
      return Wide{p.x - d.x} * (q.y - d.y) - Wide{p.y - d.y} * (q.x - d.x);
    };
    return lift(a) * minor(b, c) + lift(b) * minor(c, a) + lift(c) * minor(a, b) > 0;
  }

  /// Tiles that the triangles lie in; 0, 0 without tiles.
  GridNode tile_of(TriangleIndex t) const {
    if (!tile_cells_) return {};
    GridNode low = node(mesh_.tin.triangles[t][0]);
    for (const VertexIndex v : mesh_.tin.triangles[t])
      low = {std::min(low.column, node(v).column), std::min(low.row, node(v).row)};
    return {low.column / *tile_cells_, low.row / *tile_cells_};
  }

  std::optional<std::string> check_tiles() const {
    if (!tile_cells_) return {};
    for (TriangleIndex t = 0; t < mesh_.tin.triangles.size(); ++t)
      for (const VertexIndex v : mesh_.tin.triangles[t])
        if (node(v).column > (tile_of(t).column + 1) * *tile_cells_ ||
            node(v).row > (tile_of(t).row + 1) * *tile_cells_)
          return "triangle " + std::to_string(t) + " crosses the edge of a tile";
    return {};
  }

  std::optional<std::string> check_delaunay() const {
    for (TriangleIndex t = 0; t < mesh_.tin.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh_.tin.triangles[t];
      for (const TriangleIndex across : mesh_.tin.neighbours[t]) {
        if (across == kNone || !(tile_of(across) == tile_of(t))) continue;
        for (const VertexIndex v : mesh_.tin.triangles[across])
          if (in_circle(point(a), point(b), point(c), point(v)))
            return "triangle " + std::to_string(t) + " has vertex " + std::to_string(v) +
                   " inside its circle";
      }
    }
    return {};
  }

  /// Ground must lie left of each unit of the edge a -> b and not right of it.
  bool runs_along_ground(const GridNode& a, const GridNode& b) const {
    if ((a.column == b.column) == (a.row == b.row)) return false;
    const std::int32_t dc = (b.column > a.column) - (b.column < a.column);
    const std::int32_t dr = (b.row > a.row) - (b.row < a.row);
    for (GridNode n = a; !(n == b); n = {n.column + dc, n.row + dr}) {
      const std::int32_t column = std::min(n.column, n.column + dc);
      const std::int32_t row = std::min(n.row, n.row + dr);
      // Along a row eastwards, left is the cell above; along a column northwards, the one before.
      const GridNode one = dc != 0 ? GridNode{column, row - 1} : GridNode{column - 1, row};
      const bool one_is_left = dc > 0 || dr < 0;
      const bool ground_one = grid_.is_ground_cell(one.column, one.row);
      const bool ground_other = grid_.is_ground_cell(column, row);
      if ((one_is_left ? ground_one : ground_other) == false) return false;
      if ((one_is_left ? ground_other : ground_one) == true) return false;
    }
    return true;
  }

  std::optional<std::string> check_border() const {
    for (std::size_t t = 0; t < mesh_.tin.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (mesh_.tin.neighbours[t][i] != kNone) continue;
        const VertexIndex from = mesh_.tin.triangles[t][(i + 1) % 3];
        const VertexIndex to = mesh_.tin.triangles[t][(i + 2) % 3];
        if (!runs_along_ground(node(from), node(to)))
          return "border edge " + std::to_string(from) + "-" + std::to_string(to) +
                 " does not run along the border of the ground";
      }
    }
    return {};
  }

  std::optional<std::string> check_area() const {
    Wide twice_area = 0;
    for (const auto& [a, b, c] : mesh_.tin.triangles) {
      const PlanePoint p = point(a), q = point(b), r = point(c);
      const Wide twice = Wide{q.x - p.x} * (r.y - p.y) - Wide{q.y - p.y} * (r.x - p.x);
      if (twice <= 0) return "a triangle is not counter-clockwise in the sample plane";
      twice_area += twice;
    }
    Wide cells = 0;
    for (std::int32_t r = 0; r + 1 < grid_.rows; ++r)
      for (std::int32_t c = 0; c + 1 < grid_.columns; ++c) cells += grid_.is_ground_cell(c, r);
    if (twice_area != 2 * cells * plane_.step_x * plane_.step_y)
      return "the triangles do not cover the ground once";
    return {};
  }

  const SampleGrid& grid_;
  const Mesh& mesh_;
  const std::optional<std::int32_t> tile_cells_;
  SamplePlane plane_;
};

}  // namespace

std::optional<std::string> check_mesh(const SampleGrid& grid, const Mesh& mesh,
                                      std::optional<std::int32_t> tile_cells) {
  return MeshCheck(grid, mesh, tile_cells).run();
}

}  // namespace scarp
