#include "cli/sight_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/ground_eye.h"
#include "cli/loaded_scene.h"
#include "cli/part_ground.h"
#include "core/error/error.h"
#include "core/sight/line_of_sight.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/sight_profile.h"

namespace scarp {
namespace {

double plan_distance_m(const Position& a, const Position& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

class GridSurface : public SightSurface {
 public:
  explicit GridSurface(std::shared_ptr<const Ground> ground)
      : owner_(std::move(ground)), ground_(*owner_), placer_(frame()) {}

  const char* name() const override { return "grid"; }
  const GeoFrame& frame() const override { return *ground_.dem.frame; }

  SightEnd place(const TypedPosition& typed, const std::string& crs) const override {
    return end_of(place_eye(typed, crs, ground_));
  }
  SightEnd place(const MapPoint& map) const override {
    return end_of(place_eye(map, ground_, placer_));
  }

  Sight judge(const Position& a, const Position& b) const override {
    const Seen seen = GridSight(ground_.grid, a).judge(b);
    return seen == Seen::kVisible  ? Sight::kVisible
           : seen == Seen::kHidden ? Sight::kHidden
                                   : Sight::kUnknown;
  }
  GroundAlong ground_along(const Position& a, const Position& b) const override {
    return GridSight(ground_.grid, a).ground_along(b);
  }
  // Only the grid's lines block.
  bool starts_under_ground(const Position&, const Position&) const override { return false; }

  double reach_m(const Position& from) const override {
    const GroundGrid& grid = ground_.grid;
    double reach_m = 0;
    for (std::int32_t c = 0; c < grid.columns(); ++c)
      for (const std::int32_t r : {0, grid.rows() - 1})
        reach_m = std::max(reach_m, plan_distance_m(from, grid.at(c, r)));
    for (std::int32_t r = 0; r < grid.rows(); ++r)
      for (const std::int32_t c : {0, grid.columns() - 1})
        reach_m = std::max(reach_m, plan_distance_m(from, grid.at(c, r)));
    return reach_m;
  }

 private:
  static SightEnd end_of(const GroundEye& eye) { return {eye.position, eye.map, eye.ground_m}; }

  std::shared_ptr<const Ground> owner_;
  const Ground& ground_;
  GeoFrame::Placer placer_;
};

class TinSurface : public SightSurface {
 public:
  /// @param owner  of the others
  /// @param tiles  that the surface is made of
  TinSurface(std::shared_ptr<const void> owner, const TinIndex& index, const GeoFrame& frame,
             const SceneTiles* tiles)
      : owner_(std::move(owner)), index_(index), frame_(frame), placer_(frame), tiles_(tiles) {}

  const char* name() const override { return "tin"; }
  const GeoFrame& frame() const override { return frame_; }

  SightEnd place(const TypedPosition& typed, const std::string& crs) const override {
    return place(resolve(typed, crs, frame_, index_));
  }
  SightEnd place(const MapPoint& map) const override {
    return {placer_.place(map), map, ground_height_m(placer_, index_, map.x, map.y)};
  }

  Sight judge(const Position& a, const Position& b) const override {
    return line_of_sight(index_, a, b);
  }
  GroundAlong ground_along(const Position& a, const Position& b) const override {
    return scarp::ground_along(index_, a, b);
  }
  bool starts_under_ground(const Position& a, const Position& b) const override {
    const auto blocker = first_blocker(index_, a, b);
    return blocker && blocker->from == kNone && blocker->fraction == 0;
  }

  double reach_m(const Position& from) const override {
    double reach_m = 0;
    for (const Position& p : index_.tin().vertices)
      reach_m = std::max(reach_m, plan_distance_m(from, p));
    return reach_m;
  }

  std::size_t tiles() const override { return tiles_->size(); }
  std::size_t tiles_read() const override { return tiles_->tiles_read(); }

 private:
  std::shared_ptr<const void> owner_;
  const TinIndex& index_;
  const GeoFrame& frame_;
  GeoFrame::Placer placer_;
  const SceneTiles* tiles_;
};

/// Where an end is in the plane, and how far aside it comes when it is raised, by the lean of its
/// normal.
struct Foot {
  Position place;
  double lean_m;
};

Foot foot_of(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame) {
  const GeoFrame::Placer placer(frame);
  MapPoint point = to_map_point(typed, crs, frame);
  const double greatest_m = std::max(point.height_m, 0.0) + kGreatestFreeHeightM;
  point.height_m = 0;
  const Position place = placer.place(point);
  point.height_m = greatest_m;
  return {place, plan_distance_m(place, placer.place(point))};
}

/// The tiles that a line passes over, or that one passes over that has an end raised or lowered.
AskedLines lines_of(const SceneTiles& tiles, const std::optional<TypedLine>& line) {
  if (!line) return {tiles.tiles_in({}), {}};
  const Foot from = foot_of(line->from, line->crs, tiles.frame());
  const Foot to = foot_of(line->to, line->crs, tiles.frame());
  return {tiles.tiles_along(from.place, to.place, std::max(from.lean_m, to.lean_m)),
          {{from.place, from.lean_m, {}}, {to.place, to.lean_m, {}}}};
}

/// The tiles along a line as one surface, or all where that does not do.
struct SceneAlong {
  SceneAlong(const std::string& path, const std::optional<TypedLine>& line,
             std::uint64_t memory_bytes)
      : tiles(path), ground(tiles, lines_of(tiles, line), memory_bytes, "raise --memory") {}

  SceneTiles tiles;
  PartGround ground;
};

}  // namespace

std::unique_ptr<SightSurface> open_surface(const std::vector<std::string>& sources,
                                           const DemOptions& options, const Progress& progress,
                                           const std::optional<TypedLine>& line) {
  const std::string* scene = scene_among(sources, options);
  if (!scene)
    return std::make_unique<GridSurface>(
        std::make_shared<const Ground>(read_ground(sources, options, progress)));
  const auto along = std::make_shared<const SceneAlong>(*scene, line, options.memory_budget_bytes);
  return std::make_unique<TinSurface>(along, along->ground.index(), along->tiles.frame(),
                                      &along->tiles);
}

std::unique_ptr<SightSurface> surface_over(std::shared_ptr<const ViewSource> source) {
  if (source->tin_index() != nullptr)
    return std::make_unique<TinSurface>(source, *source->tin_index(), *source->dem().frame,
                                        source->scene_tiles());
  const Ground& ground = source->dem_ground();
  return std::make_unique<GridSurface>(std::shared_ptr<const Ground>(std::move(source), &ground));
}

SurfaceNote note_of(const SightSurface& surface) {
  return note_of(surface.name(), surface.frame().description());
}

}  // namespace scarp
