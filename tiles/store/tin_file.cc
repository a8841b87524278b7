#include "tiles/store/tin_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/geodesy/predicates.h"

namespace scarp {
namespace {

constexpr std::uint32_t kTinVersion = 1;
constexpr std::uint32_t kCompactVersion = 3;

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

void check(const Tin& tin, const SectionFile& file) {
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
}

void check_samples(const SampledTin& mesh, const SectionFile& file) {
  const std::vector<std::int64_t>& samples = mesh.sample_of_vertex;
  if (samples.size() != mesh.tin.vertices.size())
    file.fail(fmt::format("samples of {} vertices where {} were expected", samples.size(),
                          mesh.tin.vertices.size()));
  for (std::size_t v = 0; v < samples.size(); ++v) {
    if (samples[v] < -1) file.fail(fmt::format("vertex {} has sample {}", v, samples[v]));
  }
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

SectionFileWriter compact_tin_writer(const Tin& tin, std::span<const std::int64_t> sample_of_vertex,
                                     std::int64_t columns, std::span<const double> heights_m) {
  SectionFileWriter writer(kTinKind, kCompactVersion);
  add_mesh_code(writer, tin, sample_of_vertex, columns, heights_m);
  return writer;
}

void write_compact_tin(const std::string& path, const Tin& tin,
                       std::span<const std::int64_t> sample_of_vertex, std::int64_t columns,
                       std::span<const double> heights_m, Existing existing) {
  compact_tin_writer(tin, sample_of_vertex, columns, heights_m).write(path, existing);
}

SampledTin read_sampled_tin(const SectionFile& file) {
  const bool is_compact = file.has("gate");
  file.require(kTinKind, is_compact ? kCompactVersion : kTinVersion);
  SampledTin mesh;
  if (is_compact) {
    mesh = read_mesh_code(file);
  } else {
    mesh.tin.vertices = file.copy<double, Position>("position");
    mesh.tin.triangles = file.copy<std::uint32_t, std::array<VertexIndex, 3>>("triangle");
    mesh.tin.neighbours = file.copy<std::uint32_t, std::array<TriangleIndex, 3>>("neighbour");
    if (file.has("sample")) mesh.sample_of_vertex = file.copy<std::int64_t, std::int64_t>("sample");
  }
  check(mesh.tin, file);
  if (is_compact || file.has("sample")) check_samples(mesh, file);
  return mesh;
}

Tin read_tin(const SectionFile& file) {
  return read_sampled_tin(file).tin;
}

}  // namespace scarp
