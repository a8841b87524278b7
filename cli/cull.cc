#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/scene_culling.h"
#include "cli/scene_tiles.h"
#include "core/error/error.h"

namespace scarp {
namespace {

double seconds_now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

/// What a camera is told of a scene, tile by tile.
struct CullCounts {
  std::string method;
  std::vector<GroupIndex> visible_groups;  ///< by their numbers in the scene
  std::uint64_t groups = 0, nodes_tested = 0, triangles = 0, orphans = 0, drawn = 0;
};

/// Whether a group is within a distance from the eye, in plan.
bool is_within(const GroupNode& group, const Position& eye, double distance_m) {
  return std::hypot(group.centre_x_m - eye.x_m, group.centre_y_m - eye.y_m) - group.radius_m <=
         distance_m;
}

void cull_tile(const Groups& groups, GroupIndex first_group, CullingMethod& method,
               const Camera& camera, double distance_m, CullCounts& counts) {
  const CullingAnswer answer = method.visible(camera);
  counts.nodes_tested += answer.nodes_tested;
  counts.groups += groups.leaf_count;
  counts.triangles += groups.group_of_triangle.size();
  for (const GroupIndex group : groups.group_of_triangle) counts.orphans += group == kNone;
  for (const GroupIndex group : answer.visible_groups) {
    if (!is_within(groups.nodes[group], camera.eye, distance_m)) continue;
    counts.visible_groups.push_back(first_group + group);
    counts.drawn += groups.nodes[group].triangles;
  }
}

}  // namespace

int run_cull(const CullOptions& options) {
  if (!options.entities_file.empty()) return run_cull_entities(options);
  const double begun_s = seconds_now();
  SceneTiles tiles(options.scene);
  const double opened_s = seconds_now();
  const MapPoint at = tiles.resolve(options.camera, options.crs);
  const GeoFrame::Placer placer(tiles.frame());
  Camera camera{placer.place(at), {}};
  if (options.azimuth_deg) {
    const double half_deg = options.field_of_view_deg / 2;
    const double from_rad = placer.plane_direction_rad(at, *options.azimuth_deg + half_deg);
    double to_rad = placer.plane_direction_rad(at, *options.azimuth_deg - half_deg);
    while (to_rad < from_rad) to_rad += 2 * M_PI;
    camera.view = ViewRange{from_rad, to_rad};
  }
  const double distance_m = options.max_distance_m.value_or(HUGE_VAL);
  CullCounts counts;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (!tiles.meets(i, {camera.eye, distance_m, camera.view})) continue;
    const Groups groups = tiles.read_groups(i);
    if (groups.leaf_count == 0 && tiles.size() > 1) continue;
    const auto method = culling_method(tiles.scene(), groups, options.method);
    counts.method = method->name();
    cull_tile(groups, tiles.first_group(i), *method, camera, distance_m, counts);
  }
  const double answered_s = seconds_now();
  counts.drawn += counts.orphans;

  if (options.common.json) {
    const nlohmann::json result = {
        {"method", counts.method},
        {"camera", {{"x", at.x}, {"y", at.y}, {"height_m", at.height_m}}},
        {"tiles", tiles.size()},
        {"tiles_read", tiles.tiles_read()},
        {"groups", counts.groups},
        {"visible_groups", counts.visible_groups},
        {"nodes_tested", counts.nodes_tested},
        {"triangles", counts.triangles},
        {"orphans", counts.orphans},
        {"drawn", counts.drawn},
        {"culled", counts.triangles - counts.drawn},
        {"open_s", opened_s - begun_s},
        {"answer_s", answered_s - opened_s}};
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{} of {} groups may be visible; {} of {} triangles are culled ({:.1f} %)",
             counts.visible_groups.size(), counts.groups, counts.triangles - counts.drawn,
             counts.triangles,
             100.0 * static_cast<double>(counts.triangles - counts.drawn) /
                 static_cast<double>(std::max<std::uint64_t>(1, counts.triangles)));
  if (tiles.size() > 1) fmt::print("; {} of {} tiles read", tiles.tiles_read(), tiles.size());
  fmt::print("\n{}\n", fmt::join(counts.visible_groups, " "));
  return 0;
}

}  // namespace scarp
