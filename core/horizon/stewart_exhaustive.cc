#include <cassert>
#include <vector>

#include "core/horizon/stewart.h"
#include "core/horizon/subsector.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// A subsector's horizon as seen from one vertex.
struct Horizon {
  VertexIndex vertex = kNone;
  Slope slope = {0, 0};
};

std::vector<Projection> project_all(std::span<const Position> vertices,
                                    const Subsector& subsector) {
  std::vector<Projection> projections;
  projections.reserve(vertices.size());
  for (const Position& p : vertices) projections.push_back(subsector.project(p));
  return projections;
}

/// Looks at the vertices in rising order, so that of equal ones the lowest index stays.
Horizon steepest_of_all(std::span<const Position> vertices, std::span<const Projection> projections,
                        std::size_t p) {
  Horizon best;
  for (std::size_t q = 0; q < vertices.size(); ++q) {
    if (q == p || !in_subsector(projections[p], projections[q])) continue;
    const Slope slope{lattice_steps(vertices[q].z_m) - lattice_steps(vertices[p].z_m),
                      projections[q].u - projections[p].u};
    const int sign = best.vertex == kNone ? 1 : compare_slopes(slope, best.slope);
    if (sign > 0 || (sign == 0 && slope.run < best.slope.run))
      best = {static_cast<VertexIndex>(q), slope};
  }
  return best;
}

}  // namespace

HorizonTable stewart_horizons_exhaustive(std::span<const Position> vertices,
                                         const SectorLayout& layout, const Progress& progress) {
  assert(layout.count >= 4 && layout.subsectors >= 1);
  const std::size_t n = vertices.size();
  const auto sectors = static_cast<std::size_t>(layout.count);
  HorizonTable table{layout, std::vector<VertexIndex>(n * sectors, kNone)};
  for (std::size_t sector = 0; sector < sectors; ++sector) {
    std::vector<Horizon> lowest(n);
    for (std::int32_t j = 0; j < layout.subsectors; ++j) {
      const Subsector subsector(layout, static_cast<std::int32_t>(sector) * layout.subsectors + j);
      const std::vector<Projection> projections = project_all(vertices, subsector);
      parallel_for(n, [&](std::size_t p) {
        if (j > 0 && lowest[p].vertex == kNone) return;
        const Horizon found = steepest_of_all(vertices, projections, p);
        if (j == 0 || found.vertex == kNone || compare_slopes(found.slope, lowest[p].slope) < 0)
          lowest[p] = found;
      });
    }
    for (std::size_t p = 0; p < n; ++p)
      table.horizon_vertex[p * sectors + sector] = lowest[p].vertex;
    if (progress) progress(static_cast<double>(sector + 1) / static_cast<double>(sectors));
  }
  return table;
}

std::optional<std::string> check_horizons(std::span<const Position> vertices,
                                          const HorizonTable& table) {
  const SectorLayout& layout = table.layout;
  if (table.horizon_vertex.size() != vertices.size() * static_cast<std::size_t>(layout.count))
    return "the table has not one entry for each vertex and sector";
  for (std::int32_t sector = 0; sector < layout.count; ++sector) {
    std::vector<bool> found(vertices.size(), false);
    for (std::int32_t j = 0; j < layout.subsectors; ++j) {
      const Subsector subsector(layout, sector * layout.subsectors + j);
      const std::vector<Projection> projections = project_all(vertices, subsector);
      for (std::size_t v = 0; v < vertices.size(); ++v) {
        const VertexIndex h = table.at(static_cast<VertexIndex>(v), sector);
        if (h == kNone || (h < vertices.size() && in_subsector(projections[v], projections[h])))
          found[v] = true;
      }
    }
    for (std::size_t v = 0; v < vertices.size(); ++v)
      if (!found[v])
        return "vertex " + std::to_string(v) + ", sector " + std::to_string(sector) +
               ": the horizon is no vertex of the sector";
  }
  return {};
}

}  // namespace scarp
