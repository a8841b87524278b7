#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geodesy/position.h"

namespace scarp {

using VertexIndex = std::uint32_t;
using TriangleIndex = std::uint32_t;

/// "No triangle" and "no vertex": the far side of a border edge, a sector without horizon.
inline constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Triangulated irregular network in the flattened frame: the surface `tin`. A height field:
/// seen from above, triangles are counter-clockwise, have positive area and do not overlap.
/// Ground is opaque below them; where there is no triangle the ground is not known (void).
struct Tin {
  std::vector<Position> vertices;
  std::vector<std::array<VertexIndex, 3>> triangles;
  /// neighbours[t][i] is the triangle across the edge opposite to corner i, or kNone.
  std::vector<std::array<TriangleIndex, 3>> neighbours;
};

/// Fills tin.neighbours from tin.triangles. Requires every edge to have at most two triangles.
/// Cost: O(n log n), n triangles.
void connect_neighbours(Tin& tin);

/// Names the first broken invariant of a TIN, or nothing where all hold: indices in range,
/// lattice coordinates, counter-clockwise triangles (exact), every edge used at most once in each
/// direction, neighbours mutual and across the right edge, no two vertices at one place, no vertex
/// without a triangle. Cost: O(n log n).
std::optional<std::string> check_tin(const Tin& tin);

/// Whether the surface bends downwards over the edge of a triangle opposite to a corner: the
/// triangle beyond it falls below the plane of this one. Exact. Requires a triangle beyond.
bool bends_downwards(const Tin& tin, TriangleIndex triangle, std::size_t corner);

/// Least and greatest coordinates. Requires at least one vertex.
struct Bounds {
  Position low;
  Position high;
};
Bounds bounds_of(std::span<const Position> positions);

}  // namespace scarp
