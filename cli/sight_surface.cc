#include "cli/sight_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/ground_eye.h"
#include "cli/loaded_scene.h"
#include "core/error/error.h"
#include "core/sight/line_of_sight.h"
#include "core/viewshed/grid_sight.h"

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
  TinSurface(std::shared_ptr<const void> owner, const TinIndex& index, const GeoFrame& frame)
      : owner_(std::move(owner)), index_(index), frame_(frame), placer_(frame) {}

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

 private:
  std::shared_ptr<const void> owner_;
  const TinIndex& index_;
  const GeoFrame& frame_;
  GeoFrame::Placer placer_;
};

}  // namespace

std::unique_ptr<SightSurface> open_surface(const std::vector<std::string>& sources,
                                           const DemOptions& options, const Progress& progress) {
  const std::string* scene = scene_among(sources, options);
  if (!scene)
    return std::make_unique<GridSurface>(
        std::make_shared<const Ground>(read_ground(sources, options, progress)));
  const auto loaded =
      std::make_shared<const LoadedScene>(*scene, ScenePart{options.memory_budget_bytes});
  return std::make_unique<TinSurface>(loaded, loaded->index, loaded->frame);
}

std::unique_ptr<SightSurface> surface_over(std::shared_ptr<const ViewSource> source) {
  if (source->tin_index() != nullptr)
    return std::make_unique<TinSurface>(source, *source->tin_index(), *source->dem().frame);
  const Ground& ground = source->dem_ground();
  return std::make_unique<GridSurface>(std::shared_ptr<const Ground>(std::move(source), &ground));
}

SurfaceNote note_of(const SightSurface& surface) {
  return note_of(surface.name(), surface.frame().description());
}

}  // namespace scarp
