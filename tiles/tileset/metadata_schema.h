#pragma once

#include <nlohmann/json.hpp>

namespace scarp {

/// Classes of 3D Tiles and glTF metadata, as both want them in a schema. docs/simulators.md has
/// what each property means.

/// Of the groups of a tile: the rows of its property table, in its glTF.
nlohmann::ordered_json group_class();
/// Of tiles, with the semantics that 3D Tiles has names for.
nlohmann::ordered_json tile_class();
/// Of tiles, where cameras are hidden from all of one (TileHorizon).
nlohmann::ordered_json horizon_class();
/// Of the tileset: its frame, and how exact it is.
nlohmann::ordered_json tileset_class();

}  // namespace scarp
