#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/geodesy/flattening.h"
#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"
#include "core/terrain/tile_scheme.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A tile of a scene, as its culling file has it.
struct CullingTile {
  TileId id;
  bool is_finest = false;
  Bounds bounds;  ///< of its mesh
  // Of finest tiles, counted on in the order of the list:
  std::uint32_t groups = 0;
  std::size_t triangles = 0;
};

/// What a culling file is made of.
struct CullingSource {
  /// The frame on the Earth; nothing where the scene is flat.
  std::optional<Flattening> frame;
  EcefPoint flat_origin;             ///< of a flat scene: metres of the map at the frame's origin
  std::vector<CullingTile> tiles;    ///< the finest ones in the order of the scene's groups
  const Groups* groups = nullptr;    ///< of all finest tiles, with certified regions
  const TinIndex* ground = nullptr;  ///< all finest tiles as one surface, in the same order
};

/// The bytes of a culling file, which tiles/runtime/scarp_runtime.h reads; docs/runtime.md has
/// them.
///
/// Side: regions only shrink. Centres of groups are rounded to the unit (the reader allows for it),
/// their heights and slopes down, boxes outwards, heights of ground down.
/// Same source, same bytes. Requires certified regions (asserted).
/// Cost: O(n log n) for n triangles, and the file in memory.
std::vector<std::byte> culling_file(const CullingSource& source);

}  // namespace scarp
