#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/scene_tiles.h"
#include "core/culling/camera.h"

namespace scarp {

/// What a camera is told of a scene, tile by tile.
struct CullCounts {
  std::string method;
  std::vector<GroupIndex> visible_groups;  ///< by their numbers in the scene
  /// Of the tiles that the view meets, those included that the tree across tiles hides.
  std::uint64_t groups = 0, nodes_tested = 0, triangles = 0, orphans = 0, drawn = 0;
  std::uint64_t tiles_hidden = 0;  ///< as a whole, and not read
};

/// The camera at a place of the map that looks around an azimuth, or all around.
/// @param azimuth_deg  of the middle of the view; none: all around
Camera camera_at(const GeoFrame& frame, const MapPoint& at, std::optional<double> azimuth_deg,
                 double field_of_view_deg);

/// What a camera has to draw of a scene, tile by tile: the work of `scarp cull` and of the server.
/// Only tiles that the view meets within the distance are read, and only groups within it count. Of
/// these, tiles that the tree across tiles hides are not read either, which changes nothing else:
/// all their groups are hidden.
/// @param method  as culling_method has it. Throws as it, and as reading tiles.
CullCounts cull_scene(SceneTiles& tiles, const Camera& camera, const std::string& method,
                      double distance_m);

}  // namespace scarp
