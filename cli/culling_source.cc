#include "cli/culling_source.h"

#include <fmt/format.h>

#include "core/error/error.h"

namespace scarp {

CullingSource culling_source(const LoadedScene& scene) {
  if (!scene.groups.has_certified() && scene.groups.leaf_count > 0)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': has no certified regions, which were expected; build it with "
                            "--horizon certified or both",
                            scene.scene.path()));
  CullingSource source;
  if (const auto earth = scene.frame.earth_frame())
    source.frame = earth->frame;
  else
    source.flat_origin = {scene.frame.description().centre_x * scene.frame.metres_per_unit(),
                          scene.frame.description().centre_y * scene.frame.metres_per_unit(), 0};
  const SceneDescription& description = scene.scene.description();
  std::vector<char> is_finest(description.tiles.size(), 0);
  const auto add = [&](std::size_t i) {
    const SceneTile& tile = description.tiles[i];
    if (scene.scene.find(tile.id, "tin") == nullptr) return;  // void
    CullingTile made;
    made.id = tile_id(tile);
    made.is_finest = is_finest[i] != 0;
    if (tile.contents) {
      const auto& [low, high] = std::pair(tile.contents->low, tile.contents->high);
      made.bounds = {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
      made.groups = static_cast<std::uint32_t>(tile.contents->groups);
      made.triangles = tile.contents->triangles;
    } else if (description.tiles.size() == 1) {
      made.bounds = bounds_of(scene.tin.vertices);
      made.groups = scene.groups.leaf_count;
      made.triangles = scene.tin.triangles.size();
    } else {
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': tile {} does not tell what it holds; build the scene again",
                              scene.scene.path(), tile.id));
    }
    source.tiles.push_back(made);
  };
  const std::vector<std::size_t> finest = finest_tiles(description);
  for (const std::size_t i : finest) is_finest[i] = 1;
  for (const std::size_t i : finest) add(i);
  for (std::size_t i = 0; i < description.tiles.size(); ++i)
    if (!is_finest[i]) add(i);
  source.groups = &scene.groups;
  source.ground = &scene.index;
  return source;
}

}  // namespace scarp
