#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/loaded_scene.h"
#include "cli/scene_culling.h"

namespace scarp {

int run_cull(const CullOptions& options) {
  const LoadedScene scene(options.scene);
  const MapPoint at = resolve(options.camera, options.crs, scene.frame, scene.index);
  const GeoFrame::Placer placer(scene.frame);
  Camera camera{placer.place(at), {}};
  if (options.azimuth_deg) {
    const double half_deg = options.field_of_view_deg / 2;
    const double from_rad = placer.plane_direction_rad(at, *options.azimuth_deg + half_deg);
    double to_rad = placer.plane_direction_rad(at, *options.azimuth_deg - half_deg);
    while (to_rad < from_rad) to_rad += 2 * M_PI;
    camera.view = ViewRange{from_rad, to_rad};
  }
  const std::unique_ptr<CullingMethod> method = culling_method(scene, options.method);
  const CullingAnswer answer = method->visible(camera);
  std::uint64_t drawn = 0, orphans = 0;
  for (const GroupIndex group : answer.visible_groups) drawn += scene.groups.nodes[group].triangles;
  for (const GroupIndex group : scene.groups.group_of_triangle) orphans += group == kNone;
  const std::uint64_t triangles = scene.tin.triangles.size();

  if (options.common.json) {
    const nlohmann::json result = {
        {"method", method->name()},
        {"camera", {{"x", at.x}, {"y", at.y}, {"height_m", at.height_m}}},
        {"groups", scene.groups.leaf_count},
        {"visible_groups", answer.visible_groups},
        {"nodes_tested", answer.nodes_tested},
        {"triangles", triangles},
        {"orphans", orphans},
        {"drawn", drawn + orphans},
        {"culled", triangles - drawn - orphans}};
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print(
      "{} of {} groups may be visible; {} of {} triangles are culled ({:.1f} %)\n",
      answer.visible_groups.size(), scene.groups.leaf_count, triangles - drawn - orphans, triangles,
      100.0 * static_cast<double>(triangles - drawn - orphans) / static_cast<double>(triangles));
  fmt::print("{}\n", fmt::join(answer.visible_groups, " "));
  return 0;
}

}  // namespace scarp
