#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"
#include "core/terrain/tin.h"
#include "ingest/crs/geo_frame.h"
#include "tiles/store/scene.h"

namespace scarp {

/// How much of a scene is read at once.
struct ScenePart {
  std::uint64_t memory_bytes = 0;  ///< what it may take; 0: anything
  /// Where the finest level has more triangles, a coarser one is read, without groups.
  std::uint64_t most_triangles = std::numeric_limits<std::uint64_t>::max();
};

/// A scene in memory, with all that commands ask of it: the tiles of its finest level as one
/// surface, which takes what the whole mesh takes.
/// Throws as open_scene; Error{kResource}, before the work, where it takes more than it may.
struct LoadedScene {
  LoadedScene(const std::string& path, const ScenePart& part);

  Scene scene;
  std::int32_t level;  ///< that is read
  bool is_finest;
  Groups groups;  ///< none where it is not the finest
  Tin tin;
  GeoFrame frame;
  TinIndex index;
};

/// What a triangle takes at most while tiles are made one surface with an index, and with groups
/// and their regions, bytes.
inline constexpr double kBytesPerGroundTriangle = 240;
inline constexpr double kBytesPerGroupedTriangle = 320;

/// Throws Error{kResource} where so many triangles take more than is allowed. @param allowed  0:
/// anything
void check_room(const std::string& scene, std::uint64_t triangles, double bytes_per_triangle,
                std::uint64_t allowed, const std::string& remedy);

/// The groups of a tile. Throws Error{kCorrupt} where they are not of as many triangles.
Groups read_tile_groups(const Scene& scene, const SceneTile& tile, std::size_t triangles);

/// The scene among the sources of a command, or nothing where all are DEMs.
/// Throws Error{kUsage} where a scene is not alone, or options for reading a DEM are given with it.
const std::string* scene_among(const std::vector<std::string>& sources, const DemOptions& options);

/// The frame that a scene was built in.
FrameDescription frame_of(const SceneDescription& description);

/// What a typed position means in map coordinates of the scene: converted from `crs` where that is
/// given, its height above the datum of the data.
///
/// Throws Error{kInput} where a height above ground is asked for and there is no ground.
MapPoint resolve(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame,
                 const TinIndex& index);

/// Height of the ground at a map point, metres above the datum of the data, or nothing over void.
std::optional<double> ground_height_m(const GeoFrame::Placer& placer, const TinIndex& index,
                                      double x, double y);

/// Height of each vertex above the datum of the data.
std::vector<double> vertex_heights_m(const Tin& tin, const GeoFrame& frame);

}  // namespace scarp
