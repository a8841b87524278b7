#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"

namespace scarp {

/// A corner of a wall: at its foot on the ground, or at its top on a roof.
struct WallVertex {
  double column = 0;  ///< place among the samples, multiples of WallsAndRoofs::tick_cells
  double row = 0;
  Position position;  ///< on the lattice
  bool on_roof = false;
};

/// Buildings as the mesher takes them: vertices and edges that the surface must have. Every wall is
/// a strip as narrow as its run between its foot and the edge of its roof, so that the surface
/// stays a height field of triangles with area, and nothing downstream needs to know of walls.
///
/// Vertices lie at different places, also after rounding to the lattice, and edges meet only in
/// their ends, both in the plane of the samples and in the flattened one: see check_walls.
struct WallsAndRoofs {
  std::vector<WallVertex> vertices;
  std::vector<std::array<std::uint32_t, 2>> edges;  ///< vertex numbers
  /// [rows * columns], 1 where a sample lies in a building or too near to a wall for a vertex: it
  /// is no ground, bears no error and must not be inserted. Empty where there is no building.
  std::vector<std::uint8_t> covered;
  double tick_cells = 0;        ///< a power of two
  double run_m = 0;             ///< width of a wall's strip in the plane
  std::uint32_t buildings = 0;  ///< after union and removal: separate pieces of one roof level
};

}  // namespace scarp
