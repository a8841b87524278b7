#include <cmath>
#include <string>

#include "ingest/footprints/footprints.h"
#include "ingest/footprints/plane_graph.h"

namespace scarp {
namespace {

std::optional<std::string> check_vertex(const SampleGrid& grid, const WallsAndRoofs& walls,
                                        const WallVertex& v) {
  if (!(round_to_lattice(v.position) == v.position)) return "is not on the lattice";
  for (const double place : {v.column, v.row})
    if (std::nearbyint(place / walls.tick_cells) * walls.tick_cells != place)
      return "is not on a tick";
  if (!grid.is_ground_cell(static_cast<std::int32_t>(std::floor(v.column)),
                           static_cast<std::int32_t>(std::floor(v.row))))
    return "is not on the ground";
  const bool at_sample = std::floor(v.column) == v.column && std::floor(v.row) == v.row;
  if (at_sample && !walls.covered[grid.index(static_cast<std::int32_t>(v.column),
                                             static_cast<std::int32_t>(v.row))])
    return "lies on a sample that is not covered";
  return {};
}

}  // namespace

std::optional<std::string> check_walls(const SampleGrid& grid, const WallsAndRoofs& walls) {
  if (walls.buildings == 0)
    return walls.vertices.empty() && walls.edges.empty() && walls.covered.empty()
               ? std::nullopt
               : std::optional<std::string>("there are walls without buildings");
  if (walls.covered.size() != grid.positions.size()) return "marks of samples are missing";
  PlaneGraph samples, flattened;
  std::vector<bool> used(walls.vertices.size(), false);
  for (std::size_t i = 0; i < walls.vertices.size(); ++i) {
    const WallVertex& v = walls.vertices[i];
    if (const auto broken = check_vertex(grid, walls, v))
      return "corner " + std::to_string(i) + " " + *broken;
    samples.points.push_back({static_cast<std::int64_t>(v.column / walls.tick_cells),
                              static_cast<std::int64_t>(v.row / walls.tick_cells)});
    flattened.points.push_back({lattice_steps(v.position.x_m), lattice_steps(v.position.y_m)});
  }
  for (const auto& edge : walls.edges) {
    for (const std::uint32_t v : edge) {
      if (v >= walls.vertices.size()) return "an edge has a corner that does not exist";
      used[v] = true;
    }
  }
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) return "corner " + std::to_string(i) + " has no edge";
  samples.edges = flattened.edges = walls.edges;
  for (const auto& [graph, name] :
       {std::pair(&samples, "samples"), std::pair(&flattened, "lattice")})
    if (const auto found = find_conflict(*graph, 0))
      return "edges " + std::to_string((*found)[0]) + " and " + std::to_string((*found)[1]) +
             " meet in the plane of the " + name;
  return {};
}

}  // namespace scarp
