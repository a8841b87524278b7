#include <nlohmann/json.hpp>

#include "cli/build/layers.h"
#include "cli/export.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "tiles/layers/geopackage.h"

namespace scarp {

void export_geopackage(const ExportOptions&, SceneTiles& scene, const PartFolder& folder,
                       Stages& stages, nlohmann::json& result) {
  std::uint64_t groups_written = 0;
  const auto give = [&](const TakeGroups& take, const Progress& progress) {
    for (std::size_t i = 0; i < scene.size(); ++i) {
      const Tin tin = scene.read_tin(i);
      const Groups groups = read_tile_groups(scene.scene(), scene.tile(i), tin.triangles.size());
      std::vector<GroupPolygon> polygons =
          group_polygons(tin, groups, vertex_heights_m(tin, scene.frame()), scene.frame());
      for (GroupPolygon& polygon : polygons) {
        polygon.group += scene.first_group(i);
        // Nodes of the tree above groups are numbered in each tile for itself.
        if (scene.size() > 1) polygon.parent = -1;
      }
      take(polygons);
      groups_written += polygons.size();
      if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(scene.size()));
    }
  };
  stages.run("groups", [&](const Progress& progress) {
    write_group_polygons_in_pieces(
        folder.path_for("groups.gpkg"), folder.path_for("growing.gpkg"),
        [&](const TakeGroups& take) { give(take, progress); }, scene.scene().description().crs_wkt,
        Existing::kRefuse);
  });
  result["groups"] = groups_written;
}

}  // namespace scarp
