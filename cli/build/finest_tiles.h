#pragma once

#include <optional>
#include <vector>

#include "cli/build/step_run.h"
#include "cli/scene_tiles.h"
#include "core/occlusion/groups.h"
#include "tiles/store/scene_description.h"

namespace scarp {

/// Tiles of the finest level of a scene that is being built and has its meshes: for what is made of
/// parts of the scene that are larger than a tile. Reads the records of the steps, and meshes when
/// they are asked for.
class FinestTiles {
 public:
  explicit FinestTiles(StepRun& run);

  struct Tile {
    TileId id;
    TileContents contents;  ///< groups are not filled in
  };
  /// Those that have ground, by rising row, then column.
  const std::vector<Tile>& tiles() const { return tiles_; }

  /// Numbers of the tiles that may have ground in a part of the plane.
  std::vector<std::size_t> tiles_in(const ViewPlan& plan) const;
  /// Numbers of the tiles that lines from an eye to a tile may pass over, and of those around it.
  std::vector<std::size_t> tiles_towards(const Position& eye, std::size_t tile) const;
  /// Numbers of a tile and of those around it: a rectangle, so that lines within stay in it.
  std::vector<std::size_t> tiles_around(std::size_t tile) const;

  /// Tiles as one surface, and their groups as those of one.
  Tin ground_of(const std::vector<std::size_t>& numbers);
  Groups groups_of(const std::vector<std::size_t>& numbers);

 private:
  StepRun& run_;
  std::vector<Tile> tiles_;
};

/// What a mesh step recorded of its tile.
TileContents contents_of(const nlohmann::json& facts);

/// Where --observer stands, by the meshes around. Throws Error{kInput} where there is no ground,
/// also for a height above the datum: what is void there only the whole scene could tell.
MapPoint place_observer(FinestTiles& tiles, const BuildOptions& options, const GeoFrame& frame);

}  // namespace scarp
