// Constrained Delaunay triangulation of samples and the corners of walls, with greedy insertion as
// in mesh.cc, but for vertices that may lie anywhere among the samples.
#include "ingest/mesh/mesh_walls.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error/error.h"
#include "core/geodesy/predicates.h"
#include "ingest/mesh/ground.h"

namespace scarp {
namespace {

struct FaceInfo {
  double sample_error_m = 0;
  double edge_error_m = 0;
  std::uint32_t stamp = 0;  // new with every scan: CGAL reuses faces in place
  bool ground = false;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<
    Kernel, CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Face = Triangulation::Face_handle;
using Point = Kernel::Point_2;

constexpr std::uint32_t kNoSample = kNone;

/// A vertex: a sample, or a corner of a wall.
struct Node {
  double column, row;
  Position position;
  std::uint32_t sample;  // kNoSample for a corner
};

/// What to insert, and for which error.
struct Candidate {
  double error_m = 0;
  std::uint32_t sample = kNoSample;

  void consider(double other_error_m, std::uint32_t other) {
    if (other_error_m > error_m || (other_error_m == error_m && other < sample))
      *this = {other_error_m, other};
  }
};

struct HeapEntry {
  double error_m;
  std::uint32_t sample;
  std::uint32_t stamp;
  Face face;

  bool operator<(const HeapEntry& other) const {
    return error_m != other.error_m ? error_m < other.error_m : sample > other.sample;
  }
};

double side(const Position& a, const Position& b, const Position& p) {
  return (b.x_m - a.x_m) * (p.y_m - a.y_m) - (b.y_m - a.y_m) * (p.x_m - a.x_m);
}

/// Vertical distance of p from the plane through a, b, c.
double error_at_m(const Position& a, const Position& b, const Position& c, const Position& p) {
  const double whole = side(a, b, c);
  const double at_b = side(c, a, p) / whole, at_c = side(a, b, p) / whole;
  return std::abs((p.z_m - a.z_m) - at_b * (b.z_m - a.z_m) - at_c * (c.z_m - a.z_m));
}

class WallMesher {
 public:
  WallMesher(const SampleGrid& grid, const WallsAndRoofs& walls)
      : grid_(grid), walls_(walls), ground_(grid), plane_(sample_plane_of(grid)) {}

  Mesh run(const Mesh& ground_mesh, double goal_m, bool with_edges, const Progress& progress) {
    goal_m_ = std::max(goal_m, kErrorRoundingM / 2);
    with_edges_ = with_edges;
    take(ground_mesh);
    triangulate(ground_mesh);
    mark_touched_cells();
    // What one face asks for may be inserted beside it and resolve a cell for another: look again
    // until nothing is asked for.
    for (scan_all(); !heap_.empty(); scan_all()) refine();
    if (progress) progress(0.95);
    if (!with_edges_) {
      goal_m_ = std::numeric_limits<double>::infinity();
      with_edges_ = true;
      scan_all();
    }
    Mesh mesh = result();
    mesh.lost_samples = ground_mesh.lost_samples;
    return mesh;
  }

 private:
  Point point(const Node& n) const { return {n.column * plane_.step_x, -n.row * plane_.step_y}; }
  const Node& node(Face f, int i) const { return nodes_[f->vertex(i)->info()]; }
  GridNode place(std::uint32_t sample) const {
    const auto columns = static_cast<std::uint32_t>(grid_.columns);
    return {static_cast<std::int32_t>(sample % columns),
            static_cast<std::int32_t>(sample / columns)};
  }
  Node node_of_sample(std::uint32_t sample) const {
    const GridNode at = place(sample);
    return {static_cast<double>(at.column), static_cast<double>(at.row), grid_.positions[sample],
            sample};
  }
  bool may_insert(std::uint32_t sample) const {
    return !walls_.covered[sample] && !is_vertex_[sample] && ground_.touches(place(sample));
  }

  /// Vertices of the ground's mesh that no building covers, then the corners of walls.
  void take(const Mesh& ground_mesh) {
    is_vertex_.assign(grid_.positions.size(), 0);
    node_of_ground_vertex_.assign(ground_mesh.tin.vertices.size(), kNone);
    for (std::size_t v = 0; v < ground_mesh.tin.vertices.size(); ++v) {
      const auto sample = static_cast<std::uint32_t>(ground_mesh.sample_of_vertex[v]);
      if (walls_.covered[sample]) continue;
      is_vertex_[sample] = 1;
      node_of_ground_vertex_[v] = static_cast<std::uint32_t>(nodes_.size());
      nodes_.push_back(node_of_sample(sample));
    }
    first_corner_ = static_cast<std::uint32_t>(nodes_.size());
    for (const WallVertex& v : walls_.vertices)
      nodes_.push_back({v.column, v.row, v.position, kNoSample});
  }

  void triangulate(const Mesh& ground_mesh) {
    using Numbered = std::pair<Point, std::uint32_t>;
    std::vector<Numbered> points;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) points.emplace_back(point(nodes_[i]), i);
    using Traits =
        CGAL::Spatial_sort_traits_adapter_2<Kernel, CGAL::First_of_pair_property_map<Numbered>>;
    CGAL::spatial_sort(points.begin(), points.end(), Traits());
    std::vector<Triangulation::Vertex_handle> handles(nodes_.size());
    Face near;
    for (const auto& [at, i] : points) {
      handles[i] = cdt_.insert(at, near);
      handles[i]->info() = i;
      near = handles[i]->face();
    }
    const Tin& tin = ground_mesh.tin;
    for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (tin.neighbours[t][i] != kNone) continue;
        const std::uint32_t a = node_of_ground_vertex_[tin.triangles[t][(i + 1) % 3]];
        const std::uint32_t b = node_of_ground_vertex_[tin.triangles[t][(i + 2) % 3]];
        assert(a != kNone && b != kNone);  // buildings keep away from the border
        cdt_.insert_constraint(handles[a], handles[b]);
      }
    }
    for (const auto& [a, b] : walls_.edges)
      cdt_.insert_constraint(handles[first_corner_ + a], handles[first_corner_ + b]);
  }

  /// Cells that a wall runs through or along.
  void mark_touched_cells() {
    touched_.assign(grid_.positions.size(), 0);
    for (const auto& [i, k] : walls_.edges) {
      walk(nodes_[first_corner_ + i], nodes_[first_corner_ + k], [&](double column, double row) {
        for (const double c : {std::floor(column), std::ceil(column) - 1})
          for (const double r : {std::floor(row), std::ceil(row) - 1})
            touched_[grid_.index(static_cast<std::int32_t>(c), static_cast<std::int32_t>(r))] = 1;
      });
    }
  }

  /// Calls visit(column, row) with a place in each cell that a straight line runs through.
  template <class Visit>
  static void walk(const Node& a, const Node& b, const Visit& visit) {
    std::vector<double> at{0, 1};
    const auto add_lines = [&](double from, double to) {
      const auto [low, high] = std::minmax(from, to);
      for (double line = std::floor(low) + 1; line < high; ++line)
        at.push_back((line - from) / (to - from));
    };
    add_lines(a.column, b.column);
    add_lines(a.row, b.row);
    std::sort(at.begin(), at.end());
    for (std::size_t i = 1; i < at.size(); ++i) {
      const double t = (at[i - 1] + at[i]) / 2;
      visit(a.column + t * (b.column - a.column), a.row + t * (b.row - a.row));
    }
  }

  /// No border runs through a face, so the cell that holds its centroid answers for all of it.
  bool is_ground(Face f) const {
    if (cdt_.is_infinite(f)) return false;
    const Node &a = node(f, 0), &b = node(f, 1), &c = node(f, 2);
    return ground_(static_cast<std::int32_t>((a.column + b.column + c.column) / 3),
                   static_cast<std::int32_t>((a.row + b.row + c.row) / 3));
  }

  bool turns_over(Face f) const {
    return orient2d(node(f, 0).position, node(f, 1).position, node(f, 2).position) <= 0;
  }

  // Errors.

  void scan_all() {
    for (const Face f : cdt_.finite_face_handles()) scan(f);
  }

  void scan(Face f) {
    FaceInfo& info = f->info();
    info = {0, 0, ++last_stamp_, is_ground(f)};
    if (!info.ground) return;
    Candidate worst;
    if (turns_over(f)) {
      worst = {std::numeric_limits<double>::infinity(), sample_to_split(f)};
    } else {
      worst = worst_sample(f);
      info.sample_error_m = worst.error_m;
      if (with_edges_) {
        Candidate crossing;
        for (int i = 0; i < 3; ++i)
          worst_crossing(node(f, cdt_.ccw(i)), node(f, cdt_.cw(i)), crossing);
        info.edge_error_m = crossing.error_m;
        worst.consider(crossing.error_m, crossing.sample);
      }
    }
    if (worst.error_m <= goal_m_ || worst.sample == kNoSample) return;
    heap_.push_back({worst.error_m, worst.sample, info.stamp, f});
    std::push_heap(heap_.begin(), heap_.end());
  }

  /// A sample that can be inserted near the middle of the longest edge, or kNoSample.
  std::uint32_t sample_to_split(Face f) const {
    double longest = -1;
    Node middle{};
    for (int i = 0; i < 3; ++i) {
      const Node &a = node(f, cdt_.ccw(i)), &b = node(f, cdt_.cw(i));
      const double length = std::hypot(b.column - a.column, b.row - a.row);
      if (length <= longest) continue;
      longest = length;
      middle.column = (a.column + b.column) / 2;
      middle.row = (a.row + b.row) / 2;
    }
    std::uint32_t nearest = kNoSample;
    double nearest_cells = std::numeric_limits<double>::infinity();
    const auto c0 = static_cast<std::int32_t>(middle.column);
    const auto r0 = static_cast<std::int32_t>(middle.row);
    for (std::int32_t r = r0; r <= std::min(r0 + 1, grid_.rows - 1); ++r) {
      for (std::int32_t c = c0; c <= std::min(c0 + 1, grid_.columns - 1); ++c) {
        const auto sample = static_cast<std::uint32_t>(grid_.index(c, r));
        const double away = std::hypot(c - middle.column, r - middle.row);
        if (away >= nearest_cells || !may_insert(sample)) continue;
        nearest_cells = away;
        nearest = sample;
      }
    }
    return nearest;
  }

  /// Worst sample that is ground and lies in the closed triangle in flattened space.
  Candidate worst_sample(Face f) const {
    const std::array<const Node*, 3> n{&node(f, 0), &node(f, 1), &node(f, 2)};
    const auto [left, right] = std::minmax({n[0]->column, n[1]->column, n[2]->column});
    const auto [top, bottom] = std::minmax({n[0]->row, n[1]->row, n[2]->row});
    const double length = std::hypot(right - left, bottom - top);
    const double beyond = grid_.bend_cells * length * length + kRoundingCells;
    const auto first_row = std::max(static_cast<std::int32_t>(std::ceil(top - beyond)), 0);
    const auto last_row =
        std::min(static_cast<std::int32_t>(std::floor(bottom + beyond)), grid_.rows - 1);
    Candidate worst;
    for (std::int32_t r = first_row; r <= last_row; ++r) {
      const auto [low, high] = columns_at(n, r, beyond);
      const auto from = std::max(static_cast<std::int32_t>(std::ceil(low)), 0);
      const auto to = std::min(static_cast<std::int32_t>(std::floor(high)), grid_.columns - 1);
      for (std::int32_t c = from; c <= to; ++c) {
        const auto sample = static_cast<std::uint32_t>(grid_.index(c, r));
        if (!may_insert(sample)) continue;
        const Position& p = grid_.positions[sample];
        if (orient2d(n[0]->position, n[1]->position, p) < 0 ||
            orient2d(n[1]->position, n[2]->position, p) < 0 ||
            orient2d(n[2]->position, n[0]->position, p) < 0)
          continue;
        worst.consider(error_at_m(n[0]->position, n[1]->position, n[2]->position, p), sample);
      }
    }
    return worst;
  }

  /// Columns that a triangle, grown by `beyond` cells, may take on a row; low > high for none.
  static std::pair<double, double> columns_at(const std::array<const Node*, 3>& n, double row,
                                              double beyond) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < 3; ++i) {
      const Node &p = *n[i], &q = *n[(i + 1) % 3];
      const double from = std::max(std::min(p.row, q.row), row - beyond);
      const double to = std::min(std::max(p.row, q.row), row + beyond);
      if (from > to) continue;
      for (const double r : {from, to}) {
        const double t = p.row == q.row ? 0 : (r - p.row) / (q.row - p.row);
        const double c = p.column + t * (q.column - p.column);
        low = std::min(low, c);
        high = std::max(high, c);
        if (p.row != q.row) continue;
        low = std::min({low, p.column, q.column});
        high = std::max({high, p.column, q.column});
      }
    }
    return {low - beyond, high + beyond};
  }

  /// Worst crossing of a mesh edge with the grid lines and diagonals of cells that no building
  /// touches and whose four corners are not all vertices.
  void worst_crossing(const Node& a, const Node& b, Candidate& worst) const {
    walk(a, b, [&](double column, double row) {
      look_at_cell(a, b, static_cast<std::int32_t>(column), static_cast<std::int32_t>(row), worst);
    });
  }

  void look_at_cell(const Node& a, const Node& b, std::int32_t c, std::int32_t r,
                    Candidate& worst) const {
    if (!ground_(c, r) || touched_[grid_.index(c, r)]) return;
    const auto nw = static_cast<std::uint32_t>(grid_.index(c, r));
    const std::uint32_t ne = nw + 1, sw = nw + static_cast<std::uint32_t>(grid_.columns);
    const std::uint32_t se = sw + 1;
    std::uint32_t free = kNoSample;
    for (const std::uint32_t corner : {nw, ne, sw, se}) {
      if (walls_.covered[corner]) return;
      if (!is_vertex_[corner] && free == kNoSample) free = corner;
    }
    if (free == kNoSample) return;  // resolved: no more can be known
    const auto look = [&](std::uint32_t p, std::uint32_t q) {
      const double error_m =
          crossing_error_m(a.position, b.position, grid_.positions[p], grid_.positions[q]);
      if (!(error_m > worst.error_m)) return;
      worst = {error_m, !is_vertex_[p] ? p : !is_vertex_[q] ? q : free};
    };
    look(nw, ne);
    look(sw, se);
    look(nw, sw);
    look(ne, se);
    look(nw, se);
    look(ne, sw);
  }

  /// Vertical distance of two segments where they cross in the plane, 0 where they do not.
  static double crossing_error_m(const Position& a, const Position& b, const Position& p,
                                 const Position& q) {
    const double side_p = side(a, b, p), side_q = side(a, b, q);
    const double side_a = side(p, q, a), side_b = side(p, q, b);
    if (side_p * side_q >= 0 || side_a * side_b > 0 || side_a == side_b) return 0;
    const double along_pq = side_p / (side_p - side_q), along_ab = side_a / (side_a - side_b);
    return std::abs((p.z_m - a.z_m) + along_pq * (q.z_m - p.z_m) - along_ab * (b.z_m - a.z_m));
  }

  void refine() {
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end());
      const HeapEntry entry = heap_.back();
      heap_.pop_back();
      if (entry.face->info().stamp != entry.stamp) continue;
      if (is_vertex_[entry.sample]) {  // inserted for another face: look again
        scan(entry.face);
        continue;
      }
      is_vertex_[entry.sample] = 1;
      nodes_.push_back(node_of_sample(entry.sample));
      const auto v = cdt_.insert(point(nodes_.back()), entry.face);
      v->info() = static_cast<std::uint32_t>(nodes_.size() - 1);
      Triangulation::Face_circulator f = cdt_.incident_faces(v), first = f;
      do {
        scan(f);
      } while (++f != first);
      if (entry.face->info().stamp == entry.stamp) scan(entry.face);
    }
  }

  // The result.

  Mesh result() {
    Mesh mesh;
    std::vector<std::uint32_t> order(nodes_.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(nodes_[a].sample, a) < std::pair(nodes_[b].sample, b);
    });
    std::vector<VertexIndex> vertex(nodes_.size());
    for (const std::uint32_t i : order) {
      vertex[i] = static_cast<VertexIndex>(mesh.tin.vertices.size());
      mesh.tin.vertices.push_back(nodes_[i].position);
      mesh.sample_of_vertex.push_back(
          nodes_[i].sample == kNoSample ? -1 : static_cast<std::int64_t>(nodes_[i].sample));
    }
    for (const Face f : cdt_.finite_face_handles()) {
      const FaceInfo& info = f->info();
      if (!info.ground) continue;
      if (turns_over(f))
        throw Error(ErrorCode::kInput,
                    "mesh: a triangle beside a building turns over, because the grid bends by " +
                        std::to_string(grid_.bend_cells) +
                        " cells over one cell; much less is wanted; resample the raster to finer "
                        "cells");
      mesh.error_at_samples_m = std::max(mesh.error_at_samples_m, info.sample_error_m);
      mesh.error_over_surface_m =
          std::max({mesh.error_over_surface_m, info.sample_error_m, info.edge_error_m});
      std::array<VertexIndex, 3> t{vertex[f->vertex(0)->info()], vertex[f->vertex(1)->info()],
                                   vertex[f->vertex(2)->info()]};
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      mesh.tin.triangles.push_back(t);
    }
    std::sort(mesh.tin.triangles.begin(), mesh.tin.triangles.end());
    connect_neighbours(mesh.tin);
    mesh.cell_ambiguity_m = cell_ambiguity_m();
    return mesh;
  }

  double cell_ambiguity_m() const {
    double worst_m = 0;
    for (std::int32_t r = 0; r + 1 < grid_.rows; ++r) {
      for (std::int32_t c = 0; c + 1 < grid_.columns; ++c) {
        const std::size_t nw = grid_.index(c, r), sw = grid_.index(c, r + 1);
        if (is_vertex_[nw] && is_vertex_[nw + 1] && is_vertex_[sw] && is_vertex_[sw + 1] &&
            ground_(c, r))
          worst_m =
              std::max(worst_m, crossing_error_m(grid_.positions[nw], grid_.positions[sw + 1],
                                                 grid_.positions[nw + 1], grid_.positions[sw]));
      }
    }
    return worst_m;
  }

  /// Rounding to the lattice may take a sample across an edge; far more than that, in cells.
  static constexpr double kRoundingCells = 0x1p-10;

  const SampleGrid& grid_;
  const WallsAndRoofs& walls_;
  const GroundCells ground_;
  const SamplePlane plane_;
  double goal_m_ = 0;
  bool with_edges_ = false;
  Triangulation cdt_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_of_ground_vertex_;  // kNone where a building covers it
  std::uint32_t first_corner_ = 0;
  std::vector<std::uint8_t> is_vertex_;  // [samples]
  std::vector<std::uint8_t> touched_;    // [samples] the cell with that upper left
  std::vector<HeapEntry> heap_;
  std::uint32_t last_stamp_ = 0;
};

}  // namespace

Mesh mesh_with_walls(const SampleGrid& grid, const MeshOptions& options, const WallsAndRoofs& walls,
                     const Progress& progress) {
  constexpr double kShareOfGround = 0.7;
  const Mesh ground_mesh = mesh_samples(grid, options, [&](double done) {
    if (progress) progress(walls.buildings == 0 ? done : kShareOfGround * done);
  });
  if (walls.buildings == 0) return ground_mesh;
  const bool by_error = options.max_error_m.has_value();
  Mesh mesh =
      WallMesher(grid, walls)
          .run(ground_mesh, by_error ? *options.max_error_m : ground_mesh.error_at_samples_m,
               by_error && options.bound == MeshBound::kSurface, progress);
  if (progress) progress(1);
  return mesh;
}

}  // namespace scarp
