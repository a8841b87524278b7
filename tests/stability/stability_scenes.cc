#include "tests/stability/stability_scenes.h"

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "ingest/crs/geo_frame.h"
#include "ingest/dem/dem.h"
#include "tests/support/terrain.h"

namespace scarp::test {
namespace {

/// Every position through a function, then to the lattice.
Tin moved(Tin tin, const std::function<Position(const Position&)>& move) {
  for (Position& p : tin.vertices) p = round_to_lattice(move(p));
  return tin;
}

/// Walls 8 cells apart with a door in each, on a rough floor: something to hide in any shape.
double doors_m(std::int32_t column, std::int32_t row) {
  const bool is_door = (row * 7 + column / 8 * 5) % 11 == 0;
  const double rough_m = (column * 37 + row * 61) % 13 * 0.1;
  return column % 8 == 4 && !is_door ? 40 : rough_m;
}

StabilityScene needles() {
  return {"needles",
          "slivers and needle triangles",
          "Walls with doors on cells of 10 m x 0.1 m.",
          moved(triangulated(grid_of(28, 28, 10, doors_m), 7),
                [](const Position& p) {
                  return Position{p.x_m, p.y_m * 0.01, p.z_m};
                }),
          8,
          {}};
}

StabilityScene slivers() {
  return {"slivers",
          "slivers and needle triangles",
          "The same sheared, so that every triangle has an angle close to 180 degrees.",
          moved(triangulated(grid_of(28, 28, 10, doors_m), 7),
                [](const Position& p) {
                  return Position{p.x_m + 30 * p.y_m, p.y_m * 0.125, p.z_m};
                }),
          8,
          {}};
}

StabilityScene near_duplicates() {
  return {"near_duplicates",
          "duplicate and almost duplicate samples",
          "Every second column is one lattice step (0.24 mm) from the one before: walls that are "
          "vertical but for that, and triangles with hardly any area. (No two vertices of a mesh "
          "may share a place.)",
          moved(triangulated(grid_of(28, 20, 10, doors_m), 3),
                [](const Position& p) {
                  const double column = std::round(p.x_m / 10);
                  const double pair = std::floor(column / 2);
                  return Position{20 * pair + (column - 2 * pair) * kLatticeStepM, p.y_m, p.z_m};
                }),
          8,
          {}};
}

StabilityScene unequal_cells() {
  return {
      "unequal_cells",
      "very unequal cell sizes",
      "Cells from 0.5 m to 250 m wide, each a fifth wider than the one before, with walls among "
      "the small ones and hills among the large.",
      moved(triangulated(grid_of(36, 24, 10, doors_m), 5),
            [](const Position& p) {
              const double column = p.x_m / 10;
              const double x_m = 2.5 * (std::pow(1.2, column) - 1);
              return Position{x_m, p.y_m, p.z_m + 0.05 * x_m * (std::fmod(column, 3) > 1)};
            }),
      8,
      {}};
}

StabilityScene millions() {
  return {
      "millions",
      "map coordinates in the millions (float loses centimetres)",
      "Walls 1.2 m high on cells of 0.3 m, millions of metres from the origin.",
      moved(triangulated(grid_of(28, 28, 10, doors_m), 7),
            [](const Position& p) {
              return Position{5.4e6 + 0.03 * p.x_m, -4.2e6 + 0.03 * p.y_m, 1234.567 + 0.03 * p.z_m};
            }),
      8,
      {}};
}

StabilityScene random_terrain(const char* name, const char* fails, const char* shows,
                              const SampleGrid& grid) {
  return {name, fails, shows, triangulated(grid, 11), 8, {}};
}

/// How tiles of these scenes are made: exactly as the raster is.
constexpr double kTileErrorM = 0.01;

TiledOptions tiles_of(const StabilityScene& scene) {
  TiledOptions options;
  options.tile_samples = scene.tile_samples;
  options.max_error_m = kTileErrorM;
  options.group_triangles = scene.group_triangles;
  return options;
}

StabilityScene in_tiles(const char* name, const char* fails, const char* shows,
                        std::int32_t tile_samples, SampleGrid raster) {
  StabilityScene scene{name, fails, shows, {}, 16, {}, tile_samples, std::move(raster)};
  scene.tin = tiled_ground(scene.raster, tiles_of(scene)).whole;
  return scene;
}

/// Walls on the borders of tiles of 8 cells and beside them, with gaps at their corners and amid.
double walls_on_borders_m(std::int32_t column, std::int32_t row) {
  const bool is_wall = column % 8 == 0 || row % 8 == 1;
  const bool is_gap = (column + row) % 8 == 0 || (3 * column + row) % 11 == 0;
  return is_wall && !is_gap ? 40 : (column * 37 + row * 61) % 13 * 0.3;
}

/// A raster on the Earth.
struct EarthRaster {
  const char* crs;
  double x, y;            ///< of the upper left corner
  double cell_x, cell_y;  ///< in the CRS's units
  double refraction = 0;
};

Tin tin_on_earth(const EarthRaster& raster, std::int32_t columns, std::int32_t rows,
                 const std::function<double(std::int32_t, std::int32_t)>& height_m) {
  Dem dem;
  dem.columns = columns;
  dem.rows = rows;
  dem.geotransform = {raster.x, raster.cell_x, 0, raster.y, 0, -raster.cell_y};
  for (std::int32_t row = 0; row < rows; ++row)
    for (std::int32_t column = 0; column < columns; ++column)
      dem.heights_m.push_back(height_m(column, row));
  dem.known.assign(dem.heights_m.size(), 1);
  FrameDescription frame;
  frame.crs_wkt = raster.crs;
  frame.refraction = raster.refraction;
  frame.centre_x = dem.x_of(columns / 2.0);
  frame.centre_y = dem.y_of(rows / 2.0);
  dem.frame = std::make_shared<const GeoFrame>(frame);
  return triangulated(place_samples(dem));
}

/// Ridges a hundred metres high, some cells apart, on rolling ground.
double ridges_m(std::int32_t column, std::int32_t row) {
  return 300.0 * (column % 9 == 4) + 20 * std::sin(0.7 * row) * std::cos(0.5 * column);
}

/// A sea with two shores of one cell.
double straits_m(std::int32_t column, std::int32_t) {
  return column == 4 || column == 23 ? 150 : 0;
}

std::vector<StabilityScene> scenes_on_earth() {
  std::vector<StabilityScene> scenes;
  const auto add = [&](const char* name, const char* fails, const char* shows,
                       const EarthRaster& raster, const auto& height_m) {
    scenes.push_back({name, fails, shows, tin_on_earth(raster, 28, 24, height_m), 8, {}});
  };
  add("degrees", "a DEM in degrees", "Ridges on cells of 3 arc seconds at 60 degrees north.",
      {"OGC:CRS84", 10, 60, 3 / 3600.0, 3 / 3600.0}, ridges_m);
  add("antimeridian", "the antimeridian",
      "Ridges on cells of 3 arc seconds, from 179.99 degrees east on to 180.01.",
      {"OGC:CRS84", 180 - 42 / 3600.0, -16, 3 / 3600.0, 3 / 3600.0}, ridges_m);
  add("near_pole", "the poles",
      "Ridges in degrees, up to 0.01 degrees from the North Pole: cells 3 to 10 times as long as "
      "wide.",
      {"OGC:CRS84", 20, 89.99, 0.5, 3 / 3600.0}, ridges_m);
  add("on_pole", "the poles", "Ridges on cells of 90 m around the South Pole.",
      {"EPSG:3031", -1260, 1080, 90, 90}, ridges_m);
  add("refraction_0", "refraction 0 and 1",
      "A strait of 95 km between shores of 150 m: the sea itself hides the other shore's foot.",
      {"EPSG:32633", 450'000, 5'100'000, 5000, 5000, 0}, straits_m);
  add("refraction_1", "refraction 0 and 1",
      "The same with rays as curved as the Earth: the sea is flat.",
      {"EPSG:32633", 450'000, 5'100'000, 5000, 5000, 1}, straits_m);
  return scenes;
}

}  // namespace

TiledScene tiled(const StabilityScene& scene, const HidingOptions& hiding) {
  TiledOptions options = tiles_of(scene);
  options.hiding = hiding;
  return tiled_scene(scene.raster, options);
}

std::vector<StabilityScene> stability_scenes() {
  std::vector<StabilityScene> scenes;
  for (DrawnScene& drawn : drawn_scenes())
    scenes.push_back({drawn.name, drawn.fails, drawn.shows, std::move(drawn.tin),
                      drawn.group_triangles, std::move(drawn.eyes)});
  for (const auto make : {needles, slivers, near_duplicates, unequal_cells, millions})
    scenes.push_back(make());
  std::mt19937_64 random(4);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  scenes.push_back(random_terrain("random_hills", "any terrain", "Random hills, 100 m high.",
                                  random_hills(30, 30, 10, 21, 100, 0.01)));
  scenes.push_back(random_terrain("random_terraces", "plateaus and terraces (equal heights, ties)",
                                  "Random hills in steps of 15 m.",
                                  random_hills(30, 30, 10, 22, 90, 15)));
  scenes.push_back(random_terrain("random_voids", "holes and coastlines of nodata",
                                  "Random hills, a quarter of them void.",
                                  random_hills(30, 30, 10, 23, 100, 0.01, 0.25)));
  scenes.push_back(random_terrain("random_spikes", "a one-sample spike and a one-sample pit",
                                  "A tenth of the samples up to 300 m high, a twentieth pits.",
                                  grid_of(30, 30, 10, [&](std::int32_t, std::int32_t) {
                                    const double kind = unit();
                                    return kind < 0.1 ? 300 * unit() : kind < 0.15 ? -200 : unit();
                                  })));
  for (StabilityScene& scene : scenes_on_earth()) scenes.push_back(std::move(scene));
  scenes.push_back(in_tiles(
      "tile_borders", "tile borders",
      "Walls along the borders of tiles of 8 cells and beside them, open at some corners of tiles: "
      "each tile is certified by itself, against coarse ones from two tiles away on.",
      8, grid_of(33, 33, 10, walls_on_borders_m)));
  for (const std::int32_t tile_samples : {4, 16})
    scenes.push_back(in_tiles(tile_samples == 4 ? "tiles_of_4" : "tiles_of_16", "tile sizes",
                              tile_samples == 4
                                  ? "Random hills in tiles of 4 cells, which see most of the rest "
                                    "by coarse tiles only."
                                  : "The same in tiles of 16 cells.",
                              tile_samples, random_hills(33, 33, 10, 24, 100, 0.01)));
  return scenes;
}

}  // namespace scarp::test
