#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// Several surfaces as one.
struct Welded {
  Tin tin;  ///< triangles of all parts in their order
  /// The vertex of `tin` that each vertex of the parts has become, part after part.
  std::vector<VertexIndex> vertex_of;
};

/// Joins surfaces where their borders meet: border vertices over one place of the plane become one,
/// the lowest of them, and border edges that they then share are borders no more. With tiles of one
/// level there is no crack left where the tiles have the same edges.
///
/// @param parts  whose triangles do not overlap in the plane, each with its neighbours
/// Where the parts' heights agree at shared vertices check_tin finds nothing in the result that it
/// does not find in a part. Vertices come in the order in which the parts name them first.
/// Cost: O(n), and O(b log b) for b border vertices and edges.
Welded weld(std::span<const Tin* const> parts);

}  // namespace scarp
