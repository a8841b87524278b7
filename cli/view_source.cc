#include "cli/view_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/loaded_scene.h"
#include "core/error/error.h"
#include "core/threads/parallel_for.h"
#include "core/threads/stop.h"
#include "core/viewshed/seen_ground.h"
#include "core/viewshed/tin_viewshed.h"
#include "ingest/dem/ground_placement.h"

namespace scarp {
namespace {

/// This much of a cell may be rounding in the headers of two files over the same cells.
constexpr double kSameCells = 0.01;

/// Do two CRSs put the raster's corners at the same places?
bool same_crs(const Dem& a, const std::string& a_wkt, const std::string& b_wkt) {
  if (a_wkt.empty() || b_wkt.empty() || a_wkt == b_wkt) return a_wkt == b_wkt;
  for (const double column : {0.0, a.columns - 1.0}) {
    for (const double row : {0.0, a.rows - 1.0}) {
      const MapPoint from{a.x_of(column), a.y_of(row), 0};
      const MapPoint to = convert_coordinates(b_wkt, a_wkt, from);
      if (std::abs(to.x - from.x) > kSameCells * a.geotransform[1] ||
          std::abs(to.y - from.y) > kSameCells * -a.geotransform[5])
        return false;
    }
  }
  return true;
}

bool same_cells(const Dem& a, const Dem& b) {
  if (a.columns != b.columns || a.rows != b.rows) return false;
  const auto near = [&](std::size_t i, double cell) {
    return std::abs(a.geotransform[i] - b.geotransform[i]) < kSameCells * std::abs(cell);
  };
  const double width = a.geotransform[1], height = a.geotransform[5];
  return near(0, width) && near(3, height) && near(1, width / a.columns) &&
         near(5, height / a.rows);
}

/// The discs in which eyes see, in the plane; none where that is not known.
std::vector<ViewPlan> discs_of(const SceneTiles& scene, const std::optional<ViewReach>& reach) {
  // Metres along the ground are those of the plane but for its flattening.
  constexpr double kMoreInPlane = 1.02;
  std::vector<ViewPlan> discs;
  if (!reach) return discs;
  const GeoFrame::Placer placer(scene.frame());
  for (const TypedPosition& eye : reach->eyes) {
    MapPoint point = to_map_point(eye, reach->crs, scene.frame());
    point.height_m = 0;
    discs.push_back({placer.place(point), kMoreInPlane * reach->distance_m, {}});
  }
  return discs;
}

/// The tiles that discs meet; all where there are none of the ones or of the others.
std::vector<std::size_t> tiles_for(const SceneTiles& scene, const std::vector<ViewPlan>& discs) {
  std::vector<std::size_t> tiles;
  for (std::size_t i = 0; i < scene.size(); ++i)
    if (std::ranges::any_of(discs, [&](const ViewPlan& disc) { return scene.meets(i, disc); }))
      tiles.push_back(i);
  return tiles.empty() ? scene.tiles_in({}) : tiles;
}

/// The raster that a scene was made from.
Dem dem_of(const SceneDescription& description) {
  Dem dem;
  dem.columns = description.raster.columns;
  dem.rows = description.raster.rows;
  dem.geotransform = description.raster.geotransform;
  dem.frame = std::make_shared<const GeoFrame>(frame_of(description));
  dem.height_unit = std::string("m");
  return dem;
}

/// Samples lie where they lie in the whole raster, to the last bit.
PartPlacement place_part(const Dem& dem, const TileWindow& window) {
  return ground_placement_of_part(dem, window.first_column, window.first_row, window.columns,
                                  window.rows);
}

/// The rectangle of a part's samples that eyes reach, with some to spare; the part where there is
/// none.
PartPlacement crop_to_reach(PartPlacement part, const std::vector<ViewPlan>& discs,
                            double distance_m, const GeoFrame& frame) {
  // Places of samples are those without their heights here, whose normals lean by metres at most.
  constexpr double kMoreM = 20, kMore = 1.001;
  constexpr std::int32_t kMoreSamples = 2;
  const GroundGrid samples(part.columns, part.rows, part.placement);
  SampleWindow all{part.columns, part.rows, -1, -1};
  for (const ViewPlan& disc : discs) {
    const SampleWindow one = reach_window(
        samples, disc.eye, EyeBearings(disc.eye, frame.earth_frame()), kMore * distance_m + kMoreM);
    if (one.last_column < one.first_column || one.last_row < one.first_row) continue;
    all = {std::min(all.first_column, one.first_column), std::min(all.first_row, one.first_row),
           std::max(all.last_column, one.last_column), std::max(all.last_row, one.last_row)};
  }
  if (all.last_column < 0) return part;
  // What is thinned keeps the samples that it keeps of the whole.
  const auto low = [](std::int32_t first) {
    return std::max(0, first - kMoreSamples) / ThinnedGround::kStep * ThinnedGround::kStep;
  };
  const std::int32_t left = low(all.first_column), above = low(all.first_row);
  PartPlacement cropped = part_of(part.placement, part.columns, left, above,
                                  std::min(part.columns, all.last_column + 1 + kMoreSamples) - left,
                                  std::min(part.rows, all.last_row + 1 + kMoreSamples) - above);
  cropped.first_column += part.first_column;
  cropped.first_row += part.first_row;
  return cropped;
}

}  // namespace

ViewSource::ViewSource(const std::vector<std::string>& sources,
                       const std::vector<std::string>& obstacles, const DemOptions& options,
                       const Progress& progress, const std::optional<ViewReach>& reach) {
  if (const std::string* scene = scene_among(sources, options)) {
    if (!obstacles.empty())
      throw Error(ErrorCode::kUsage,
                  fmt::format("'{}': is a scene, whose surface blocks; leave --obstacles out, or "
                              "name the terrain model instead",
                              *scene));
    scene_ = std::make_unique<const SceneGround>(*scene, reach, options.memory_budget_bytes);
    stand_on_scene();
    return;
  }
  ground_ = read_ground(sources, options, progress);
  if (!obstacles.empty()) read_obstacles(obstacles, options);
  tops_.emplace(obstacles_ ? *obstacles_ : ground_.grid, ground_.grid);
}

ViewSource::SceneGround::SceneGround(const std::string& path, const std::optional<ViewReach>& reach,
                                     std::uint64_t memory_bytes)
    : tiles(path),
      dem(dem_of(tiles.scene().description())),
      discs(discs_of(tiles, reach)),
      part(place_part(dem, tiles.window_of(tiles_for(tiles, discs)))),
      ground(tiles,
             {tiles.tiles_over({part.first_column, part.first_row, part.columns, part.rows, 1}),
              discs},
             memory_bytes, "raise --memory, or give --max-distance") {
  if (reach && tiles.size() > 1)
    part = crop_to_reach(std::move(part), discs, reach->distance_m, tiles.frame());
}

void ViewSource::stand_on_scene() {
  const PartPlacement& part = scene_->part;
  Dem& dem = ground_.dem;
  dem = scene_->dem;
  dem.columns = part.columns;
  dem.rows = part.rows;
  dem.geotransform[0] += part.first_column * dem.geotransform[1];
  dem.geotransform[3] += part.first_row * dem.geotransform[5];
  ground_.grid = GroundGrid(part.columns, part.rows, part.placement);
  stand_on(scene_->index(), ground_.grid);
}

void ViewSource::read_obstacles(const std::vector<std::string>& files, const DemOptions& options) {
  Ground read = read_ground(files, options, {});
  if (!same_cells(ground_.dem, read.dem))
    throw Error(
        ErrorCode::kInput,
        fmt::format("'{}': has {} x {} cells from {:.10g},{:.10g}; those of the terrain "
                    "model were expected, {} x {} from {:.10g},{:.10g}; warp it with "
                    "gdalwarp -te -ts",
                    files.front(), read.dem.columns, read.dem.rows, read.dem.geotransform[0],
                    read.dem.geotransform[3], ground_.dem.columns, ground_.dem.rows,
                    ground_.dem.geotransform[0], ground_.dem.geotransform[3]));
  if (!same_crs(ground_.dem, ground_.dem.frame->description().crs_wkt,
                read.dem.frame->description().crs_wkt))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': has another coordinate system than the terrain model; the same "
                            "one was expected; warp it with gdalwarp -t_srs",
                            files.front()));
  // Headers may differ by rounding; both grids have the placement of the terrain model.
  obstacles_.emplace(ground_.dem.columns, ground_.dem.rows, ground_.grid.placement());
  GroundGrid& samples = ground_.grid;
  parallel_for(static_cast<std::size_t>(samples.rows()), [&](std::size_t r) {
    const auto row = static_cast<std::int32_t>(r);
    for (std::int32_t column = 0; column < samples.columns(); ++column) {
      if (samples.is_known(column, row) && read.grid.is_known(column, row))
        obstacles_->set_z(column, row, read.grid.at(column, row).z_m);
      else
        samples.set_void(column, row);
    }
  });
  for (const std::string& warning : read.dem.warnings) ground_.dem.warnings.push_back(warning);
}

void ViewSource::approximate(Accuracy accuracy) {
  accuracy_ = accuracy;
  if (accuracy == Accuracy::kExact) return;
  const GroundGrid& blocks = obstacles_ ? *obstacles_ : samples();
  if (!tops_) tops_.emplace(blocks, samples());
  const bool is_small = std::min(samples().columns(), samples().rows()) < ThinnedGround::kFewest;
  if (accuracy == Accuracy::kFast && !is_small) thinned_.emplace(samples(), blocks);
}

ViewGround ViewSource::ground() const {
  if (scene_ && accuracy_ == Accuracy::kExact)
    return ViewGround::of_tin(samples(), scene_->index());
  ViewGround ground =
      obstacles_ ? ViewGround::under(samples(), *obstacles_) : ViewGround(samples());
  ground.tops = &*tops_;
  if (accuracy_ != Accuracy::kExact) ground.deciding = Deciding::kByBounds;
  if (thinned_) ground.thinned = &*thinned_;
  return ground;
}

std::uint64_t ViewSource::groups() const {
  if (!scene_) return 0;
  std::uint64_t groups = 0;
  for (const std::size_t i : scene_->used())
    if (scene_->tiles.tile(i).contents) groups += scene_->tiles.tile(i).contents->groups;
  return groups;
}

std::vector<GroupIndex> ViewSource::group_of_samples() const {
  if (!scene_) return {};
  // Triangles of the surface are those of the tiles, one tile after the other.
  std::vector<GroupIndex> group_of_triangle;
  for (const std::size_t i : scene_->used()) {
    const SceneTile& tile = scene_->tiles.tile(i);
    const std::size_t triangles = tile.contents && scene_->used().size() > 1
                                      ? static_cast<std::size_t>(tile.contents->triangles)
                                      : scene_->tin().triangles.size();
    const Groups groups = read_tile_groups(scene_->tiles.scene(), tile, triangles);
    for (const GroupIndex group : groups.group_of_triangle)
      group_of_triangle.push_back(group == kNone ? kNone : scene_->tiles.first_group(i) + group);
  }
  const GroundGrid& grid = samples();
  const auto columns = static_cast<std::size_t>(grid.columns());
  std::vector<GroupIndex> groups(columns * static_cast<std::size_t>(grid.rows()), kNone);
  parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
    for (std::size_t c = 0; c < columns; ++c) {
      const Position at = grid.at(static_cast<std::int32_t>(c), static_cast<std::int32_t>(r));
      const TriangleIndex triangle = scene_->index().triangle_at(at.x_m, at.y_m);
      if (triangle != kNone && triangle < group_of_triangle.size())
        groups[r * columns + c] = group_of_triangle[triangle];
    }
  });
  return groups;
}

std::uint64_t ViewSource::known_samples() const {
  std::call_once(known_once_, [&] {
    // Kept for all who ask, so it is counted to its end whoever asks first.
    const StopAsked never;
    const StopScope scope(never);
    known_ = count_known(samples());
  });
  return known_;
}

GroundEye ViewSource::place(const TypedPosition& typed, const std::string& crs) const {
  if (!scene_) return place_eye(typed, crs, ground_);
  GroundEye eye;
  eye.map = resolve(typed, crs, *dem().frame, scene_->index());
  eye.position = GeoFrame::Placer(*dem().frame).place(eye.map);
  if (accuracy_ != Accuracy::kExact)
    eye.position = raised_over(eye.position,
                               scene_->index().ground_height_m(eye.position.x_m, eye.position.y_m),
                               ground_under_m(samples(), eye.position));
  return eye;
}

GroundEye ViewSource::place(const MapPoint& point, bool above_datum,
                            const std::string& text) const {
  if (!scene_) return place_eye(point, above_datum, text, ground_);
  TypedPosition typed;
  typed.x = point.x;
  typed.y = point.y;
  typed.height_m = point.height_m;
  typed.above_datum = above_datum;
  typed.text = text;
  return place(typed, std::string());
}

}  // namespace scarp
