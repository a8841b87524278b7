#include "core/skyline/skyline.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/geodesy/sun.h"
#include "core/skyline/crossing_kernels.h"
#include "core/skyline/horizon_march.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/ray_horizon.h"

namespace scarp {
namespace {

constexpr double kStepRad = std::numbers::pi / 18'000;

/// Tiles hold so many cells at most, and are so wide at most where cells are large, because what a
/// fan takes for linear bends.
constexpr std::int32_t kTileLanes = 256, kTileLines = 256;
constexpr double kTileSideM = 16'000;

/// Rays of a tile may run so much along the lines before another layout is chosen: a little more
/// than in the scene's middle, so that one layout serves it all.
constexpr double kPreferredAlong = 1.25;
static_assert(kPreferredAlong <= kMostAlong);

std::int32_t side_for(double cell_m, std::int32_t most, std::int32_t least) {
  std::int32_t side = most;
  while (side > least && side * cell_m > kTileSideM) side /= 2;
  return side;
}

double spacing_m(const GroundGrid& grid, bool along_rows) {
  const std::int32_t c = grid.columns() / 2, r = grid.rows() / 2;
  const Position a = grid.at(c, r), b = along_rows ? grid.at(c - 1, r) : grid.at(c, r - 1);
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

void copy_apart(const std::int16_t* from, std::size_t step, std::size_t count, std::int16_t* to) {
  for (std::size_t i = 0; i < count; ++i) to[i] = from[i * step];
}

/// How strips lean best for rays from everywhere.
StripLean strip_lean(const GroundGrid& grid, const std::optional<EarthFrame>& earth, March march,
                     const AzimuthAt& azimuth) {
  /// Rays that run so much apart find squares no worse.
  constexpr double kMostApart = 0.1;
  const bool rows = march == March::kOverRows;
  const double lanes = (rows ? grid.columns() : grid.rows()) - 1;
  const double lines = (rows ? grid.rows() : grid.columns()) - 1;
  double least = std::numeric_limits<double>::infinity(), most = -least;
  int forwards = 0, places = 0;
  for (const double x : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    for (const double y : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const Course course = course_of(grid, earth, march, x * lanes, y * lines, azimuth);
      least = std::min(least, course.lanes_per_line);
      most = std::max(most, course.lanes_per_line);
      forwards += course.line_step > 0 ? 1 : 0;
      ++places;
    }
  }
  StripLean lean;
  if (most - least > kMostApart || (forwards != 0 && forwards != places)) return lean;
  return {false, forwards > 0 ? 1 : -1, (least + most) / 2};
}

/// The same cells in columns and rows, or back.
MarchTile turned(const MarchTile& tile) {
  return {tile.first_line, tile.lines, tile.first_lane, tile.lanes};
}

}  // namespace

double cell_side_m(const GroundGrid& grid) {
  return std::min(spacing_m(grid, true), spacing_m(grid, false));
}

AzimuthAt fixed_azimuth(double azimuth_rad) {
  return [azimuth_rad](const EyeBearings&) { return azimuth_rad; };
}

/// A tile and how its rays march.
struct Skyline::Part {
  MarchTile tile;  ///< in lanes and lines of the march
  March march;
};

Skyline::Skyline(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                 const SkylineOptions& options)
    : grid_(grid), earth_(earth), options_(options), tilt_(greatest_tilt(grid)) {
  assert(grid.columns() >= 2 && grid.rows() >= 2);
  assert(cell_side_m(grid) >= kLeastCellM);
}

March Skyline::march_for(const AzimuthAt& azimuth) const {
  const MarchTile whole{0, grid_.columns(), 0, grid_.rows()};
  return runs_along(grid_, earth_, March::kOverRows, whole, azimuth) <= 1 ? March::kOverRows
                                                                          : March::kOverColumns;
}

const MarchGround& Skyline::ground_for(March march, const AzimuthAt& azimuth) {
  std::unique_ptr<MarchGround>& ground = march == March::kOverRows ? over_rows_ : over_columns_;
  if (!ground) ground = std::make_unique<MarchGround>(grid_, march);
  ground->lean(strip_lean(grid_, earth_, march, azimuth));
  return *ground;
}

std::vector<Skyline::Part> Skyline::parts_for(March preferred, const AzimuthAt& azimuth) const {
  const bool rows = preferred == March::kOverRows;
  const std::int32_t lanes = rows ? grid_.columns() : grid_.rows();
  const std::int32_t lines = rows ? grid_.rows() : grid_.columns();
  const std::int32_t tile_lanes = side_for(spacing_m(grid_, rows), kTileLanes, kBundle);
  const std::int32_t tile_lines = side_for(spacing_m(grid_, !rows), kTileLines, 8);
  std::vector<Part> parts;
  for (std::int32_t line = 0; line < lines; line += tile_lines)
    for (std::int32_t lane = 0; lane < lanes; lane += tile_lanes)
      parts.push_back(
          {{lane, std::min(tile_lanes, lanes - lane), line, std::min(tile_lines, lines - line)},
           preferred});
  parallel_for(parts.size(), [&](std::size_t i) {
    Part& part = parts[i];
    if (runs_along(grid_, earth_, preferred, part.tile, azimuth) <= kPreferredAlong) return;
    part.march = rows ? March::kOverColumns : March::kOverRows;
    part.tile = turned(part.tile);
  });
  return parts;
}

void Skyline::look(const AzimuthAt& azimuth, const SkylineBands& bands) {
  const March preferred = march_for(azimuth);
  const std::vector<Part> parts = parts_for(preferred, azimuth);
  const bool is_mixed = std::any_of(parts.begin(), parts.end(),
                                    [&](const Part& part) { return part.march != preferred; });
  // One layout at a time, where that is enough.
  if (!is_mixed) (preferred == March::kOverRows ? over_columns_ : over_rows_).reset();
  const MarchGround& ground = ground_for(preferred, azimuth);
  const March second = preferred == March::kOverRows ? March::kOverColumns : March::kOverRows;
  const MarchGround& other = is_mixed ? ground_for(second, azimuth) : ground;
  parallel_for(parts.size(), [&](std::size_t i) {
    look_from(parts[i], parts[i].march == preferred ? ground : other, azimuth, bands);
  });
}

void Skyline::look_from(const Part& part, const MarchGround& ground, const AzimuthAt& azimuth,
                        const SkylineBands& bands) const {
  const RayFan fan = ray_fan(grid_, earth_, tilt_, part.march, part.tile, azimuth);
  MarchSearch search;
  search.tolerance = static_cast<float>(options_.tolerance_rad);
  search.eye_height_m = options_.eye_height_m;
  search.measures_distance = !bands.distance_m.empty();
  TileHorizons found;
  march_tile(grid_, ground, fan, part.tile, search, found);
  const bool rows = part.march == March::kOverRows;
  const auto lanes = static_cast<std::size_t>(part.tile.lanes);
  const auto columns = static_cast<std::size_t>(grid_.columns());
  const std::int32_t across = rows ? part.tile.lanes : part.tile.lines;
  const std::int32_t down = rows ? part.tile.lines : part.tile.lanes;
  const std::int32_t first_column = rows ? part.tile.first_lane : part.tile.first_line;
  const std::int32_t first_row = rows ? part.tile.first_line : part.tile.first_lane;
  for (std::int32_t r = 0; r < down; ++r) {
    const std::size_t to =
        static_cast<std::size_t>(first_row + r) * columns + static_cast<std::size_t>(first_column);
    // Cells of a row lie side by side in the tile, or a line apart.
    const std::size_t from = static_cast<std::size_t>(r) * (rows ? lanes : 1);
    const std::size_t step = rows ? 1 : lanes;
    const auto count = static_cast<std::size_t>(across);
    copy_apart(&found.estimate[from], step, count, &bands.estimate[to]);
    if (!bands.lower.empty()) copy_apart(&found.lower[from], step, count, &bands.lower[to]);
    if (!bands.upper.empty()) copy_apart(&found.upper[from], step, count, &bands.upper[to]);
    if (!search.measures_distance) continue;
    for (std::size_t c = 0; c < count; ++c) {
      const std::int16_t elevation = bands.estimate[to + c];
      bands.distance_m[to + c] =
          elevation == kUnknownElevation || elevation == kNothingSeen
              ? std::numeric_limits<float>::quiet_NaN()
              : distance_m(azimuth, first_column + static_cast<std::int32_t>(c), first_row + r,
                           found.run_m[from + c * step]);
    }
  }
}

float Skyline::distance_m(const AzimuthAt& azimuth, std::int32_t column, std::int32_t row,
                          float run_m) const {
  const Position eye = grid_.at(column, row);
  const EyeBearings bearings(eye, earth_);
  const double direction_rad = bearings.plane_direction_rad(azimuth(bearings));
  return static_cast<float>(bearings
                                .to({eye.x_m + run_m * std::cos(direction_rad),
                                     eye.y_m + run_m * std::sin(direction_rad), eye.z_m})
                                .distance_m);
}

JudgedHorizon judge_horizon(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                            double eye_height_m, std::int32_t column, std::int32_t row,
                            double azimuth_rad) {
  JudgedHorizon judged;
  if (!grid.is_known(column, row)) return judged;
  const Position eye = grid.raised(column, row, eye_height_m);
  const EyeBearings bearings(eye, earth);
  double reach_m = 0;
  for (const std::int32_t c : {0, grid.columns() - 1})
    for (const std::int32_t r : {0, grid.rows() - 1})
      reach_m =
          std::max(reach_m, std::hypot(grid.at(c, r).x_m - eye.x_m, grid.at(c, r).y_m - eye.y_m));
  // Borders bend outwards between the corners by less.
  const Position end = ray_end(eye, bearings.plane_direction_rad(azimuth_rad), reach_m * 1.1 + 100);
  const GroundAlong along = GridSight(grid, eye).ground_along(end);
  const auto horizon = ray_horizon(eye, end, along);
  judged.is_known = !horizon || !horizon->over_void;
  judged.met = horizon.has_value();
  if (!horizon) return judged;
  judged.elevation_rad = bearings.apparent_pitch_rad(horizon->place);
  judged.distance_m = bearings.to(horizon->place).distance_m;
  return judged;
}

std::size_t cast_shadow(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                        const EcefPoint& sun, std::span<Sunlight> light) {
  const auto columns = static_cast<std::size_t>(grid.columns());
  const std::size_t samples = columns * static_cast<std::size_t>(grid.rows());
  assert(light.size() == samples);
  const auto azimuth = [sun](const EyeBearings& from) { return from.to_far(sun).azimuth_rad; };
  // Narrow bounds cost little here, and leave little to the judge.
  SkylineOptions options;
  options.tolerance_rad = kStepRad;
  LargeArray<std::int16_t> estimate(samples), lower(samples), upper(samples);
  Skyline(grid, earth, options).look(azimuth, {estimate.span(), lower.span(), upper.span(), {}});
  std::atomic<std::size_t> judged_samples{0};
  parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t i = r * columns + c;
      const auto column = static_cast<std::int32_t>(c), row = static_cast<std::int32_t>(r);
      light[i] = Sunlight::kUnknown;
      if (!grid.is_known(column, row)) continue;
      const EyeBearings bearings(grid.at(column, row), earth);
      const Bearing at = bearings.to_far(sun);
      const double elevation_rad = refracted_elevation_rad(at.pitch_rad);
      const double steps = elevation_rad / kStepRad;
      if (lower[i] == kUnknownElevation) continue;
      if (steps > upper[i]) {
        light[i] = Sunlight::kLit;
      } else if (steps < lower[i]) {
        light[i] = Sunlight::kShadow;
      } else {
        ++judged_samples;
        const JudgedHorizon judged = judge_horizon(grid, earth, 0, column, row, at.azimuth_rad);
        if (judged.is_known)
          light[i] = !judged.met || judged.elevation_rad <= elevation_rad ? Sunlight::kLit
                                                                          : Sunlight::kShadow;
      }
    }
  });
  return judged_samples;
}

}  // namespace scarp
