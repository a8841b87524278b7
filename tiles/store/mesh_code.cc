#include "tiles/store/mesh_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>

#include "tiles/store/numbers.h"
#include "tiles/store/position_model.h"

namespace scarp {
namespace {

/// What lies beyond an edge of a known triangle.
enum Gate : std::uint8_t {
  kBorder = 0,    ///< nothing
  kNew = 1,       ///< a vertex that was not met yet
  kNext = 2,      ///< the far end of the open edge that begins where this one ends
  kPrevious = 3,  ///< the near end of the open edge that ends where this one begins
  kKnown = 4,     ///< any other vertex that was met
};

/// Where a vertex is: its sample, in strides from the first column and row, and its height over the
/// least one, in units of the data where they have one.
struct Place {
  std::int64_t column = 0, row = 0;
  std::int64_t height = 0;
};

constexpr std::int64_t kMostColumns = std::int64_t{1} << 31;
constexpr std::int64_t kMostSteps = std::int64_t{1} << 31;
/// Lattice steps in plan from a mesh's lowest coordinate: all that a position can be.
constexpr std::int64_t kMostStepsInPlan = std::int64_t{1} << 40;

constexpr std::size_t kMostTriangles = std::size_t{1} << 30;  // whose edges have numbers

using HalfEdge = std::uint32_t;  // 3 * triangle + the opposite corner

/// Triangles as they are met, and the edges that still have one side only. Vertices are numbered as
/// they are met.
class GrowingMesh {
 public:
  GrowingMesh(std::size_t vertices, std::size_t triangles)
      : from_(vertices, kNone), into_(vertices, kNone) {
    triangles_.reserve(triangles);
    mates_.reserve(3 * triangles);
    next_from_.reserve(3 * triangles);
    next_into_.reserve(3 * triangles);
  }

  std::size_t size() const { return triangles_.size(); }
  const std::array<VertexIndex, 3>& corners(std::size_t t) const { return triangles_[t]; }
  HalfEdge mate(HalfEdge h) const { return mates_[h]; }
  bool is_open(HalfEdge h) const { return mates_[h] == kNone && !is_border(h); }

  VertexIndex opposite(HalfEdge h) const { return triangles_[h / 3][h % 3]; }
  VertexIndex start(HalfEdge h) const { return triangles_[h / 3][(h + 1 - h / 3 * 3) % 3]; }
  VertexIndex end(HalfEdge h) const { return triangles_[h / 3][(h + 2 - h / 3 * 3) % 3]; }

  /// Beyond an edge: the far end of an open edge that begins where it ends, or kNone.
  VertexIndex next_of(HalfEdge h) const {
    const HalfEdge next = from_[end(h)];
    return next == kNone ? kNone : end(next);
  }
  VertexIndex previous_of(HalfEdge h) const {
    const HalfEdge previous = into_[start(h)];
    return previous == kNone ? kNone : start(previous);
  }

  /// Joins it to the triangles along its edges. @return false where an edge is there already
  bool add(const std::array<VertexIndex, 3>& triangle) {
    const auto first = static_cast<HalfEdge>(3 * triangles_.size());
    triangles_.push_back(triangle);
    for (HalfEdge h = first; h < first + 3; ++h) {
      mates_.push_back(kNone);
      next_from_.push_back(kNone);
      next_into_.push_back(kNone);
    }
    bool is_new = true;
    for (HalfEdge h = first; h < first + 3; ++h) {
      const HalfEdge mate = find(end(h), start(h));
      if (mate != kNone) {
        close(mate);
        mates_[mate] = h;
        mates_[h] = mate;
      } else {
        is_new = is_new && find(start(h), end(h)) == kNone;
        next_from_[h] = from_[start(h)];
        from_[start(h)] = h;
        next_into_[h] = into_[end(h)];
        into_[end(h)] = h;
      }
    }
    return is_new;
  }

  /// Nothing will come beyond an open edge.
  void close_at_border(HalfEdge h) {
    close(h);
    mates_[h] = kBorderMate;
  }

 private:
  static constexpr HalfEdge kBorderMate = kNone - 1;
  bool is_border(HalfEdge h) const { return mates_[h] == kBorderMate; }

  HalfEdge find(VertexIndex from, VertexIndex to) const {
    HalfEdge h = from_[from];
    while (h != kNone && end(h) != to) h = next_from_[h];
    return h;
  }
  void close(HalfEdge h) {
    unlink(from_[start(h)], next_from_, h);
    unlink(into_[end(h)], next_into_, h);
  }
  static void unlink(HalfEdge& head, std::vector<HalfEdge>& next, HalfEdge h) {
    HalfEdge* link = &head;
    while (*link != h) link = &next[*link];
    *link = next[h];
  }

  std::vector<std::array<VertexIndex, 3>> triangles_;
  std::vector<HalfEdge> mates_;
  // Open edges by the vertex where they begin, and where they end; the last one comes first.
  std::vector<HalfEdge> from_, into_;            // [vertices]
  std::vector<HalfEdge> next_from_, next_into_;  // [half-edges]
};

/// From triangle to triangle, breadth first, which meets itself seldom. Steps:
///   first_corners()  of the next part of the mesh
///   beyond(gate)     the third vertex of the triangle across an open edge, or kNone at the border
/// @return false where a triangle meets an edge that two have
template <class Steps>
bool walk(GrowingMesh& mesh, std::size_t triangles, Steps& steps) {
  std::size_t next_gate = 0;  // every edge is a gate once, in the order in which they came
  while (mesh.size() < triangles) {
    if (next_gate == 3 * mesh.size()) {
      if (!mesh.add(steps.first_corners())) return false;
      continue;
    }
    const auto gate = static_cast<HalfEdge>(next_gate++);
    if (!mesh.is_open(gate)) continue;
    const VertexIndex vertex = steps.beyond(gate);
    if (vertex == kNone)
      mesh.close_at_border(gate);
    else if (!mesh.add({vertex, mesh.end(gate), mesh.start(gate)}))
      return false;
  }
  return true;
}

/// Where a vertex beyond an edge is expected.
Place expected_sample(const Place& a, const Place& b, const Place& opposite) {
  return {a.column + b.column - opposite.column, a.row + b.row - opposite.row, 0};
}

/// Height between that of the plane through the triangle, which overshoots, and the middle of the
/// edge.
std::int64_t expected_height(const Place& a, const Place& b, const Place& opposite,
                             const Place& at) {
  const auto across = [](const Place& origin, const Place& p, const Place& q) {
    return static_cast<double>(p.column - origin.column) * static_cast<double>(q.row - origin.row) -
           static_cast<double>(p.row - origin.row) * static_cast<double>(q.column - origin.column);
  };
  const double middle = static_cast<double>(a.height + b.height) / 2;
  const double area = across(a, b, opposite);
  if (area == 0) return std::llround(middle);
  const double to_b = across(a, at, opposite) / area, to_opposite = across(a, b, at) / area;
  const double plane = static_cast<double>(a.height) +
                       to_b * static_cast<double>(b.height - a.height) +
                       to_opposite * static_cast<double>(opposite.height - a.height);
  const double expected = (plane + middle) / 2;
  return std::llround(std::clamp(expected, 0.0, static_cast<double>(kMostSteps)));
}

/// The raster's part that a mesh stands on.
struct Layout {
  std::int64_t columns = 1, first_column = 0, first_row = 0, stride = 1;
  std::int64_t last_column = 0, last_row = 0;  // in strides from the first
  std::int64_t vertices = 0, triangles = 0;
};

using LayoutNumbers = std::array<std::int64_t, 8>;
LayoutNumbers numbers_of(const Layout& l) {
  return {l.columns,     l.first_column, l.first_row, l.stride,
          l.last_column, l.last_row,     l.vertices,  l.triangles};
}
Layout layout_from(std::span<const std::int64_t> n) {
  return {n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7]};
}

Layout layout_of(const Tin& tin, std::span<const std::int64_t> samples, std::int64_t columns) {
  Layout layout;
  layout.columns = columns;
  layout.vertices = static_cast<std::int64_t>(tin.vertices.size());
  layout.triangles = static_cast<std::int64_t>(tin.triangles.size());
  if (samples.empty()) return layout;
  layout.first_column = columns;
  layout.first_row = samples.front() / columns;
  std::int64_t stride = 0, right = 0;
  for (const std::int64_t sample : samples) {
    layout.first_column = std::min(layout.first_column, sample % columns);
    right = std::max(right, sample % columns);
  }
  for (const std::int64_t sample : samples)
    stride = std::gcd(stride, std::gcd(sample % columns - layout.first_column,
                                       sample / columns - layout.first_row));
  layout.stride = std::max<std::int64_t>(1, stride);
  layout.last_column = (right - layout.first_column) / layout.stride;
  layout.last_row = (samples.back() / columns - layout.first_row) / layout.stride;
  return layout;
}

double span_of(std::int64_t last) {
  return static_cast<double>(std::max<std::int64_t>(1, last));
}

std::int64_t sample_of(const Layout& layout, const Place& place) {
  return (layout.first_row + place.row * layout.stride) * layout.columns + layout.first_column +
         place.column * layout.stride;
}

Position origin_of(const Tin& tin) {
  return tin.vertices.empty() ? Position{} : bounds_of(tin.vertices).low;
}

std::int64_t steps_from(double origin_m, double value_m, std::int64_t most = kMostStepsInPlan) {
  const double steps = (value_m - origin_m) / kLatticeStepM;
  assert(steps >= 0 && steps < static_cast<double>(most));
  return static_cast<std::int64_t>(steps);
}

constexpr std::size_t kHeightPlanes = 4;

// ---- writing ----

/// Heights in whole units, as most data have them, take a third of the bits of positions in space.
struct Heights {
  double unit_m = kLatticeStepM;
  std::vector<std::int64_t> units;  // [vertices] over the least one
};

/// Units that data come in, metres: those, parts of them, and feet.
constexpr std::array kUnitsM = {1.0, 0.5, 0.3048, 0.3048006096012192, 0.25, 0.1, 0.01};
/// So far from a whole unit heights may be, which are found from positions on the lattice, metres.
constexpr double kUnitRoundingM = 1e-3;

/// Whether nearly all heights are whole units.
bool come_in(double unit_m, std::span<const double> heights_m) {
  const auto whole = std::ranges::count_if(heights_m, [&](double height_m) {
    return std::abs(height_m - unit_m * std::nearbyint(height_m / unit_m)) < kUnitRoundingM;
  });
  return static_cast<double>(whole) >= 0.99 * static_cast<double>(heights_m.size());
}

Heights heights_of(const Tin& tin, std::span<const double> heights_m) {
  Heights heights;
  if (tin.vertices.empty()) return heights;
  const auto unit = std::ranges::find_if(
      kUnitsM, [&](double u_m) { return !heights_m.empty() && come_in(u_m, heights_m); });
  if (unit == kUnitsM.end()) {
    const double least_m = origin_of(tin).z_m;
    for (const Position& p : tin.vertices)
      heights.units.push_back(steps_from(least_m, p.z_m, kMostSteps));
    return heights;
  }
  heights.unit_m = *unit;
  const double least = std::nearbyint(*std::ranges::min_element(heights_m) / *unit);
  for (const double height_m : heights_m)
    heights.units.push_back(std::llround(std::nearbyint(height_m / *unit) - least));
  return heights;
}

/// The steps of the walk over a mesh that is known, and what they leave to be read.
class MeshEncoder {
 public:
  MeshEncoder(const Tin& tin, std::span<const std::int64_t> samples, const Layout& layout,
              const Heights& heights)
      : tin_(tin),
        layout_(layout),
        mesh_(tin.vertices.size(), tin.triangles.size()),
        number_of_(tin.vertices.size(), kNone),
        is_met_(tin.triangles.size(), false) {
    for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
      const std::int64_t column = samples[v] % layout.columns - layout.first_column;
      const std::int64_t row = samples[v] / layout.columns - layout.first_row;
      places_.push_back({column / layout.stride, row / layout.stride, heights.units[v]});
    }
    walk(mesh_, tin.triangles.size(), *this);
    assert(met_.size() == tin.vertices.size());
  }

  std::array<VertexIndex, 3> first_corners() {
    while (is_met_[next_part_]) ++next_part_;
    std::array<VertexIndex, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const VertexIndex v = tin_.triangles[next_part_][i];
      const Place& before = met_.empty() ? Place{} : places_[met_.back()];
      gates.push_back(number_of_[v] == kNone ? kNew : kKnown);
      corners[i] = number_of_[v] == kNone ? meet(v, before, before.height) : name_known(v);
    }
    note(static_cast<TriangleIndex>(next_part_));
    return corners;
  }

  VertexIndex beyond(HalfEdge gate) {
    const VertexIndex a = met_[mesh_.start(gate)], b = met_[mesh_.end(gate)];
    const TriangleIndex across = across_of(original_[gate / 3], a, b);
    if (across == kNone) {
      gates.push_back(kBorder);
      return kNone;
    }
    VertexIndex v = kNone;
    for (const VertexIndex corner : tin_.triangles[across])
      if (corner != a && corner != b) v = corner;
    const VertexIndex number = number_across(gate, v);
    note(across);
    return number;
  }

  const std::vector<VertexIndex>& met() const { return met_; }
  const std::vector<Place>& places() const { return places_; }

  std::vector<std::uint8_t> gates, known, columns, rows;
  std::array<std::vector<std::uint8_t>, kHeightPlanes> height_planes;

 private:
  VertexIndex number_across(HalfEdge gate, VertexIndex v) {
    const Place &a = places_[met_[mesh_.start(gate)]], &b = places_[met_[mesh_.end(gate)]];
    const Place& opposite = places_[met_[mesh_.opposite(gate)]];
    if (number_of_[v] == kNone) {
      gates.push_back(kNew);
      return meet(v, expected_sample(a, b, opposite), expected_height(a, b, opposite, places_[v]));
    }
    const VertexIndex number = number_of_[v];
    if (number == mesh_.next_of(gate)) {
      gates.push_back(kNext);
    } else if (number == mesh_.previous_of(gate)) {
      gates.push_back(kPrevious);
    } else {
      gates.push_back(kKnown);
      name_known(v);
    }
    return number;
  }

  TriangleIndex across_of(TriangleIndex triangle, VertexIndex a, VertexIndex b) const {
    std::size_t i = 0;
    while (tin_.triangles[triangle][i] == a || tin_.triangles[triangle][i] == b) ++i;
    return tin_.neighbours[triangle][i];
  }

  void note(TriangleIndex triangle) {
    is_met_[triangle] = true;
    original_.push_back(triangle);
  }

  VertexIndex name_known(VertexIndex v) {
    append_number(static_cast<std::int64_t>(met_.size()) - 1 - number_of_[v], known);
    return number_of_[v];
  }

  VertexIndex meet(VertexIndex v, const Place& expected, std::int64_t expected_height) {
    append_number(places_[v].column - expected.column, columns);
    append_number(places_[v].row - expected.row, rows);
    const std::uint64_t step = code_of(places_[v].height - expected_height);
    for (std::size_t plane = 0; plane < kHeightPlanes; ++plane)
      height_planes[plane].push_back(static_cast<std::uint8_t>(step >> (8 * plane)));
    number_of_[v] = static_cast<VertexIndex>(met_.size());
    met_.push_back(v);
    return number_of_[v];
  }

  const Tin& tin_;
  const Layout& layout_;
  GrowingMesh mesh_;
  std::vector<Place> places_;            // [vertices]
  std::vector<VertexIndex> met_;         // in the order in which they are met
  std::vector<VertexIndex> number_of_;   // [vertices] the inverse
  std::vector<TriangleIndex> original_;  // of the triangles as they are met
  std::vector<bool> is_met_;             // [triangles]
  std::size_t next_part_ = 0;
};

bool is_ordered(const Tin& tin) {
  for (std::size_t t = 0; t < tin.triangles.size(); ++t) {
    const auto& [a, b, c] = tin.triangles[t];
    if (a > b || a > c) return false;
    if (t > 0 && std::pair(tin.triangles[t - 1][0], tin.triangles[t - 1][1]) >= std::pair(a, b))
      return false;
  }
  return true;
}

/// Steps of a coordinate from the mesh's origin.
using CoordinateSteps = std::vector<std::int64_t>;

/// What a coordinate depends on: the sample, and the height or z in lattice steps.
PositionModel::Sample sample_for(const Place& place, double height_steps, std::int64_t value) {
  return {static_cast<double>(place.column), static_cast<double>(place.row), height_steps,
          static_cast<double>(value)};
}

/// Adds a model of a coordinate and what it leaves over, in the order in which vertices are met.
void add_coordinate(SectionFileWriter& writer, const std::string& name, const Layout& layout,
                    const MeshEncoder& encoder, const std::vector<double>& height_steps,
                    const CoordinateSteps& values) {
  std::vector<PositionModel::Sample> samples;
  for (const VertexIndex v : encoder.met())
    samples.push_back(sample_for(encoder.places()[v], height_steps[v], values[v]));
  const PositionModel model =
      PositionModel::fit(span_of(layout.last_column), span_of(layout.last_row), samples);
  std::vector<std::uint8_t> left_over;
  for (std::size_t i = 0; i < samples.size(); ++i)
    append_number(values[encoder.met()[i]] - model.at(samples[i]), left_over);
  writer.add_owned<double>(name + "_model",
                           std::vector<double>(model.terms().begin(), model.terms().end()));
  writer.add_packed<std::uint8_t>(name + "_step", left_over);
}

// ---- reading ----

Layout read_layout(const SectionFile& file) {
  const std::span<const std::int64_t> numbers = file.section<std::int64_t>("raster");
  if (numbers.size() != LayoutNumbers().size()) file.fail("no layout of a mesh");
  for (const std::int64_t number : numbers)
    if (number < 0 || number > kMostColumns) file.fail("a layout of no mesh");
  const Layout layout = layout_from(numbers);
  if (layout.columns < 1 || layout.stride < 1) file.fail("a layout of no mesh");
  return layout;
}

/// The steps of the walk over a mesh as they were written.
class MeshDecoder {
 public:
  MeshDecoder(const SectionFile& file, const Layout& layout)
      : file_(file),
        layout_(layout),
        gates_(file.unpack<std::uint8_t, std::uint8_t>("gate")),
        known_(file, file.unpack<std::uint8_t, std::uint8_t>("known_vertex")),
        columns_(file, file.unpack<std::uint8_t, std::uint8_t>("column_step")),
        rows_(file, file.unpack<std::uint8_t, std::uint8_t>("row_step")),
        heights_(file.unpack<std::uint8_t, std::uint8_t>("height_step")),
        mesh_(checked_vertices(), checked_triangles()) {
    places_.reserve(vertices());
    if (!walk(mesh_, static_cast<std::size_t>(layout.triangles), *this))
      file_.fail("three triangles at an edge");
    if (places_.size() != vertices() || next_gate_ != gates_.size() || !known_.at_end() ||
        !columns_.at_end() || !rows_.at_end())
      file_.fail("more of a mesh than its triangles have");
  }

  std::array<VertexIndex, 3> first_corners() {
    std::array<VertexIndex, 3> corners{};
    for (VertexIndex& corner : corners) {
      const Place before = places_.empty() ? Place{} : places_.back();
      switch (take_gate()) {
        case kNew:
          corner = meet(before, [&](const Place&) { return before.height; });
          break;
        case kKnown:
          corner = take_known();
          break;
        default:
          file_.fail("a part that begins with no vertex");
      }
    }
    check(corners);
    return corners;
  }

  VertexIndex beyond(HalfEdge gate) {
    const Place a = place(mesh_.start(gate)), b = place(mesh_.end(gate));
    const Place opposite = place(mesh_.opposite(gate));
    VertexIndex vertex = kNone;
    switch (take_gate()) {
      case kBorder:
        return kNone;
      case kNew:
        return meet(expected_sample(a, b, opposite),
                    [&](const Place& at) { return expected_height(a, b, opposite, at); });
      case kNext:
        vertex = mesh_.next_of(gate);
        break;
      case kPrevious:
        vertex = mesh_.previous_of(gate);
        break;
      case kKnown:
        vertex = take_known();
        break;
      default:
        file_.fail("an edge with no such thing beyond");
    }
    if (vertex == kNone) file_.fail("an edge with no open edge beside it");
    check({vertex, mesh_.start(gate), mesh_.end(gate)});
    return vertex;
  }

  const GrowingMesh& mesh() const { return mesh_; }
  const std::vector<Place>& places() const { return places_; }

 private:
  std::size_t vertices() const { return static_cast<std::size_t>(layout_.vertices); }

  /// Before room is made for as many: each takes bytes.
  std::size_t checked_vertices() const {
    if (vertices() > columns_.size() || heights_.size() != kHeightPlanes * vertices())
      file_.fail(fmt::format("a mesh of {} vertices with heights of {}", vertices(),
                             heights_.size() / kHeightPlanes));
    return vertices();
  }
  std::size_t checked_triangles() const {
    if (static_cast<std::size_t>(layout_.triangles) > std::min(gates_.size(), kMostTriangles))
      file_.fail(fmt::format("{} triangles of {} edges", layout_.triangles, gates_.size()));
    return static_cast<std::size_t>(layout_.triangles);
  }

  const Place& place(VertexIndex v) const { return places_[v]; }

  std::uint8_t take_gate() {
    if (next_gate_ == gates_.size()) file_.fail("a mesh that ends too early");
    return gates_[next_gate_++];
  }

  VertexIndex take_known() {
    const std::int64_t back = known_.take();
    if (back < 0 || back >= static_cast<std::int64_t>(places_.size()))
      file_.fail(fmt::format("vertex {} back from {}", back, places_.size()));
    return static_cast<VertexIndex>(static_cast<std::int64_t>(places_.size()) - 1 - back);
  }

  template <class ExpectedZ>
  VertexIndex meet(const Place& expected, const ExpectedZ& expected_height_of) {
    const std::size_t v = places_.size();
    if (v == vertices()) file_.fail("more vertices than were announced");
    Place at;
    at.column = within(expected.column, columns_.take(), layout_.last_column);
    at.row = within(expected.row, rows_.take(), layout_.last_row);
    std::uint64_t code = 0;
    for (std::size_t plane = 0; plane < kHeightPlanes; ++plane)
      code |= static_cast<std::uint64_t>(heights_[plane * vertices() + v]) << (8 * plane);
    at.height = within(expected_height_of(at), value_of(code), kMostSteps);
    places_.push_back(at);
    return static_cast<VertexIndex>(v);
  }

  std::int64_t within(std::int64_t expected, std::int64_t step, std::int64_t most) const {
    if (std::abs(step) > 4 * kMostSteps || expected + step < 0 || expected + step > most)
      file_.fail("a vertex out of bounds");
    return expected + step;
  }

  void check(const std::array<VertexIndex, 3>& corners) const {
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
      file_.fail("a triangle with one corner twice");
  }

  const SectionFile& file_;
  const Layout& layout_;
  std::vector<std::uint8_t> gates_;
  std::size_t next_gate_ = 0;
  Numbers known_, columns_, rows_;
  std::vector<std::uint8_t> heights_;
  GrowingMesh mesh_;
  std::vector<Place> places_;
};

/// One coordinate of all vertices, in lattice steps, in the order in which they were met.
CoordinateSteps coordinates(const SectionFile& file, const Layout& layout,
                            const MeshDecoder& decoder, const std::string& name,
                            const std::vector<double>& height_steps) {
  const std::span<const double> terms = file.section<double>(name + "_model");
  PositionModel::Terms of_model{};
  if (terms.size() != of_model.size()) file.fail("a model of no mesh");
  std::ranges::copy(terms, of_model.begin());
  const PositionModel model(span_of(layout.last_column), span_of(layout.last_row), of_model);
  Numbers left_over(file, file.unpack<std::uint8_t, std::uint8_t>(name + "_step"));
  CoordinateSteps values;
  values.reserve(decoder.places().size());
  for (std::size_t v = 0; v < decoder.places().size(); ++v) {
    const std::int64_t step = left_over.take();
    const std::int64_t value =
        std::abs(step) > 4 * PositionModel::kMostSteps
            ? -1
            : model.at(sample_for(decoder.places()[v], height_steps[v], 0)) + step;
    if (value < 0 || value > kMostStepsInPlan) file.fail("a vertex out of bounds");
    values.push_back(value);
  }
  if (!left_over.at_end()) file.fail("coordinates of more vertices than there are");
  return values;
}

/// All vertices, in the order in which they were met.
std::vector<Position> read_positions(const SectionFile& file, const Layout& layout,
                                     const MeshDecoder& decoder) {
  const std::span<const double> origin = file.section<double>("origin", 3);
  const std::span<const double> unit = file.section<double>("height_unit");
  if (origin.size() != 3 || unit.size() != 1 || !(unit[0] > 0 && unit[0] <= 1))
    file.fail("no origin of a mesh");
  std::vector<double> height_steps;
  for (const Place& place : decoder.places())
    height_steps.push_back(static_cast<double>(place.height) * (unit[0] / kLatticeStepM));
  const CoordinateSteps z = coordinates(file, layout, decoder, "z", height_steps);
  height_steps.assign(z.begin(), z.end());
  const CoordinateSteps x = coordinates(file, layout, decoder, "x", height_steps);
  const CoordinateSteps y = coordinates(file, layout, decoder, "y", height_steps);
  std::vector<Position> positions;
  positions.reserve(z.size());
  const auto at = [&](std::size_t axis, std::int64_t steps) {
    return origin[axis] + static_cast<double>(steps) * kLatticeStepM;
  };
  for (std::size_t v = 0; v < z.size(); ++v)
    positions.push_back({at(0, x[v]), at(1, y[v]), at(2, z[v])});
  return positions;
}

/// Vertices as they were met, by rising sample. Two at one sample are a fault.
std::vector<VertexIndex> by_sample(const SectionFile& file,
                                   const std::vector<std::int64_t>& samples) {
  std::vector<VertexIndex> order(samples.size());
  std::iota(order.begin(), order.end(), VertexIndex{0});
  std::ranges::sort(order, {}, [&](VertexIndex v) { return samples[v]; });
  for (std::size_t i = 1; i < order.size(); ++i)
    if (samples[order[i]] == samples[order[i - 1]])
      file.fail(fmt::format("two vertices at sample {}", samples[order[i]]));
  return order;
}

/// Triangles by their lowest vertex, which comes first in each, then by the next one.
void take_triangles(const GrowingMesh& mesh, const std::vector<VertexIndex>& new_vertex, Tin& tin) {
  struct Turned {
    TriangleIndex triangle;
    std::uint32_t first;  // the corner that comes first
    VertexIndex second;
  };
  const auto corner = [&](std::size_t t, std::size_t i) {
    return new_vertex[mesh.corners(t)[i % 3]];
  };
  const auto turned = [&](std::size_t t) {
    const VertexIndex a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    const std::uint32_t first = a < b ? (a < c ? 0 : 2) : (b < c ? 1 : 2);
    return Turned{static_cast<TriangleIndex>(t), first, corner(t, first + 1)};
  };
  std::vector<std::uint32_t> begin(new_vertex.size() + 1, 0);
  for (std::size_t t = 0; t < mesh.size(); ++t) ++begin[corner(t, turned(t).first) + 1];
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<Turned> sorted(mesh.size());
  std::vector<std::uint32_t> filled(begin.begin(), begin.end() - 1);
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const Turned of = turned(t);
    sorted[filled[corner(t, of.first)]++] = of;
  }
  for (std::size_t v = 0; v + 1 < begin.size(); ++v)
    std::sort(sorted.begin() + begin[v], sorted.begin() + begin[v + 1],
              [](const Turned& a, const Turned& b) {
                return std::pair(a.second, a.triangle) < std::pair(b.second, b.triangle);
              });
  std::vector<TriangleIndex> new_triangle(mesh.size());
  for (std::size_t t = 0; t < sorted.size(); ++t)
    new_triangle[sorted[t].triangle] = static_cast<TriangleIndex>(t);
  tin.triangles.resize(mesh.size());
  tin.neighbours.resize(mesh.size());
  for (std::size_t t = 0; t < sorted.size(); ++t) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t from = (sorted[t].first + i) % 3;
      const HalfEdge mate = mesh.mate(3 * sorted[t].triangle + from);
      tin.triangles[t][i] = corner(sorted[t].triangle, from);
      tin.neighbours[t][i] = mate < 3 * mesh.size() ? new_triangle[mate / 3] : kNone;
    }
  }
}

}  // namespace

void add_mesh_code(SectionFileWriter& writer, const Tin& tin, std::span<const std::int64_t> samples,
                   std::int64_t columns, std::span<const double> heights_m) {
  assert(samples.size() == tin.vertices.size() && is_ordered(tin));
  assert(heights_m.empty() || heights_m.size() == tin.vertices.size());
  assert(columns >= 1 && columns <= kMostColumns);
  assert(std::ranges::adjacent_find(samples, std::greater_equal()) == samples.end());
  const Layout layout = layout_of(tin, samples, columns);
  const Position origin = origin_of(tin);
  const Heights heights = heights_of(tin, heights_m);
  const MeshEncoder encoder(tin, samples, layout, heights);
  std::vector<std::uint8_t> height_steps;
  for (const auto& plane : encoder.height_planes)
    height_steps.insert(height_steps.end(), plane.begin(), plane.end());
  const LayoutNumbers numbers = numbers_of(layout);
  writer.add_owned<std::int64_t>("raster",
                                 std::vector<std::int64_t>(numbers.begin(), numbers.end()));
  writer.add_owned<double>("origin", std::vector<Position>{origin});
  writer.add_owned<double>("height_unit", std::vector<double>{heights.unit_m});
  writer.add_packed<std::uint8_t>("gate", encoder.gates);
  writer.add_packed<std::uint8_t>("known_vertex", encoder.known);
  writer.add_packed<std::uint8_t>("column_step", encoder.columns);
  writer.add_packed<std::uint8_t>("row_step", encoder.rows);
  writer.add_packed<std::uint8_t>("height_step", height_steps);
  const auto steps = [&](double origin_m, double Position::*coordinate) {
    CoordinateSteps values;
    for (const Position& p : tin.vertices) values.push_back(steps_from(origin_m, p.*coordinate));
    return values;
  };
  std::vector<double> height;
  for (const std::int64_t units : heights.units)
    height.push_back(static_cast<double>(units) * (heights.unit_m / kLatticeStepM));
  const CoordinateSteps z = steps(origin.z_m, &Position::z_m);
  add_coordinate(writer, "z", layout, encoder, height, z);
  height.assign(z.begin(), z.end());
  add_coordinate(writer, "x", layout, encoder, height, steps(origin.x_m, &Position::x_m));
  add_coordinate(writer, "y", layout, encoder, height, steps(origin.y_m, &Position::y_m));
}

SampledTin read_mesh_code(const SectionFile& file) {
  const Layout layout = read_layout(file);
  const MeshDecoder decoder(file, layout);
  const std::vector<Position> positions = read_positions(file, layout, decoder);
  std::vector<std::int64_t> samples;
  for (const Place& place : decoder.places()) samples.push_back(sample_of(layout, place));
  const std::vector<VertexIndex> order = by_sample(file, samples);
  SampledTin mesh;
  std::vector<VertexIndex> new_vertex(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    new_vertex[order[i]] = static_cast<VertexIndex>(i);
    mesh.sample_of_vertex.push_back(samples[order[i]]);
    mesh.tin.vertices.push_back(positions[order[i]]);
  }
  take_triangles(decoder.mesh(), new_vertex, mesh.tin);
  return mesh;
}

}  // namespace scarp
