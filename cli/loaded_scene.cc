#include "cli/loaded_scene.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error/error.h"
#include "core/occlusion/join_groups.h"
#include "core/terrain/weld.h"
#include "core/threads/parallel_for.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {

const std::string* scene_among(const std::vector<std::string>& sources, const DemOptions& options) {
  const auto scene = std::find_if(sources.begin(), sources.end(), is_scene);
  if (scene == sources.end()) return nullptr;
  if (sources.size() > 1)
    throw Error(ErrorCode::kUsage,
                fmt::format("'{}': is a scene; it was expected alone, or DEM files", *scene));
  if (options.earth || options.refraction != 0 || !options.geoid_file.empty() ||
      options.height_unit || options.nodata)
    throw Error(ErrorCode::kUsage,
                fmt::format("'{}': is a scene, which has its earth, refraction, geoid, unit and "
                            "void; leave --earth, --refraction, --geoid, --height-unit and "
                            "--nodata out, or build it again with them",
                            *scene));
  return &*scene;
}

FrameDescription frame_of(const SceneDescription& description) {
  FrameDescription frame;
  frame.crs_wkt = description.crs_wkt;
  frame.earth = description.earth.shape == EarthShape::kFlat ? Earth::kFlat : Earth::kEllipsoid;
  frame.refraction = description.earth.refraction;
  frame.geoid_file = description.earth.geoid;
  frame.centre_x = description.earth.centre[0];
  frame.centre_y = description.earth.centre[1];
  return frame;
}

Groups read_tile_groups(const Scene& scene, const SceneTile& tile, std::size_t triangles) {
  Groups groups = read_groups(scene.open(scene.require(tile.id, "groups")));
  if (groups.group_of_triangle.size() != triangles)
    throw Error(
        ErrorCode::kCorrupt,
        fmt::format("'{}': groups of {} triangles for a mesh of {}; files of one scene were "
                    "expected; build it again",
                    scene.path(), groups.group_of_triangle.size(), triangles));
  return groups;
}

namespace {

/// The tiles of the finest level as one surface.
Tin read_surface(const Scene& scene, Groups& groups) {
  std::vector<Tin> tins;
  std::vector<Groups> groups_of_tile;
  for (const std::size_t i : finest_tiles(scene.description())) {
    const SceneTile& tile = scene.description().tiles[i];
    if (scene.find(tile.id, "tin") == nullptr) continue;  // void
    tins.push_back(read_tin(scene.open(scene.require(tile.id, "tin"))));
    groups_of_tile.push_back(read_tile_groups(scene, tile, tins.back().triangles.size()));
  }
  if (tins.empty())
    throw Error(ErrorCode::kCorrupt,
                fmt::format("'{}': has no tile with a mesh; build the scene again", scene.path()));
  if (tins.size() == 1) {
    groups = std::move(groups_of_tile.front());
    return std::move(tins.front());
  }
  groups = join_groups(groups_of_tile);
  std::vector<const Tin*> parts;
  for (const Tin& tin : tins) parts.push_back(&tin);
  return weld(parts).tin;
}

}  // namespace

LoadedScene::LoadedScene(const std::string& path)
    : scene(open_scene(path)),
      tin(read_surface(scene, groups)),
      frame(frame_of(scene.description())),
      index(tin) {}

std::optional<double> ground_height_m(const GeoFrame::Placer& placer, const TinIndex& index,
                                      double x, double y) {
  // Away from the scene's centre the normal leans a little against the frame's vertical, so the
  // place in the plane depends on the height: each round leaves less than a thousandth of the lean.
  double height_m = 0;
  for (int round = 0; round < 3; ++round) {
    Position p = placer.place({x, y, height_m});
    const auto ground_m = index.ground_height_m(p.x_m, p.y_m);
    if (!ground_m) return {};
    p.z_m = *ground_m;
    height_m = placer.unplace(p).height_m;
  }
  return height_m;
}

MapPoint resolve(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame,
                 const TinIndex& index) {
  MapPoint point = to_map_point(typed, crs, frame);
  if (typed.above_datum) return point;
  const auto ground_m = ground_height_m(GeoFrame::Placer(frame), index, point.x, point.y);
  if (!ground_m)
    throw Error(ErrorCode::kInput,
                fmt::format("position '{}': no ground is known there; a place on the data was "
                            "expected; check the order X,Y and --crs, or give an absolute height "
                            "such as {:g},{:g},1200asl",
                            typed.text, typed.x, typed.y));
  point.height_m += *ground_m;
  return point;
}

std::vector<double> vertex_heights_m(const Tin& tin, const GeoFrame& frame) {
  std::vector<double> heights_m(tin.vertices.size());
  constexpr std::size_t kBlock = 4096;
  parallel_for((heights_m.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const GeoFrame::Placer placer(frame);
    const std::size_t end = std::min((block + 1) * kBlock, heights_m.size());
    for (std::size_t v = block * kBlock; v < end; ++v)
      heights_m[v] = placer.unplace(tin.vertices[v]).height_m;
  });
  return heights_m;
}

}  // namespace scarp
