#include "cli/build/finest_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error/error.h"
#include "core/occlusion/join_groups.h"
#include "core/terrain/weld.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/tin_file.h"

namespace scarp {

TileContents contents_of(const nlohmann::json& facts) {
  TileContents contents;
  contents.low = facts["low"].get<std::array<double, 3>>();
  contents.high = facts["high"].get<std::array<double, 3>>();
  contents.vertices = facts["vertices"].get<std::uint64_t>();
  contents.triangles = facts["triangles"].get<std::uint64_t>();
  return contents;
}

FinestTiles::FinestTiles(StepRun& run) : run_(run) {
  const TileScheme& scheme = run.plan().scheme;
  for (const TileId& id : scheme.tiles(scheme.finest_level())) {
    const nlohmann::json facts = run.facts_of(StepKind::kMesh, id);
    if (facts.contains("low")) tiles_.push_back({id, contents_of(facts)});
  }
}

std::vector<std::size_t> FinestTiles::tiles_in(const ViewPlan& plan) const {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    if (may_meet(tiles_[i].contents, plan)) numbers.push_back(i);
  return numbers;
}

std::vector<std::size_t> FinestTiles::tiles_towards(const Position& eye, std::size_t tile) const {
  // Where grid lines bend, samples of a tile's edge lie beside it, over the next tile.
  std::vector<std::size_t> numbers = tiles_in(view_towards(eye, tiles_[tile].contents));
  const std::vector<std::size_t> around = tiles_around(tile);
  std::vector<std::size_t> all;
  std::ranges::set_union(numbers, around, std::back_inserter(all));
  return all;
}

std::vector<std::size_t> FinestTiles::tiles_around(std::size_t tile) const {
  const TileId& middle = tiles_[tile].id;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    if (std::abs(tiles_[i].id.column - middle.column) <= 1 &&
        std::abs(tiles_[i].id.row - middle.row) <= 1)
      numbers.push_back(i);
  return numbers;
}

Tin FinestTiles::ground_of(const std::vector<std::size_t>& numbers) {
  std::vector<Tin> tins;
  for (const std::size_t i : numbers)
    tins.push_back(read_tin(*run_.open(tile_file_name(name_of(tiles_[i].id), "tin"))));
  if (tins.size() == 1) return std::move(tins.front());
  std::vector<const Tin*> parts;
  for (const Tin& tin : tins) parts.push_back(&tin);
  return weld(parts).tin;
}

Groups FinestTiles::groups_of(const std::vector<std::size_t>& numbers) {
  std::vector<Groups> groups;
  for (const std::size_t i : numbers)
    groups.push_back(read_groups(*run_.open(tile_file_name(name_of(tiles_[i].id), "groups"))));
  return join_groups(groups);
}

MapPoint place_observer(FinestTiles& tiles, const BuildOptions& options, const GeoFrame& frame) {
  // The place in the plane depends a little on the height.
  constexpr double kLeanM = 100;
  MapPoint point = to_map_point(*options.observer, options.crs, frame);
  point.height_m = 0;
  const GeoFrame::Placer placer(frame);
  const Tin ground = tiles.ground_of(tiles.tiles_in({placer.place(point), kLeanM, {}}));
  const TinIndex index(ground);
  const MapPoint at = resolve(*options.observer, options.crs, frame, index);
  if (ground.triangles.empty() || !ground_height_m(placer, index, at.x, at.y))
    throw Error(ErrorCode::kInput,
                fmt::format("--observer '{}': no ground is known there; in a scene of several "
                            "tiles a place on the data was expected; move it, or leave it out and "
                            "ask scarp viewshed",
                            options.observer->text));
  return at;
}

}  // namespace scarp
