#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// Pairs of triangles, one of which belongs to a small part of the surface, that face each other
/// across void, so that islands can be grouped with what is nearest to them.
///
/// A part is what is connected by edges; it is small under small_triangles. Nodes of a square grid
/// are shared out, wave by wave, among the parts' triangles; a bridge is where two parts meet, once
/// for each two parts. Where there is more than one part, each small one has a bridge.
///
/// Side: none. Requires tin.neighbours. The same bits on every machine.
/// Cost: O(triangles); nothing but a pass over them where the surface is in one part.
std::vector<std::pair<TriangleIndex, TriangleIndex>> bridge_voids(const Tin& tin,
                                                                  std::uint32_t small_triangles);

}  // namespace scarp
