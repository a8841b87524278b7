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

/// Tiles are so deep at most where cells are large, because what a fan takes for linear bends.
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

/// Copies a tile's lines to rows, or to columns.
template <typename Value>
void copy_lines(const Value* from, std::int32_t lanes, std::int32_t lines, bool to_rows,
                std::int32_t columns, Value* to) {
  if (to_rows) {
    for (std::int32_t line = 0; line < lines; ++line)
      std::copy_n(from + std::ptrdiff_t{line} * lanes, lanes, to + std::ptrdiff_t{line} * columns);
    return;
  }
  constexpr std::int32_t kBlock = 16;  // so that what is read and written stays in the cache
  for (std::int32_t l0 = 0; l0 < lines; l0 += kBlock)
    for (std::int32_t i0 = 0; i0 < lanes; i0 += kBlock)
      for (std::int32_t i = i0; i < std::min(i0 + kBlock, lanes); ++i)
        for (std::int32_t l = l0; l < std::min(l0 + kBlock, lines); ++l)
          to[std::ptrdiff_t{i} * columns + l] = from[std::ptrdiff_t{l} * lanes + i];
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
struct Skyline::Tile {
  MarchTile cells;  ///< in lanes and lines of the march
  March march;
};

/// What a part holds, row by row.
struct Skyline::Found {
  TileHorizons tile;
  std::vector<std::int16_t> estimate, lower, upper;
  std::vector<float> distance_m;
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
  if (!ground) ground = std::make_unique<MarchGround>(grid_, march, options_.sight == Sight::kDown);
  ground->lean(strip_lean(grid_, earth_, march, azimuth));
  return *ground;
}

std::vector<Skyline::Tile> Skyline::tiles_of(const SkylinePart& part, March preferred,
                                             const AzimuthAt& azimuth) const {
  const bool rows = preferred == March::kOverRows;
  MarchTile whole{part.first_column, part.columns, part.first_row, part.rows};
  if (!rows) whole = turned(whole);
  const std::int32_t lines = side_for(spacing_m(grid_, !rows), kPartSide, 8);
  std::vector<Tile> tiles;
  for (std::int32_t line = 0; line < whole.lines; line += lines) {
    MarchTile cells = whole;
    cells.first_line += line;
    cells.lines = std::min(lines, whole.lines - line);
    if (runs_along(grid_, earth_, preferred, cells, azimuth) <= kPreferredAlong)
      tiles.push_back({cells, preferred});
    else
      tiles.push_back({turned(cells), rows ? March::kOverColumns : March::kOverRows});
  }
  return tiles;
}

void Skyline::look(const AzimuthAt& azimuth, bool measures_distance, const TakeSkylinePart& take) {
  std::vector<SkylinePart> parts;
  for (std::int32_t row = 0; row < grid_.rows(); row += kPartSide)
    for (std::int32_t column = 0; column < grid_.columns(); column += kPartSide) {
      SkylinePart& part = parts.emplace_back();
      part.first_column = column;
      part.first_row = row;
      part.columns = std::min(kPartSide, grid_.columns() - column);
      part.rows = std::min(kPartSide, grid_.rows() - row);
    }
  const March preferred = march_for(azimuth);
  const March second = preferred == March::kOverRows ? March::kOverColumns : March::kOverRows;
  std::vector<std::vector<Tile>> tiles(parts.size());
  parallel_for(parts.size(),
               [&](std::size_t i) { tiles[i] = tiles_of(parts[i], preferred, azimuth); });
  const bool is_mixed = std::any_of(tiles.begin(), tiles.end(), [&](const auto& of_part) {
    return std::any_of(of_part.begin(), of_part.end(),
                       [&](const Tile& tile) { return tile.march != preferred; });
  });
  // One layout at a time, where that is enough.
  if (!is_mixed) (preferred == March::kOverRows ? over_columns_ : over_rows_).reset();
  const MarchGround& ground = ground_for(preferred, azimuth);
  const MarchGround& other = is_mixed ? ground_for(second, azimuth) : ground;
  parallel_for(parts.size(), [&](std::size_t i) {
    SkylinePart& part = parts[i];
    const std::size_t samples =
        static_cast<std::size_t>(part.columns) * static_cast<std::size_t>(part.rows);
    Found found;
    for (auto* values : {&found.estimate, &found.lower, &found.upper}) values->resize(samples);
    if (measures_distance) found.distance_m.resize(samples);
    for (const Tile& tile : tiles[i])
      look_from(tile, tile.march == preferred ? ground : other, azimuth, part, found);
    part.estimate = found.estimate;
    part.lower = found.lower;
    part.upper = found.upper;
    part.distance_m = found.distance_m;
    take(part);
  });
}

void Skyline::look(const AzimuthAt& azimuth, const SkylineBands& bands) {
  const auto columns = static_cast<std::ptrdiff_t>(grid_.columns());
  look(azimuth, !bands.distance_m.empty(), [&](const SkylinePart& part) {
    const auto copy = [&](const auto& from, const auto& to) {
      if (to.empty()) return;
      for (std::int32_t r = 0; r < part.rows; ++r)
        std::copy_n(from.begin() + std::ptrdiff_t{r} * part.columns, part.columns,
                    to.begin() + (part.first_row + r) * columns + part.first_column);
    };
    copy(part.estimate, bands.estimate);
    copy(part.lower, bands.lower);
    copy(part.upper, bands.upper);
    copy(part.distance_m, bands.distance_m);
  });
}

void Skyline::look_from(const Tile& tile, const MarchGround& ground, const AzimuthAt& azimuth,
                        const SkylinePart& part, Found& found) const {
  const MarchTile& cells = tile.cells;
  const RayFan fan = ray_fan(grid_, earth_, tilt_, tile.march, cells, azimuth);
  MarchSearch search;
  search.tolerance = static_cast<float>(options_.tolerance_rad);
  search.eye_height_m = options_.eye_height_m;
  search.measures_distance = !found.distance_m.empty();
  march_tile(grid_, ground, fan, cells, search, found.tile);
  const bool rows = tile.march == March::kOverRows;
  const std::ptrdiff_t to =
      std::ptrdiff_t{(rows ? cells.first_line : cells.first_lane) - part.first_row} * part.columns +
      (rows ? cells.first_lane : cells.first_line) - part.first_column;
  const auto copy = [&](const auto& from, auto& values) {
    copy_lines(from.data(), cells.lanes, cells.lines, rows, part.columns, values.data() + to);
  };
  copy(found.tile.estimate, found.estimate);
  copy(found.tile.lower, found.lower);
  copy(found.tile.upper, found.upper);
  if (!search.measures_distance) return;
  copy(found.tile.run_m, found.distance_m);
  const std::int32_t columns = rows ? cells.lanes : cells.lines;
  const std::int32_t down = rows ? cells.lines : cells.lanes;
  for (std::int32_t r = 0; r < down; ++r) {
    for (std::int32_t c = 0; c < columns; ++c) {
      const auto i = static_cast<std::size_t>(to + std::ptrdiff_t{r} * part.columns + c);
      const std::int16_t elevation = found.estimate[i];
      const std::int32_t column = (rows ? cells.first_lane : cells.first_line) + c;
      const std::int32_t row = (rows ? cells.first_line : cells.first_lane) + r;
      found.distance_m[i] = elevation == kUnknownElevation || elevation == kNothingSeen
                                ? std::numeric_limits<float>::quiet_NaN()
                                : distance_m(azimuth, column, row, found.distance_m[i]);
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
  assert(light.size() == columns * static_cast<std::size_t>(grid.rows()));
  const auto azimuth = [sun](const EyeBearings& from) { return from.to_far(sun).azimuth_rad; };
  // Narrow bounds cost little here, and leave little to the judge.
  SkylineOptions options;
  options.tolerance_rad = kStepRad;
  std::atomic<std::size_t> judged_samples{0};
  Skyline(grid, earth, options).look(azimuth, false, [&](const SkylinePart& part) {
    for (std::int32_t r = 0; r < part.rows; ++r) {
      for (std::int32_t c = 0; c < part.columns; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * static_cast<std::size_t>(part.columns) +
                              static_cast<std::size_t>(c);
        const std::int32_t column = part.first_column + c, row = part.first_row + r;
        Sunlight& to =
            light[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
        to = Sunlight::kUnknown;
        if (!grid.is_known(column, row) || part.lower[i] == kUnknownElevation) continue;
        const EyeBearings bearings(grid.at(column, row), earth);
        const Bearing at = bearings.to_far(sun);
        const double elevation_rad = refracted_elevation_rad(at.pitch_rad);
        const double steps = elevation_rad / kStepRad;
        if (steps > part.upper[i] || steps < part.lower[i]) {
          to = steps > part.upper[i] ? Sunlight::kLit : Sunlight::kShadow;
          continue;
        }
        ++judged_samples;
        const JudgedHorizon judged = judge_horizon(grid, earth, 0, column, row, at.azimuth_rad);
        if (judged.is_known)
          to = !judged.met || judged.elevation_rad <= elevation_rad ? Sunlight::kLit
                                                                    : Sunlight::kShadow;
      }
    }
  });
  return judged_samples;
}

}  // namespace scarp
