#include <nlohmann/json.hpp>

#include "cli/culling_source.h"
#include "cli/export.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "tiles/culling/culling_tables.h"

namespace scarp {

void export_groups(const ExportOptions& options, SceneTiles&, const PartFolder& folder,
                   Stages& stages, nlohmann::json& result) {
  std::unique_ptr<LoadedScene> scene;
  stages.run("read", [&](const Progress&) {
    scene =
        std::make_unique<LoadedScene>(options.scene, ScenePart{options.common.memory_budget_bytes});
  });
  const CullingSource source = culling_source(*scene);
  std::vector<std::byte> bytes;
  stages.run("groups.scarp", [&](const Progress&) {
    bytes = culling_file(source);
    folder.write("groups.scarp", bytes);
  });
  stages.run("groups.gpkg", [&](const Progress&) {
    write_culling_tables(folder.path_for("groups.gpkg"), bytes, scene->scene.description().crs_wkt);
  });
  result["groups"] = scene->groups.leaf_count;
  result["tiles"] = source.tiles.size();
  result["triangles"] = scene->tin.triangles.size();
  result["bytes"] = bytes.size();
}

}  // namespace scarp
