#pragma once

#include <cstdint>

#include "core/horizon/sectors.h"
#include "core/occlusion/certified/tile_tree.h"
#include "core/occlusion/groups.h"
#include "core/terrain/tin.h"
#include "tiles/store/scene_description.h"

/// Small, valid things to write, read and damage.
namespace scarp::test {

/// columns x rows vertices 10 m apart, two triangles a cell, heights of a gentle pattern.
inline Tin grid_tin(std::uint32_t columns, std::uint32_t rows, double height_m = 0) {
  Tin tin;
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column)
      tin.vertices.push_back({10.0 * column, -10.0 * row, height_m + (3 * column + 5 * row) % 7});
  }
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const VertexIndex a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      tin.triangles.push_back({a, c, b});
      tin.triangles.push_back({b, c, d});
    }
  }
  connect_neighbours(tin);
  return tin;
}

inline HorizonTable small_horizons(const Tin& tin) {
  HorizonTable table{{4, 2}, {}};
  const auto vertices = static_cast<std::uint32_t>(tin.vertices.size());
  for (std::uint32_t i = 0; i < 4 * vertices; ++i)
    table.horizon_vertex.push_back(i % 5 == 0 ? kNone : (i * 7) % vertices);
  return table;
}

/// Two leaves and the node above them; every fifth triangle is an orphan.
inline Groups small_groups(const Tin& tin) {
  Groups groups;
  for (std::uint32_t t = 0; t < tin.triangles.size(); ++t)
    groups.group_of_triangle.push_back(t % 5 == 4 ? kNone : t % 2);
  groups.leaf_count = 2;
  groups.nodes = {{2, {kNone, kNone}, 4, 5, -5, 8},
                  {2, {kNone, kNone}, 3, 15, -15, 8.5},
                  {kNone, {0, 1}, 7, 10, -10, 16}};
  Regions& regions = groups.regions;
  regions.layout = {4, 1};
  regions.first = {0};
  for (std::uint32_t i = 0; i < 12; ++i) {
    for (std::uint32_t k = 0; k < i % 3; ++k) regions.points.push_back({10.0 * k + i, 2.0 + k});
    regions.first.push_back(static_cast<std::uint32_t>(regions.points.size()));
    regions.end_slope.push_back(0.01 * i);
  }
  return groups;
}

/// The same with certified regions of eight sectors.
inline Groups small_certified_groups(const Tin& tin) {
  Groups groups = small_groups(tin);
  CertifiedRegions& regions = groups.certified;
  regions.layout = {8, 2};
  regions.groups = {{5, -5, 3.5, 8.25F, -0.5F, 0.001F}, {15, -15, 4.25, 8.75F, 0.25F, 0}};
  for (std::uint16_t i = 0; i < 16; ++i) {
    const auto step = [&](int ring, int code) {
      return static_cast<std::uint16_t>((ring << kSlopeBits) + code);
    };
    const std::uint16_t last = step(i + 3, 1023);
    regions.steps.push_back(
        {step(0, 0), step(i, 40 * i), step(i + 3, 7), last, last, last, last, last});
  }
  return groups;
}

/// Two tiles and the one above, of eight cells each.
inline TileTree small_tree() {
  std::vector<TileNode> tiles;
  for (const std::int32_t column : {0, 1}) {
    TileHorizon horizon = horizon_of_nothing({4, 2, 1}, 100.0 * column, -50, 20, 75);
    for (std::size_t i = 0; i < horizon.slopes.size(); ++i)
      horizon.slopes[i] = i == 3 ? TileHorizon::kNothingHidden : 0.125F * static_cast<float>(i) - 1;
    tiles.push_back({{1, column, 0}, std::move(horizon)});
  }
  return tree_over(std::move(tiles));
}

inline SceneDescription small_description() {
  SceneDescription scene;
  scene.made_by = "scarp test";
  scene.crs_wkt = "LOCAL_CS[\"map\"]";
  scene.earth = {EarthShape::kEllipsoid, 0.13, "egm96.gtx", {4e6, 0.1, -5e6}};
  scene.raster = {3, 3, {500000, 10, 0, 4e6, 0, -10}};
  scene.parameters = {{"sectors", std::int64_t{16}},
                      {"max_error_m", 0.1},
                      {"resume", false},
                      {"horizon", std::string("certified")}};
  scene.sources = {{"alps.tif", 1234, checksum_of({})}};
  return scene;
}

}  // namespace scarp::test
