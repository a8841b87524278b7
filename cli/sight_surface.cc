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
  explicit GridSurface(Ground ground) : ground_(std::move(ground)), placer_(frame()) {}

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

  Ground ground_;
  GeoFrame::Placer placer_;
};

class TinSurface : public SightSurface {
 public:
  TinSurface(const std::string& path, std::uint64_t memory_bytes)
      : scene_(path, {memory_bytes}), placer_(scene_.frame) {}

  const char* name() const override { return "tin"; }
  const GeoFrame& frame() const override { return scene_.frame; }

  SightEnd place(const TypedPosition& typed, const std::string& crs) const override {
    return place(resolve(typed, crs, scene_.frame, scene_.index));
  }
  SightEnd place(const MapPoint& map) const override {
    return {placer_.place(map), map, ground_height_m(placer_, scene_.index, map.x, map.y)};
  }

  Sight judge(const Position& a, const Position& b) const override {
    return line_of_sight(scene_.index, a, b);
  }
  GroundAlong ground_along(const Position& a, const Position& b) const override {
    return scarp::ground_along(scene_.index, a, b);
  }
  bool starts_under_ground(const Position& a, const Position& b) const override {
    const auto blocker = first_blocker(scene_.index, a, b);
    return blocker && blocker->from == kNone && blocker->fraction == 0;
  }

  double reach_m(const Position& from) const override {
    double reach_m = 0;
    for (const Position& p : scene_.tin.vertices)
      reach_m = std::max(reach_m, plan_distance_m(from, p));
    return reach_m;
  }

 private:
  LoadedScene scene_;
  GeoFrame::Placer placer_;
};

}  // namespace

std::unique_ptr<SightSurface> open_surface(const std::vector<std::string>& sources,
                                           const DemOptions& options, const Progress& progress) {
  const std::string* scene = scene_among(sources, options);
  if (!scene) return std::make_unique<GridSurface>(read_ground(sources, options, progress));
  return std::make_unique<TinSurface>(*scene, options.memory_budget_bytes);
}

SurfaceNote note_of(const SightSurface& surface) {
  return note_of(surface.name(), surface.frame().description());
}

}  // namespace scarp
