#include "tiles/store/tin_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

constexpr std::uint32_t kTinVersion = 1;
constexpr std::uint32_t kCompactVersion = 2;

static_assert(sizeof(Position) == 3 * sizeof(double));

bool on_lattice(const Position& p) {
  for (const double value_m : {p.x_m, p.y_m, p.z_m}) {
    // written so that NaN fails
    if (!(std::abs(value_m) <= kLatticeReachM) || round_to_lattice(value_m) != value_m)
      return false;
  }
  return true;
}

VertexIndex corner(const Tin& tin, TriangleIndex triangle, std::size_t index) {
  return tin.triangles[triangle][index % 3];
}

/// Whether `across` has the edge opposite to corner i of t, the other way round, and names t there.
bool is_mutual(const Tin& tin, TriangleIndex t, std::size_t i, TriangleIndex across) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (corner(tin, across, k + 1) == corner(tin, t, i + 2) &&
        corner(tin, across, k + 2) == corner(tin, t, i + 1))
      return tin.neighbours[across][k] == t;
  }
  return false;
}

void check_triangles(const Tin& tin, const SectionFile& file) {
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const auto& [a, b, c] = tin.triangles[t];
    for (const VertexIndex v : {a, b, c}) {
      if (v >= tin.vertices.size())
        file.fail(fmt::format("triangle {} has vertex {} of {}", t, v, tin.vertices.size()));
    }
    if (orient2d(tin.vertices[a], tin.vertices[b], tin.vertices[c]) <= 0)
      file.fail(fmt::format("triangle {} is not counter-clockwise", t));
  }
}

void check_neighbours(const Tin& tin, const SectionFile& file) {
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const TriangleIndex across = tin.neighbours[t][i];
      if (across == kNone) continue;
      if (across >= tin.triangles.size() || !is_mutual(tin, t, i, across))
        file.fail(fmt::format("triangle {} has the wrong neighbour {}", t, across));
    }
  }
}

// ---- compact ----

/// Whole numbers as bytes, seven bits each, lowest first; signed ones with their sign lowest.
void append_number(std::int64_t value, std::vector<std::uint8_t>& bytes) {
  std::uint64_t code =
      (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
  for (; code >= 0x80; code >>= 7) bytes.push_back(static_cast<std::uint8_t>(code | 0x80));
  bytes.push_back(static_cast<std::uint8_t>(code));
}

/// Takes numbers from a section of bytes.
class Numbers {
 public:
  Numbers(const SectionFile& file, std::string_view section)
      : file_(file), bytes_(file.section<std::uint8_t>(section)) {}

  std::int64_t take() {
    std::uint64_t code = 0;
    for (unsigned shift = 0;; shift += 7) {
      if (at_ == bytes_.size() || shift > 63) file_.fail("numbers that end too early");
      const std::uint8_t byte = bytes_[at_++];
      code |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) break;
    }
    return static_cast<std::int64_t>(code >> 1) ^ -static_cast<std::int64_t>(code & 1);
  }
  bool at_end() const { return at_ == bytes_.size(); }

 private:
  const SectionFile& file_;
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

/// Fills the neighbours; an edge of three triangles is a fault. Cost: O(n).
void find_neighbours(Tin& tin, const SectionFile& file) {
  struct Use {
    VertexIndex high;
    TriangleIndex triangle;
    std::uint32_t corner;
  };
  // Edges by their lower vertex, of which each has few.
  std::vector<std::uint32_t> first(tin.vertices.size() + 1, 0);
  const auto each_edge = [&](const auto& visit) {
    for (TriangleIndex t = 0; t < tin.triangles.size(); ++t)
      for (std::uint32_t i = 0; i < 3; ++i) {
        const VertexIndex a = corner(tin, t, i + 1), b = corner(tin, t, i + 2);
        visit(std::min(a, b), Use{std::max(a, b), t, i});
      }
  };
  each_edge([&](VertexIndex low, const Use&) { ++first[low + 1]; });
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) first[v + 1] += first[v];
  std::vector<Use> uses(3 * tin.triangles.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  each_edge([&](VertexIndex low, const Use& use) { uses[next[low]++] = use; });
  tin.neighbours.assign(tin.triangles.size(), {kNone, kNone, kNone});
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
      for (std::uint32_t k = i + 1; k < first[v + 1]; ++k) {
        if (uses[k].high != uses[i].high) continue;
        TriangleIndex& one = tin.neighbours[uses[i].triangle][uses[i].corner];
        TriangleIndex& other = tin.neighbours[uses[k].triangle][uses[k].corner];
        if (one != kNone || other != kNone)
          file.fail(fmt::format("three triangles at the edge of {} and {}", v, uses[i].high));
        one = uses[k].triangle;
        other = uses[i].triangle;
      }
    }
  }
}

Position compact_origin(const Tin& tin) {
  return tin.vertices.empty() ? Position{} : bounds_of(tin.vertices).low;
}

std::int32_t steps_from(double origin_m, double value_m) {
  const double steps = (value_m - origin_m) / kLatticeStepM;
  assert(steps >= 0 && steps < 0x1p31);
  return static_cast<std::int32_t>(steps);
}

Tin read_compact_tin(const SectionFile& file) {
  const std::span<const double> origin = file.section<double>("origin", 3);
  const std::span<const std::uint32_t> count = file.section<std::uint32_t>("triangles");
  const std::span<const std::int32_t> steps = file.section<std::int32_t>("place", 3);
  // A triangle takes three bytes at least.
  if (origin.size() != 3 || count.size() != 1 ||
      count[0] > file.section<std::uint8_t>("corner").size() / 3)
    file.fail("no compact mesh");
  Tin tin;
  const auto place = [&](std::size_t i) { return origin[i % 3] + steps[i] * kLatticeStepM; };
  for (std::size_t i = 0; i < steps.size(); i += 3)
    tin.vertices.push_back({place(i), place(i + 1), place(i + 2)});
  Numbers corners(file, "corner");
  std::int64_t a = 0;
  tin.triangles.reserve(count[0]);
  const auto vertex = [&](std::int64_t v) {
    if (v < 0 || v >= static_cast<std::int64_t>(tin.vertices.size()))
      file.fail(fmt::format("triangle {} has vertex {} of {}", tin.triangles.size(), v,
                            tin.vertices.size()));
    return static_cast<VertexIndex>(v);
  };
  for (std::uint32_t t = 0; t < count[0]; ++t) {
    a = vertex(a + corners.take());
    const VertexIndex b = vertex(a + corners.take()), c = vertex(a + corners.take());
    tin.triangles.push_back({static_cast<VertexIndex>(a), b, c});
  }
  if (!corners.at_end()) file.fail("corners that belong to no triangle");
  return tin;
}

std::vector<std::int64_t> read_compact_samples(const SectionFile& file) {
  Numbers differences(file, "sample_step");
  std::vector<std::int64_t> samples;
  std::int64_t sample = 0;
  while (!differences.at_end()) {
    const std::int64_t step = differences.take();
    if (std::abs(step) > std::int64_t{1} << 60 || std::abs(sample) > std::int64_t{1} << 60)
      file.fail("a sample out of range");
    samples.push_back(sample += step);
  }
  return samples;
}

}  // namespace

SectionFileWriter tin_writer(const Tin& tin, std::span<const std::int64_t> sample_of_vertex) {
  assert(tin.neighbours.size() == tin.triangles.size());
  assert(sample_of_vertex.empty() || sample_of_vertex.size() == tin.vertices.size());
  SectionFileWriter writer(kTinKind, kTinVersion);
  writer.add<double>("position", std::span(tin.vertices));
  writer.add<std::uint32_t>("triangle", std::span(tin.triangles));
  writer.add<std::uint32_t>("neighbour", std::span(tin.neighbours));
  if (!sample_of_vertex.empty()) writer.add<std::int64_t>("sample", sample_of_vertex);
  return writer;
}

void write_tin(const std::string& path, const Tin& tin,
               std::span<const std::int64_t> sample_of_vertex, Existing existing) {
  tin_writer(tin, sample_of_vertex).write(path, existing);
}

SectionFileWriter compact_tin_writer(const Tin& tin,
                                     std::span<const std::int64_t> sample_of_vertex) {
  assert(sample_of_vertex.size() == tin.vertices.size());
  const Position origin = compact_origin(tin);
  std::vector<std::array<std::int32_t, 3>> places;
  for (const Position& p : tin.vertices)
    places.push_back({steps_from(origin.x_m, p.x_m), steps_from(origin.y_m, p.y_m),
                      steps_from(origin.z_m, p.z_m)});
  std::vector<std::uint8_t> corners, samples;
  std::int64_t before = 0;
  for (const auto& [a, b, c] : tin.triangles) {
    append_number(a - before, corners);
    append_number(std::int64_t{b} - a, corners);
    append_number(std::int64_t{c} - a, corners);
    before = a;
  }
  before = 0;
  for (const std::int64_t sample : sample_of_vertex) {
    append_number(sample - before, samples);
    before = sample;
  }
  SectionFileWriter writer(kTinKind, kCompactVersion);
  writer.add_owned<double>("origin", std::vector<Position>{origin});
  writer.add_owned<std::int32_t>("place", places);
  writer.add_owned<std::uint32_t>(
      "triangles", std::vector<std::uint32_t>{static_cast<std::uint32_t>(tin.triangles.size())});
  writer.add_owned<std::uint8_t>("corner", corners);
  writer.add_owned<std::uint8_t>("sample_step", samples);
  return writer;
}

void write_compact_tin(const std::string& path, const Tin& tin,
                       std::span<const std::int64_t> sample_of_vertex, Existing existing) {
  compact_tin_writer(tin, sample_of_vertex).write(path, existing);
}

Tin read_tin(const SectionFile& file) {
  const bool is_compact = file.has("corner");
  file.require(kTinKind, is_compact ? kCompactVersion : kTinVersion);
  Tin tin;
  if (is_compact) {
    tin = read_compact_tin(file);
    find_neighbours(tin, file);
  } else {
    tin.vertices = file.copy<double, Position>("position");
    tin.triangles = file.copy<std::uint32_t, std::array<VertexIndex, 3>>("triangle");
    tin.neighbours = file.copy<std::uint32_t, std::array<TriangleIndex, 3>>("neighbour");
  }
  if (tin.vertices.size() >= kNone || tin.triangles.size() >= kNone)
    file.fail(fmt::format("{} vertices and {} triangles where fewer than {} were expected",
                          tin.vertices.size(), tin.triangles.size(), kNone));
  if (tin.neighbours.size() != tin.triangles.size())
    file.fail(fmt::format("neighbours of {} triangles where {} were expected",
                          tin.neighbours.size(), tin.triangles.size()));
  for (std::size_t v = 0; v < tin.vertices.size(); ++v) {
    if (!on_lattice(tin.vertices[v])) file.fail(fmt::format("vertex {} is not on the lattice", v));
  }
  check_triangles(tin, file);
  check_neighbours(tin, file);
  return tin;
}

std::vector<std::int64_t> read_sample_of_vertex(const SectionFile& file) {
  const bool is_compact = file.has("corner");
  file.require(kTinKind, is_compact ? kCompactVersion : kTinVersion);
  if (!is_compact && !file.has("sample")) return {};
  std::vector<std::int64_t> samples =
      is_compact ? read_compact_samples(file) : file.copy<std::int64_t, std::int64_t>("sample");
  const std::size_t vertices = (is_compact ? file.section<std::int32_t>("place", 3).size()
                                           : file.section<double>("position", 3).size()) /
                               3;
  if (samples.size() != vertices)
    file.fail(
        fmt::format("samples of {} vertices where {} were expected", samples.size(), vertices));
  for (std::size_t v = 0; v < vertices; ++v) {
    if (samples[v] < -1) file.fail(fmt::format("vertex {} has sample {}", v, samples[v]));
  }
  return samples;
}

}  // namespace scarp
