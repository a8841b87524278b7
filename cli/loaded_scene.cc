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

/// The tiles of a level that have a mesh.
std::vector<const SceneTile*> tiles_of(const Scene& scene, std::int32_t level) {
  std::vector<const SceneTile*> tiles;
  for (const SceneTile& tile : scene.description().tiles)
    if (tile_id(tile).level == level && scene.find(tile.id, "tin") != nullptr)
      tiles.push_back(&tile);
  std::ranges::sort(tiles, {}, [](const SceneTile* tile) { return tile_id(*tile); });
  return tiles;
}

std::uint64_t triangles_of(const std::vector<const SceneTile*>& tiles) {
  std::uint64_t triangles = 0;
  for (const SceneTile* tile : tiles)
    if (tile->contents) triangles += tile->contents->triangles;
  return triangles;
}

std::int32_t finest_level(const Scene& scene) {
  std::int32_t finest = 0;
  for (const SceneTile& tile : scene.description().tiles)
    finest = std::max(finest, tile_id(tile).level);
  return finest;
}

/// The finest level of no more triangles than asked for; near the root of a narrow scene there may
/// be no tile, and the level before has all.
std::int32_t level_within(const Scene& scene, std::uint64_t most_triangles) {
  std::int32_t level = finest_level(scene);
  while (level > 0 && triangles_of(tiles_of(scene, level)) > most_triangles &&
         !tiles_of(scene, level - 1).empty())
    --level;
  return level;
}

/// The tiles of a level as one surface. @param groups  null: not asked for
Tin read_surface(const Scene& scene, std::int32_t level, const ScenePart& part, Groups* groups) {
  const std::vector<const SceneTile*> tiles = tiles_of(scene, level);
  if (tiles.empty())
    throw Error(ErrorCode::kCorrupt,
                fmt::format("'{}': has no tile with a mesh; build the scene again", scene.path()));
  check_room(scene.path(), triangles_of(tiles),
             groups ? kBytesPerGroupedTriangle : kBytesPerGroundTriangle, part.memory_bytes,
             "raise --memory; scarp cull and scarp viewshed --max-distance read parts of it");
  std::vector<Tin> tins;
  std::vector<Groups> groups_of_tile;
  for (const SceneTile* tile : tiles) {
    tins.push_back(read_tin(scene.open(scene.require(tile->id, "tin"))));
    if (groups)
      groups_of_tile.push_back(read_tile_groups(scene, *tile, tins.back().triangles.size()));
  }
  if (groups)
    *groups = groups_of_tile.size() == 1 ? std::move(groups_of_tile.front())
                                         : join_groups(groups_of_tile);
  if (tins.size() == 1) return std::move(tins.front());
  std::vector<const Tin*> parts;
  for (const Tin& tin : tins) parts.push_back(&tin);
  return weld(parts).tin;
}

}  // namespace

void check_room(const std::string& scene, std::uint64_t triangles, double bytes_per_triangle,
                std::uint64_t allowed, const std::string& remedy) {
  const double needed = bytes_per_triangle * static_cast<double>(triangles);
  if (allowed == 0 || needed <= static_cast<double>(allowed)) return;
  throw Error(ErrorCode::kResource,
              fmt::format("'{}': {} triangles take about {:.2f} GiB at once, and --memory allows "
                          "{:.2f} GiB; {}",
                          scene, triangles, needed / 0x1p30, static_cast<double>(allowed) / 0x1p30,
                          remedy));
}

LoadedScene::LoadedScene(const std::string& path, const ScenePart& part)
    : scene(open_scene(path)),
      level(level_within(scene, part.most_triangles)),
      is_finest(level == finest_level(scene)),
      tin(read_surface(scene, level, part, is_finest ? &groups : nullptr)),
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
