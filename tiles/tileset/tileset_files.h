#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/geodesy/flattening.h"
#include "core/occlusion/certified/tile_horizon.h"
#include "core/terrain/tile_scheme.h"
#include "tiles/tileset/tile_ground.h"

/// The files of a 3D Tiles 1.1 tileset around its tiles' glTF: tileset.json and subtrees, for a
/// quadtree that is told in bits (implicit tiling). docs/simulators.md has what they hold.
namespace scarp {

/// A tile of the implicit quadtree: x grows with the columns of the raster, y along the tileset's
/// y axis.
struct ImplicitPlace {
  std::int32_t level = 0, x = 0, y = 0;

  friend auto operator<=>(const ImplicitPlace&, const ImplicitPlace&) = default;
};

/// @param rows_fall  whether the raster's rows run against the y axis, as in most rasters
ImplicitPlace implicit_place(const TileId& tile, bool rows_fall);

struct TilesetTile {
  bool has_content = false;
  TileFacts facts;
  double geometric_error_m = 0;
  std::optional<EcefPoint> horizon_point;  ///< of the scaled space
  std::optional<TileHorizon> horizon;      ///< for all tiles or none
};

/// All tiles that there are, those above a tile included.
using TilesetTiles = std::map<ImplicitPlace, TilesetTile>;

struct TilesetDescription {
  std::array<double, 16> transform{};  ///< of the root
  TileBox root_box;                    ///< that implicit tiles are halves of halves of
  double geometric_error_m = 0;        ///< of a tileset that is not drawn at all
  bool has_horizons = false;
  // What the tileset's metadata say:
  std::string heights, datum_shift;
  double position_error_m = 0;
  double refraction = 0;
  EcefPoint frame_origin, frame_centre;
};

/// Name of a tile's glTF, "tiles/2/1/3.glb".
std::string content_name(const ImplicitPlace& place);

/// Requires a root among the tiles (asserted).
std::string tileset_json(const TilesetDescription& tileset, const TilesetTiles& tiles);

/// Names and bytes of all subtree files.
std::map<std::string, std::vector<std::byte>> subtree_files(const TilesetTiles& tiles,
                                                            bool has_horizons);

/// Levels of a subtree, for so many levels in all.
std::int32_t subtree_levels(std::int32_t levels);

}  // namespace scarp
