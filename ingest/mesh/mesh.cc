// Greedy insertion (Garland and Heckbert 1995, "Fast polygonal approximation of terrains and height
// fields") into CGAL's constrained Delaunay triangulation. The only file that sees CGAL.
#include "ingest/mesh/mesh.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Triangulation_data_structure_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/spatial_sort.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

#include "core/error/error.h"
#include "core/geodesy/predicates.h"
#include "ingest/mesh/cell_walk.h"
#include "ingest/mesh/ground.h"
#include "ingest/mesh/height_plane.h"
#include "ingest/mesh/plane_traits.h"
#include "ingest/mesh/tile_mesh.h"

namespace scarp {
namespace {

struct FaceInfo {
  double sample_error_m = 0;
  double edge_error_m = 0;  // along the edges that the face owns
  std::uint32_t stamp = 0;  // new with every scan: CGAL reuses faces in place
  bool ground = false;
};

using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<GridNode, PlaneTraits>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<
    PlaneTraits, CGAL::Triangulation_face_base_with_info_2<FaceInfo, PlaneTraits>>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
    PlaneTraits, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_requiring_constructions_tag>;
using WithoutFlips = Triangulation::Ctr;
using Face = Triangulation::Face_handle;
using Vertex = Triangulation::Vertex_handle;
using Point = PlaneTraits::Point_2;

/// What an entry of the heap asks for, in the upper bits of its target.
constexpr std::uint32_t kInsertSample = 0;        // the sample itself
constexpr std::uint32_t kResolveCell = 1U << 30;  // a corner of the cell with that upper left
constexpr std::uint32_t kRepairShape = 2U << 30;  // the sample, whatever its error
constexpr std::uint32_t kTargetMask = (1U << 30) - 1;

/// The worst place of a face.
struct Candidate {
  double error_m = 0;
  std::uint32_t target = 0;
};

struct HeapEntry {
  double error_m;
  std::uint32_t target;
  std::uint32_t stamp;
  Face face;

  /// The heap's top is the greatest error, on ties the lowest sample.
  bool operator<(const HeapEntry& other) const {
    return error_m != other.error_m ? error_m < other.error_m : target > other.target;
  }
};

/// Whether all samples lie exactly on straight, evenly spaced grid lines. Then the sample plane and
/// the flattened plane are affine images of each other and nothing needs to be tested for bending.
bool is_exactly_affine(const SampleGrid& grid, const GroundCells& ground) {
  if (grid.bend_cells != 0) return false;
  bool found = false;
  Position o, across, down;
  std::int32_t column0 = 0, row0 = 0;
  for (std::int32_t r = 0; r + 1 < grid.rows && !found; ++r) {
    for (std::int32_t c = 0; c + 1 < grid.columns && !found; ++c) {
      if (!ground(c, r)) continue;
      found = true;
      column0 = c;
      row0 = r;
      o = grid.at(c, r), across = grid.at(c + 1, r), down = grid.at(c, r + 1);
    }
  }
  const double ax = across.x_m - o.x_m, ay = across.y_m - o.y_m;
  const double bx = down.x_m - o.x_m, by = down.y_m - o.y_m;
  for (std::int32_t r = 0; r < grid.rows; ++r) {
    for (std::int32_t c = 0; c < grid.columns; ++c) {
      if (!grid.is_known(c, r)) continue;
      const Position& p = grid.at(c, r);
      const double i = c - column0, j = r - row0;
      if (p.x_m - o.x_m != i * ax + j * bx || p.y_m - o.y_m != i * ay + j * by) return false;
    }
  }
  return true;
}

class GreedyMesher {
 public:
  GreedyMesher(const SampleGrid& grid, const SampleRange& range, const MeshOptions& options,
               const Progress& progress);
  Mesh run();

 private:
  // Places.
  Point point(const GridNode& n) const {
    return {static_cast<double>(plane_.x(n)), static_cast<double>(plane_.y(n))};
  }
  GridNode node_of(const Point& p) const {
    return {static_cast<std::int32_t>(p.x() / plane_.step_x),
            static_cast<std::int32_t>(-p.y() / plane_.step_y)};
  }
  std::uint32_t index(const GridNode& n) const {
    return static_cast<std::uint32_t>(n.row) * static_cast<std::uint32_t>(grid_.columns) +
           static_cast<std::uint32_t>(n.column);
  }
  GridNode node_at(std::uint32_t sample) const {
    const auto columns = static_cast<std::uint32_t>(grid_.columns);
    return {static_cast<std::int32_t>(sample % columns),
            static_cast<std::int32_t>(sample / columns)};
  }
  const Position& position(const GridNode& n) const { return grid_.positions[index(n)]; }
  static const GridNode& corner(Face f, int i) { return f->vertex(i)->info(); }
  bool is_vertex(std::uint32_t sample) const { return vertex_of_sample_[sample] != kNone; }
  /// Whether all corners of a cell are vertices: no more can be known of the ground there.
  bool is_resolved(const GridNode& cell) const {
    const std::uint32_t upper = index(cell);
    const std::uint32_t lower = upper + static_cast<std::uint32_t>(grid_.columns);
    return is_vertex(upper) && is_vertex(upper + 1) && is_vertex(lower) && is_vertex(lower + 1);
  }
  /// Whether a sample is kept out for the tile beyond the edge that it lies on.
  bool is_locked(std::uint32_t sample) const { return !locked_.empty() && locked_[sample]; }
  bool is_insertable(const GridNode& n) const {
    return !is_vertex(index(n)) && !is_locked(index(n));
  }
  /// Whether nothing is left to be inserted that would help a cell.
  bool is_settled(const GridNode& cell) const {
    return is_resolved(cell) || (!settled_.empty() && settled_.contains(index(cell)));
  }
  bool is_ground(Face f) const;
  double bend_cells_over(double length_cells) const {
    return affine_ ? 0 : grid_.bend_cells * length_cells * length_cells + rounding_cells_;
  }

  // The triangulation.
  void insert_border();
  void insert_sample(const GridNode& n, Face near);
  void make_delaunay_around(Vertex v);
  void insert_until(double goal_m, std::uint32_t budget);
  void obey(const HeapEntry& entry);
  void push(const HeapEntry& entry);

  // Errors.
  void scan(Face f);
  Candidate worst_sample(const std::array<GridNode, 3>& n, Face f) const;
  double split_error_m(const GridNode& a, const GridNode& b, const GridNode& c,
                       const GridNode& d) const;
  Candidate worst_crossing(Face f) const;
  Candidate worst_crossing_of_edge(Face f, int i) const;
  Candidate worst_crossing_in_box(const GridNode& a, const GridNode& b) const;
  bool belongs(Face f, const GridNode& n) const;
  std::optional<GridNode> shape_repair(Face f) const;
  std::pair<GridNode, Face> worst_corner(const GridNode& cell, Face near) const;
  std::optional<GridNode> beside_locked(const GridNode& cell) const;
  GridNode cell_beside(const GridNode& locked) const;

  // The result.
  void measure_all_edges();
  void tell(double done) {
    told_ = std::max(told_, done);
    if (progress_) progress_(told_);
  }
  Mesh result();
  void copy_triangles(Mesh& mesh);
  double cell_ambiguity_m() const;

  const SampleGrid& grid_;
  const SampleRange range_;
  const MeshOptions& options_;
  const Progress& progress_;
  GroundCells ground_;
  SamplePlane plane_;
  bool affine_;
  double rounding_cells_;  // how far rounding to the lattice moves samples against each other
  Triangulation cdt_;
  std::vector<VertexIndex> vertex_of_sample_;  // kNone where the sample is no vertex
  std::vector<std::uint8_t> locked_;           // [samples], empty where there are none
  std::unordered_set<std::uint32_t> settled_;  // cells beside locked samples
  std::vector<HeapEntry> heap_;
  std::vector<Face> open_;  // faces around a new vertex, still to be tested
  double goal_m_ = 0;
  bool with_edges_ = false;  // crossings count, too
  std::uint32_t last_stamp_ = 0;
  double told_ = 0;  // progress must not fall
};

GreedyMesher::GreedyMesher(const SampleGrid& grid, const SampleRange& range,
                           const MeshOptions& options, const Progress& progress)
    : grid_(grid),
      range_(range),
      options_(options),
      progress_(progress),
      ground_(grid, range),
      plane_(sample_plane_of(grid)),
      affine_(is_exactly_affine(grid, ground_)),
      // A sample moves by at most half a step in x and in y, and so does the chord's end.
      rounding_cells_(std::sqrt(2.0) * kLatticeStepM / std::min(grid.cell_x_m, grid.cell_y_m)),
      vertex_of_sample_(grid.positions.size(), kNone) {}

bool GreedyMesher::is_ground(Face f) const {
  if (cdt_.is_infinite(f)) return false;
  // No border runs through a face, so the cell that holds its centroid answers for all of it; a
  // centroid on a grid line has the face on both sides.
  const GridNode &a = corner(f, 0), &b = corner(f, 1), &c = corner(f, 2);
  return ground_((a.column + b.column + c.column) / 3, (a.row + b.row + c.row) / 3);
}

/// Puts the border of the ground in as constraints. This is the place for further constraints,
/// such as building outlines: they would be inserted here, with heights of their own.
void GreedyMesher::insert_border() {
  const TileBorder border =
      tile_border(grid_, ground_, range_, options_.max_error_m.value_or(0), options_.bound);
  const std::vector<BorderRun>& runs = border.runs;
  std::vector<Point> ends;
  for (const BorderRun& run : runs) {
    for (const GridNode& n : {run.from, run.to}) {
      if (is_vertex(index(n))) continue;
      vertex_of_sample_[index(n)] = 0;
      ends.push_back(point(n));
    }
  }
  CGAL::spatial_sort(ends.begin(), ends.end(), PlaneTraits());
  std::vector<Vertex> vertices(ends.size());
  Face near;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    vertices[i] = cdt_.insert(ends[i], near);
    vertices[i]->info() = node_of(ends[i]);
    vertex_of_sample_[index(vertices[i]->info())] = static_cast<VertexIndex>(i);
    near = vertices[i]->face();
  }
  if (!border.locked.empty()) locked_.assign(vertex_of_sample_.size(), 0);
  for (const GridNode& n : border.locked) locked_[index(n)] = 1;
  for (const BorderRun& run : runs)
    cdt_.insert_constraint(vertices[vertex_of_sample_[index(run.from)]],
                           vertices[vertex_of_sample_[index(run.to)]]);
}

/// Inserts a sample that lies in or near a face and scans the faces that this makes.
void GreedyMesher::insert_sample(const GridNode& n, Face near) {
  const Point p = point(n);
  const PlaneTraits::Orientation_2 side;
  Triangulation::Locate_type type = Triangulation::FACE;
  int on_edge = 0;
  bool inside = true;
  for (int i = 0; i < 3; ++i) {
    const auto s = side(near->vertex(CGAL::Triangulation_cw_ccw_2::ccw(i))->point(),
                        near->vertex(CGAL::Triangulation_cw_ccw_2::cw(i))->point(), p);
    if (s == CGAL::NEGATIVE) inside = false;
    if (s == CGAL::ZERO) {
      type = Triangulation::EDGE;
      on_edge = i;
    }
  }
  if (!inside) near = cdt_.locate(p, type, on_edge, near);
  assert(type == Triangulation::FACE || type == Triangulation::EDGE);
  const Vertex v = cdt_.WithoutFlips::insert(p, type, near, on_edge);
  v->info() = n;
  v->info() = n;
  vertex_of_sample_[index(n)] = 0;
  make_delaunay_around(v);
  Triangulation::Face_circulator f = cdt_.incident_faces(v), first = f;
  do {
    scan(f);
  } while (++f != first);
}

/// Flips what the new vertex v has in its circle. CGAL's own insertion would do it, but it also
/// settles four points on one circle by a fixed rule. On a grid these are common, and both
/// diagonals are Delaunay: taking the one with the lesser error saves 3 to 8 % of the triangles.
void GreedyMesher::make_delaunay_around(Vertex v) {
  const PlaneTraits::Side_of_oriented_circle_2 side_of_circle;
  open_.clear();
  Triangulation::Face_circulator around = cdt_.incident_faces(v), first = around;
  do {
    open_.push_back(around);
  } while (++around != first);
  while (!open_.empty()) {
    Face f = open_.back();
    const int i = f->index(v);
    const Face across = f->neighbor(i);
    if (f->is_constrained(i) || cdt_.is_infinite(f) || cdt_.is_infinite(across)) {
      open_.pop_back();
      continue;
    }
    const Vertex d = cdt_.mirror_vertex(f, i);
    const auto side = side_of_circle(f->vertex(0)->point(), f->vertex(1)->point(),
                                     f->vertex(2)->point(), d->point());
    bool flips = side == CGAL::ON_POSITIVE_SIDE;
    if (side == CGAL::ON_ORIENTED_BOUNDARY && is_ground(f)) {
      const GridNode &a = corner(f, cdt_.ccw(i)), &b = corner(f, cdt_.cw(i));
      flips = split_error_m(v->info(), a, d->info(), b) < split_error_m(a, d->info(), b, v->info());
    }
    if (!flips) {
      open_.pop_back();
      continue;
    }
    cdt_.flip(f, i);
    open_.push_back(across);
  }
}

/// Greatest error at a sample of the quadrilateral a, b, c, d cut from a to c.
double GreedyMesher::split_error_m(const GridNode& a, const GridNode& b, const GridNode& c,
                                   const GridNode& d) const {
  return std::max(worst_sample({a, b, c}, Face()).error_m, worst_sample({a, c, d}, Face()).error_m);
}

void GreedyMesher::push(const HeapEntry& entry) {
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end());
}

/// Inserts until no face has an error above the goal, or the budget is used up and all faces are
/// sound (those to repair are on top of the heap).
void GreedyMesher::insert_until(double goal_m, std::uint32_t budget) {
  std::size_t turns = 0;
  while (!heap_.empty() &&
         (cdt_.number_of_vertices() < budget || std::isinf(heap_.front().error_m))) {
    // Stale entries of low rank stay behind; they must not outgrow the triangulation.
    if (heap_.size() > 4 * cdt_.tds().faces().size() + 1024) {
      std::erase_if(heap_, [](const HeapEntry& e) { return e.face->info().stamp != e.stamp; });
      std::make_heap(heap_.begin(), heap_.end());
      if (heap_.empty()) break;
    }
    std::pop_heap(heap_.begin(), heap_.end());
    const HeapEntry entry = heap_.back();
    heap_.pop_back();
    if (entry.face->info().stamp != entry.stamp) continue;
    if (++turns % 16384 == 0) {
      tell(options_.vertex_budget ? double(cdt_.number_of_vertices()) / budget
                                  : (with_edges_ ? 0.9 : 0.8 * goal_m / entry.error_m));
    }
    obey(entry);
  }
}

void GreedyMesher::obey(const HeapEntry& entry) {
  GridNode n = node_at(entry.target & kTargetMask);
  Face near = entry.face;
  if ((entry.target & ~kTargetMask) == kResolveCell) {
    const GridNode cell = n;
    std::tie(n, near) = worst_corner(cell, near);
    if (near == Face()) {  // resolved in the meantime, or as far as it can be
      if (!is_resolved(cell)) settled_.insert(index(cell));
      return scan(entry.face);
    }
  }
  if (is_vertex(index(n))) return scan(near);
  insert_sample(n, near);
  // The place may be as bad as before where the new star does not reach it.
  if (entry.face->info().stamp == entry.stamp) scan(entry.face);
}

/// Of the corners of a cell that are no vertices yet, the one with the greatest error of its own,
/// on ties the first in reading order, and the face that it lies in.
std::pair<GridNode, Face> GreedyMesher::worst_corner(const GridNode& cell, Face near) const {
  std::pair<GridNode, Face> worst{cell, Face()};
  double worst_m = -1;
  for (const int dr : {0, 1}) {
    for (const int dc : {0, 1}) {
      const GridNode n{cell.column + dc, cell.row + dr};
      if (!is_insertable(n)) continue;
      const Face f = cdt_.locate(point(n), near);
      double error_m = 0;
      if (!cdt_.is_infinite(f))
        error_m =
            HeightPlane(position(corner(f, 0)), position(corner(f, 1)), position(corner(f, 2)))
                .error_m(position(n));
      if (error_m > worst_m) {
        worst_m = error_m;
        worst = {n, f};
      }
    }
  }
  if (worst.second == Face())
    if (const auto n = beside_locked(cell)) worst = {*n, cdt_.locate(point(*n), near)};
  return worst;
}

/// Where a cell has a locked corner, the error can come from samples further along the edge that
/// are no vertices yet: of those beside the same piece of the edge, the nearest to the cell.
std::optional<GridNode> GreedyMesher::beside_locked(const GridNode& cell) const {
  for (const int dr : {0, 1}) {
    for (const int dc : {0, 1}) {
      const GridNode n{cell.column + dc, cell.row + dr};
      if (!is_locked(index(n))) continue;
      const bool by_column = n.column == range_.first.column || n.column == range_.last.column;
      const GridNode inwards{by_column ? 1 - 2 * dc : 0, by_column ? 0 : 1 - 2 * dr};
      std::array<bool, 2> goes_on = {true, true};
      for (std::int32_t away = 0; goes_on[0] || goes_on[1]; ++away) {
        for (const int way : {0, 1}) {
          if (!goes_on[static_cast<std::size_t>(way)]) continue;
          const std::int32_t along = way == 0 ? away : -away;
          const GridNode on{n.column + (by_column ? 0 : along), n.row + (by_column ? along : 0)};
          goes_on[static_cast<std::size_t>(way)] = is_locked(index(on));
          const GridNode inner{on.column + inwards.column, on.row + inwards.row};
          if (is_insertable(inner)) return inner;
        }
      }
    }
  }
  return {};
}

/// The cell of the tile's ground whose corners are looked at when a locked sample errs.
GridNode GreedyMesher::cell_beside(const GridNode& locked) const {
  return {std::min(locked.column, range_.last.column - 1),
          std::min(locked.row, range_.last.row - 1)};
}

/// Finds the worst place of a face and puts it on the heap where it is above the goal.
void GreedyMesher::scan(Face f) {
  FaceInfo& info = f->info();
  info = {0, 0, ++last_stamp_, is_ground(f)};
  if (!info.ground) return;
  if (!affine_) {
    if (const auto n = shape_repair(f)) {
      push({std::numeric_limits<double>::infinity(), index(*n) | kRepairShape, info.stamp, f});
      return;
    }
  }
  Candidate worst = worst_sample({corner(f, 0), corner(f, 1), corner(f, 2)}, f);
  info.sample_error_m = worst.error_m;
  if (with_edges_) {
    const Candidate edge = worst_crossing(f);
    info.edge_error_m = edge.error_m;
    if (edge.error_m > worst.error_m) worst = edge;
  }
  if (worst.error_m > goal_m_) push({worst.error_m, worst.target, info.stamp, f});
}

/// The columns of a triangle in one row, from the lines of its edges.
struct EdgeColumns {
  double at_row0 = 0;  // column of the edge's line at the first row
  double per_row = 0;
  double widen = 0;  // columns by which the flattened edge may lie beside it
  int bounds = 0;    // +1 from the left, -1 from the right, 0 a grid row
};

/// The worst sample of a triangle of the sample plane; with its face, of the triangle in flattened
/// space, which differs where the grid bends.
Candidate GreedyMesher::worst_sample(const std::array<GridNode, 3>& n, Face f) const {
  const HeightPlane plane(position(n[0]), position(n[1]), position(n[2]));
  const std::int32_t top = std::min({n[0].row, n[1].row, n[2].row});
  const std::int32_t bottom = std::max({n[0].row, n[1].row, n[2].row});
  const bool straight = affine_ || f == Face();
  double bend = 0;
  std::array<EdgeColumns, 3> edges;
  for (std::size_t i = 0; i < 3; ++i) {
    const GridNode &p = n[i], &q = n[i == 2 ? 0 : i + 1];
    const double dc = q.column - p.column, dr = q.row - p.row;
    if (!straight) bend = std::max(bend, bend_cells_over(std::hypot(dc, dr)));
    if (dr == 0) continue;
    edges[i].per_row = dc / dr;
    edges[i].at_row0 = p.column + (top - p.row) * edges[i].per_row;
    edges[i].bounds = dr > 0 ? 1 : -1;
  }
  const auto beyond = static_cast<std::int32_t>(bend);  // 0 for all but very long edges
  if (!straight) {
    for (EdgeColumns& e : edges) e.widen = bend * std::hypot(1.0, e.per_row);
  }
  // A column is a fraction with a denominator below 2^20, computed to 2^-30: half of the least
  // distance from a whole number lets samples on the edge in and no other.
  constexpr double kOnEdge = 0x1p-21;
  Candidate worst;
  const std::int32_t first = std::max(top - beyond, range_.first.row);
  const std::int32_t last = std::min(bottom + beyond, range_.last.row);
  for (std::int32_t r = first; r <= last; ++r) {
    double low = range_.first.column, high = range_.last.column;
    double inner_low = low, inner_high = high;
    for (const EdgeColumns& e : edges) {
      const double at = e.at_row0 + (r - top) * e.per_row;
      if (e.bounds > 0) {
        low = std::max(low, at - e.widen);
        inner_low = std::max(inner_low, at + e.widen);
      } else if (e.bounds < 0) {
        high = std::min(high, at + e.widen);
        inner_high = std::min(inner_high, at - e.widen);
      }
    }
    const std::int32_t from = static_cast<std::int32_t>(low + (1 - kOnEdge));
    const std::int32_t to = static_cast<std::int32_t>(high + kOnEdge);
    const std::uint32_t row = index({0, r});
    const Position* positions = grid_.positions.data() + row;
    const auto look = [&](std::int32_t c) {
      const double error_m = plane.error_m(positions[c]);
      const std::uint32_t sample = row + static_cast<std::uint32_t>(c);
      if (!(error_m > worst.error_m) || is_vertex(sample)) return;
      if (!is_locked(sample)) {
        worst = {error_m, sample};
      } else if (const GridNode cell = cell_beside({c, r}); !is_settled(cell)) {
        worst = {error_m, index(cell) | kResolveCell};
      }
    };
    if (straight) {
      for (std::int32_t c = from; c <= to; ++c) look(c);
      continue;
    }
    // Rows within the bend of a corner's row may lie beside an edge along a row.
    const bool near_end = r - bend <= top || r + bend >= bottom;
    for (std::int32_t c = from; c <= to; ++c) {
      const bool surely = !near_end && c > inner_low + kOnEdge && c < inner_high - kOnEdge;
      if (surely || belongs(f, {c, r})) look(c);
    }
  }
  return worst;
}

/// Whether a sample lies in the closed triangle in flattened space, or on a border edge that the
/// chord has left behind by its bend.
bool GreedyMesher::belongs(Face f, const GridNode& n) const {
  if (!grid_.is_known(n.column, n.row)) return false;
  bool inside = true;
  for (int i = 0; i < 3; ++i) {
    const GridNode &a = corner(f, cdt_.ccw(i)), &b = corner(f, cdt_.cw(i));
    if (f->is_constrained(i)) {
      const bool on_row = a.row == b.row && n.row == a.row &&
                          (n.column - a.column > 0) != (n.column - b.column > 0);
      const bool on_column = a.column == b.column && n.column == a.column &&
                             (n.row - a.row > 0) != (n.row - b.row > 0);
      if (on_row || on_column) return true;
    }
    if (orient2d(position(a), position(b), position(n)) < 0) inside = false;
  }
  return inside;
}

/// A sample near the middle of the longest edge of a face that bending makes nearly flat or turns
/// over in flattened space; nothing where the face is sound or no such sample is left.
std::optional<GridNode> GreedyMesher::shape_repair(Face f) const {
  double longest_cells = 0, longest_m = 0;
  int longest = 0;
  for (int i = 0; i < 3; ++i) {
    const GridNode &a = corner(f, cdt_.ccw(i)), &b = corner(f, cdt_.cw(i));
    const double cells = std::hypot(b.column - a.column, b.row - a.row);
    if (cells > longest_cells) {
      longest_cells = cells;
      longest = i;
    }
    const Position &p = position(a), &q = position(b);
    longest_m = std::max(longest_m, std::hypot(q.x_m - p.x_m, q.y_m - p.y_m));
  }
  const Position &p = position(corner(f, 0)), &q = position(corner(f, 1)),
                 &o = position(corner(f, 2));
  const double area_m2 = (q.x_m - p.x_m) * (o.y_m - p.y_m) - (q.y_m - p.y_m) * (o.x_m - p.x_m);
  const double bend_m = bend_cells_over(longest_cells) * std::max(grid_.cell_x_m, grid_.cell_y_m);
  constexpr double kLeastHeightInBends = 1;  // four times what a chord strays, bend L^2 / 4
  if (area_m2 >= kLeastHeightInBends * bend_m * longest_m) return {};

  const GridNode &a = corner(f, cdt_.ccw(longest)), &b = corner(f, cdt_.cw(longest));
  const double middle_column = 0.5 * (a.column + b.column), middle_row = 0.5 * (a.row + b.row);
  std::optional<GridNode> nearest;
  double nearest_cells = std::numeric_limits<double>::infinity();
  const std::int32_t c0 = (a.column + b.column) / 2, r0 = (a.row + b.row) / 2;
  for (std::int32_t r = r0; r <= std::min(r0 + 1, grid_.rows - 1); ++r) {
    for (std::int32_t c = c0; c <= std::min(c0 + 1, grid_.columns - 1); ++c) {
      const double away = std::hypot(c - middle_column, r - middle_row);
      if (away >= nearest_cells || !is_insertable({c, r}) || !ground_.touches({c, r})) continue;
      nearest_cells = away;
      nearest = GridNode{c, r};
    }
  }
  return nearest;
}

/// Worst crossing of the edges that a face owns: an edge belongs to the face in which it runs from
/// the lower to the higher sample. Border edges need no look: the samples along them are compared
/// with the planes of their faces on both sides of the chord, and between those the difference is
/// linear.
Candidate GreedyMesher::worst_crossing(Face f) const {
  Candidate worst;
  for (int i = 0; i < 3; ++i) {
    const bool owned = index(corner(f, cdt_.ccw(i))) < index(corner(f, cdt_.cw(i)));
    if (!owned || f->is_constrained(i)) continue;
    const Candidate edge = worst_crossing_of_edge(f, i);
    if (edge.error_m > worst.error_m ||
        (edge.error_m == worst.error_m && edge.target < worst.target))
      worst = edge;
  }
  return worst;
}

Candidate GreedyMesher::worst_crossing_of_edge(Face f, int i) const {
  const GridNode a = corner(f, cdt_.ccw(i)), b = corner(f, cdt_.cw(i));
  const std::int32_t dc = b.column - a.column, dr = b.row - a.row;
  // One grid edge is the ground itself; so is, without bending, every edge along a grid line.
  if (std::abs(dc) + std::abs(dr) == 1 || (affine_ && (dc == 0 || dr == 0))) return {};
  const Position &pa = position(a), &pb = position(b);
  Candidate worst;
  const auto look = [&](const GridNode& p, const GridNode& q, std::int32_t column,
                        std::int32_t row) {
    const double error_m = crossing_error_m(pa, pb, position(p), position(q));
    if (error_m > worst.error_m && !is_settled({column, row}))
      worst = {error_m, index({column, row}) | kResolveCell};
  };
  if (affine_) {
    const auto side = [&](const GridNode& n) {
      return std::int64_t{dr} * (n.column - a.column) - std::int64_t{dc} * (n.row - a.row);
    };
    [[maybe_unused]] const bool arrived = walk_cells(
        a, b, side, [](std::int32_t, std::int32_t) { return true; }, look);
    assert(arrived);
    return worst;
  }
  const auto side = [&](const GridNode& n) {
    if (n.column < 0 || n.row < 0 || n.column >= grid_.columns || n.row >= grid_.rows)
      return std::numeric_limits<double>::quiet_NaN();  // on no side, so never chosen
    return static_cast<double>(orient2d(pa, pb, position(n)));
  };
  // Beside the border an edge can leave the ground by its bend.
  return walk_cells(a, b, side, ground_, look) ? worst : worst_crossing_in_box(a, b);
}

/// As above, for an edge that leaves the ground on its way: all cells around are tried.
Candidate GreedyMesher::worst_crossing_in_box(const GridNode& a, const GridNode& b) const {
  const Position &pa = position(a), &pb = position(b);
  Candidate worst;
  const auto look = [&](const GridNode& p, const GridNode& q, std::uint32_t cell) {
    const Position &pp = position(p), &pq = position(q);
    if (orient2d(pa, pb, pp) * orient2d(pa, pb, pq) >= 0) return;
    if (orient2d(pp, pq, pa) * orient2d(pp, pq, pb) > 0) return;
    const double error_m = crossing_error_m(pa, pb, pp, pq);
    if (error_m > worst.error_m) worst = {error_m, cell | kResolveCell};
  };
  const auto [left, right] = std::minmax(a.column, b.column);
  const auto [top, bottom] = std::minmax(a.row, b.row);
  for (std::int32_t r = top - 1; r <= bottom; ++r) {
    for (std::int32_t c = left - 1; c <= right; ++c) {
      if (!ground_(c, r)) continue;
      const GridNode nw{c, r}, ne{c + 1, r}, sw{c, r + 1}, se{c + 1, r + 1};
      const std::uint32_t cell = index(nw);
      if (is_settled(nw)) continue;
      look(nw, ne, cell);
      look(sw, se, cell);
      look(nw, sw, cell);
      look(ne, se, cell);
      look(nw, se, cell);
      look(ne, sw, cell);
    }
  }
  return worst;
}

void GreedyMesher::measure_all_edges() {
  with_edges_ = true;
  for (const Face f : cdt_.finite_face_handles()) {
    FaceInfo& info = f->info();
    if (!info.ground) continue;
    const Candidate edge = worst_crossing(f);
    info.edge_error_m = edge.error_m;
    if (options_.max_error_m && options_.bound == MeshBound::kSurface && edge.error_m > goal_m_)
      push({edge.error_m, edge.target, info.stamp, f});
  }
}

double GreedyMesher::cell_ambiguity_m() const {
  double worst_m = 0;
  for (std::int32_t r = 0; r + 1 < grid_.rows; ++r) {
    for (std::int32_t c = 0; c + 1 < grid_.columns; ++c) {
      if (ground_(c, r) && is_resolved({c, r}))
        worst_m = std::max(worst_m, crossing_error_m(grid_.at(c, r), grid_.at(c + 1, r + 1),
                                                     grid_.at(c + 1, r), grid_.at(c, r + 1)));
    }
  }
  return worst_m;
}

/// Ground triangles by their lowest vertex, which comes first in each; the order does not depend on
/// how CGAL keeps its faces.
void GreedyMesher::copy_triangles(Mesh& mesh) {
  const auto vertex = [&](Face f, int i) { return vertex_of_sample_[index(corner(f, i))]; };
  const auto lowest = [&](Face f) {
    const VertexIndex a = vertex(f, 0), b = vertex(f, 1), c = vertex(f, 2);
    return a < b ? (a < c ? 0 : 2) : (b < c ? 1 : 2);
  };
  std::vector<std::uint32_t> begin(mesh.tin.vertices.size() + 1, 0);
  for (const Face f : cdt_.finite_face_handles())
    if (f->info().ground) ++begin[vertex(f, lowest(f)) + 1];
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<Face> faces(begin.back());
  std::vector<std::uint32_t> filled(begin.begin(), begin.end() - 1);
  for (const Face f : cdt_.finite_face_handles())
    if (f->info().ground) faces[filled[vertex(f, lowest(f))]++] = f;
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
    std::sort(faces.begin() + begin[v], faces.begin() + begin[v + 1], [&](Face f, Face g) {
      return vertex(f, cdt_.ccw(lowest(f))) < vertex(g, cdt_.ccw(lowest(g)));
    });
  }
  for (std::uint32_t t = 0; t < faces.size(); ++t) faces[t]->info().stamp = t;
  mesh.tin.triangles.resize(faces.size());
  mesh.tin.neighbours.resize(faces.size());
  for (std::size_t t = 0; t < faces.size(); ++t) {
    const int turn = lowest(faces[t]);
    for (int k = 0; k < 3; ++k) {
      const int i = (k + turn) % 3;
      const Face across = faces[t]->neighbor(i);
      mesh.tin.triangles[t][static_cast<std::size_t>(k)] = vertex(faces[t], i);
      mesh.tin.neighbours[t][static_cast<std::size_t>(k)] =
          across->info().ground ? across->info().stamp : kNone;
    }
  }
}

Mesh GreedyMesher::result() {
  Mesh mesh;
  mesh.tin.vertices.reserve(cdt_.number_of_vertices());
  mesh.sample_of_vertex.reserve(cdt_.number_of_vertices());
  for (std::uint32_t sample = 0; sample < vertex_of_sample_.size(); ++sample) {
    if (!is_vertex(sample)) continue;
    vertex_of_sample_[sample] = static_cast<VertexIndex>(mesh.tin.vertices.size());
    mesh.tin.vertices.push_back(grid_.positions[sample]);
    mesh.sample_of_vertex.push_back(sample);
  }
  if (!settled_.empty()) {
    settled_.clear();
    for (const Face f : cdt_.finite_face_handles()) {
      if (!f->info().ground) continue;
      f->info().sample_error_m =
          worst_sample({corner(f, 0), corner(f, 1), corner(f, 2)}, f).error_m;
      f->info().edge_error_m = worst_crossing(f).error_m;
    }
  }
  for (const Face f : cdt_.finite_face_handles()) {
    if (!f->info().ground) continue;
    if (!affine_ &&
        orient2d(position(corner(f, 0)), position(corner(f, 1)), position(corner(f, 2))) <= 0)
      throw Error(
          ErrorCode::kInput,
          "mesh: a triangle of neighbouring samples turns over, because the grid bends by " +
              std::to_string(grid_.bend_cells) +
              " cells over one cell; much less is wanted; resample the raster to finer cells");
    mesh.error_at_samples_m = std::max(mesh.error_at_samples_m, f->info().sample_error_m);
    // A corner inserted across one of its edges since may have resolved the cell.
    if (f->info().edge_error_m > mesh.error_over_surface_m)
      mesh.error_over_surface_m = std::max(mesh.error_over_surface_m, worst_crossing(f).error_m);
  }
  mesh.error_over_surface_m = std::max(mesh.error_over_surface_m, mesh.error_at_samples_m);
  mesh.cell_ambiguity_m = cell_ambiguity_m();
  mesh.lost_samples = count_lost_samples(grid_, range_);
  copy_triangles(mesh);
  return mesh;
}

Mesh GreedyMesher::run() {
  if (ground_.count() == 0) {
    Mesh none;
    none.lost_samples = count_lost_samples(grid_, range_);
    return none;
  }
  insert_border();
  goal_m_ = std::max(options_.max_error_m.value_or(0.0), kErrorRoundingM / 2);
  const std::uint32_t budget = options_.vertex_budget.value_or(kNone);
  for (const Face f : cdt_.finite_face_handles()) scan(f);
  insert_until(goal_m_, budget);
  measure_all_edges();
  if (options_.max_error_m && options_.bound == MeshBound::kSurface) insert_until(goal_m_, budget);
  heap_ = {};
  tell(0.95);
  Mesh mesh = result();
  tell(1);
  return mesh;
}

void check_options(const SampleGrid& grid, const MeshOptions& options) {
  assert(options.max_error_m.has_value() != options.vertex_budget.has_value());
  assert(!options.max_error_m || *options.max_error_m >= 0);
  assert(grid.columns <= kMeshReachCells && grid.rows <= kMeshReachCells);
  assert(grid.positions.size() <= kTargetMask);
}

}  // namespace

Mesh mesh_samples(const SampleGrid& grid, const MeshOptions& options, const Progress& progress) {
  check_options(grid, options);
  Mesh mesh = GreedyMesher(grid, all_samples(grid), options, progress).run();
  if (mesh.tin.triangles.empty())
    throw Error(
        ErrorCode::kInput,
        "mesh: no cell of the " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
            " samples has four known corners; at least one is wanted; check the nodata value");
  return mesh;
}

Mesh mesh_tile(const TileScheme& scheme, const TileId& tile, const SampleGrid& window,
               const MeshOptions& options, const Progress& progress) {
  check_options(window, options);
  assert(options.max_error_m.has_value());
  const TileWindow own = scheme.window(tile), with_halo = scheme.window_with_halo(tile);
  assert(window.columns == with_halo.columns && window.rows == with_halo.rows);
  const GridNode first{(own.first_column - with_halo.first_column) / own.stride,
                       (own.first_row - with_halo.first_row) / own.stride};
  const SampleRange range{first, {first.column + own.columns - 1, first.row + own.rows - 1}};
  Mesh mesh = GreedyMesher(window, range, options, progress).run();
  for (std::int64_t& sample : mesh.sample_of_vertex) {
    const std::int64_t column = sample % window.columns, row = sample / window.columns;
    sample = (with_halo.first_row + row * own.stride) * scheme.columns() +
             (with_halo.first_column + column * own.stride);
  }
  return mesh;
}

}  // namespace scarp
