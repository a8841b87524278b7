#include "cli/camera_culling.h"

#include <cmath>

#include "cli/scene_culling.h"

namespace scarp {
namespace {

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

Camera camera_at(const GeoFrame& frame, const MapPoint& at, std::optional<double> azimuth_deg,
                 double field_of_view_deg) {
  const GeoFrame::Placer placer(frame);
  Camera camera{placer.place(at), {}};
  if (azimuth_deg) {
    const double half_deg = field_of_view_deg / 2;
    const double from_rad = placer.plane_direction_rad(at, *azimuth_deg + half_deg);
    double to_rad = placer.plane_direction_rad(at, *azimuth_deg - half_deg);
    while (to_rad < from_rad) to_rad += 2 * M_PI;
    camera.view = ViewRange{from_rad, to_rad};
  }
  return camera;
}

CullCounts cull_scene(SceneTiles& tiles, const Camera& camera, const std::string& method,
                      double distance_m) {
  CullCounts counts;
  SceneTiles::HiddenFrom hidden;
  // Only certified scenes have a tree.
  if (method != "thesis") hidden = tiles.hidden_from(camera.eye);
  counts.nodes_tested = hidden.nodes_tested;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (!tiles.meets(i, {camera.eye, distance_m, camera.view})) continue;
    if (!hidden.tiles.empty() && hidden.tiles[i]) {
      const TileContents& contents = tiles.tile(i).contents.value();
      counts.method = "certified";
      counts.groups += contents.groups;
      counts.triangles += contents.triangles;
      ++counts.tiles_hidden;
      continue;
    }
    const Groups groups = tiles.read_groups(i);
    if (groups.leaf_count == 0 && tiles.size() > 1) continue;
    const auto culling = culling_method(tiles.scene(), groups, method);
    counts.method = culling->name();
    cull_tile(groups, tiles.first_group(i), *culling, camera, distance_m, counts);
  }
  counts.drawn += counts.orphans;
  return counts;
}

}  // namespace scarp
