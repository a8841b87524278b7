#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/occlusion/certified/tile_horizon.h"
#include "core/occlusion/groups.h"
#include "core/terrain/tile_scheme.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A tile of the tree: where cameras are hidden from all of its groups, and of all below it.
struct TileNode {
  TileId tile;
  TileHorizon horizon;
};

/// The group tree across tiles: above the groups of each tile of the finest level the tile, and
/// above tiles the quadtree up to one root. A camera that a node hides is hidden from every group
/// below by the group's own region, so that leaving those out changes no answer.
struct TileTree {
  std::vector<TileNode>
      nodes;  ///< by rising TileId, the root first; tiles without ground are left out
};

/// The node of a tile of the finest level.
/// @param bounds  of its mesh
/// Side: nothing is hidden where a triangle is in no group, or groups have no certified regions.
/// Cost: as cover_groups.
TileNode tile_node(const TileId& tile, const Bounds& bounds, const Groups& groups);

/// The tree above nodes of one level (asserted), in any order; no tree above none.
/// Side: a node hides nothing that one below it does not hide.
/// Cost: some milliseconds a node.
TileTree tree_over(std::vector<TileNode> tiles);

/// Tiles of the finest level that are hidden from a camera.
struct HiddenTiles {
  std::vector<TileId> tiles;  ///< by rising TileId
  std::size_t nodes_tested = 0;
};

/// From the root on: a node that is hidden ends the descent. Requires what check_tile_tree checks.
HiddenTiles hidden_tiles(const TileTree& tree, const Position& eye);

/// Names the first broken invariant, or nothing: one layout, and as many slopes as it has cells;
/// finite numbers, radii above zero, slopes not NaN; nodes by rising tile, the first above all
/// others, and above each the tile that holds it; all that have none below at one level.
/// Cost: O(cells).
std::optional<std::string> check_tile_tree(const TileTree& tree);

/// The same for what it costs more to see: that a node hides nothing that one below it shows, at
/// the middle of each cell.
std::optional<std::string> check_tile_tree_bounds(const TileTree& tree);

}  // namespace scarp
