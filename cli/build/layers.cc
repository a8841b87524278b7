#include "cli/build/layers.h"

#include <algorithm>
#include <cmath>

#include "core/threads/parallel_for.h"
#include "core/viewshed/tin_viewshed.h"
#include "tiles/layers/outline.h"

namespace scarp {
namespace {

/// How far inwards a border sample outside the mesh looks for it, in cells: more than
/// kBorderDeviationCells lets it lie outside, less than would matter on a map.
constexpr double kInwardsCells = 1.0 / 8;

TriangleIndex triangle_near(const SampleGrid& grid, const TinIndex& index, const Position& p) {
  const TriangleIndex at = index.triangle_at(p.x_m, p.y_m);
  if (at != kNone || grid.bend_cells == 0) return at;
  for (const double dy : {-kInwardsCells, kInwardsCells}) {
    for (const double dx : {-kInwardsCells, kInwardsCells}) {
      const TriangleIndex near = index.triangle_at(round_to_lattice(p.x_m + dx * grid.cell_x_m),
                                                   round_to_lattice(p.y_m + dy * grid.cell_y_m));
      if (near != kNone) return near;
    }
  }
  return kNone;
}

double plan_area_m2(const Tin& tin, TriangleIndex t) {
  const auto& [a, b, c] = tin.triangles[t];
  const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
  return ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
}

}  // namespace

std::vector<TriangleIndex> triangle_of_samples(const SampleGrid& grid, const TinIndex& index) {
  std::vector<TriangleIndex> triangles(grid.positions.size(), kNone);
  parallel_for(static_cast<std::size_t>(grid.rows), [&](std::size_t row) {
    const auto columns = static_cast<std::size_t>(grid.columns);
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i)
      if (grid.known[i]) triangles[i] = triangle_near(grid, index, grid.positions[i]);
  });
  return triangles;
}

std::vector<std::int32_t> group_of_samples(const std::vector<TriangleIndex>& triangle_of_sample,
                                           const Groups& groups) {
  std::vector<std::int32_t> values(triangle_of_sample.size(), kVoidGroupValue);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const TriangleIndex triangle = triangle_of_sample[i];
    if (triangle == kNone) continue;
    const GroupIndex group = groups.group_of_triangle[triangle];
    values[i] = group == kNone ? kOrphanValue : static_cast<std::int32_t>(group);
  }
  return values;
}

std::vector<std::uint8_t> viewshed_of_samples(const GroundGrid::Placement& raster,
                                              std::int32_t raster_columns, const TileWindow& window,
                                              const TinIndex& index, const Position& eye,
                                              const Progress& progress) {
  PartPlacement part = part_of(raster, raster_columns, window.first_column, window.first_row,
                               window.columns, window.rows);
  GroundGrid samples(part.columns, part.rows, std::move(part.placement));
  stand_on(index, samples);
  SampleWindow own = whole_window(samples);
  own.first_column = window.first_column - part.first_column;
  own.first_row = window.first_row - part.first_row;
  std::vector<Seen> seen(static_cast<std::size_t>(part.columns) *
                         static_cast<std::size_t>(part.rows));
  tin_viewshed(index, samples, eye, 0, own, seen, progress);
  static_assert(static_cast<std::uint8_t>(Seen::kVisible) == kVisibleValue &&
                static_cast<std::uint8_t>(Seen::kHidden) == kHiddenValue &&
                static_cast<std::uint8_t>(Seen::kUnknown) == kUnknownValue);
  std::vector<std::uint8_t> values;
  values.reserve(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows));
  for (std::int32_t row = own.first_row; row <= own.last_row; ++row)
    for (std::int32_t column = own.first_column; column <= own.last_column; ++column)
      values.push_back(static_cast<std::uint8_t>(
          seen[static_cast<std::size_t>(row) * static_cast<std::size_t>(part.columns) +
               static_cast<std::size_t>(column)]));
  return values;
}

std::vector<GroupPolygon> group_polygons(const Tin& tin, const Groups& groups,
                                         const std::vector<double>& heights_m,
                                         const GeoFrame& frame) {
  std::vector<GroupPolygon> polygons(groups.leaf_count);
  for (GroupIndex group = 0; group < groups.leaf_count; ++group) {
    GroupPolygon& polygon = polygons[group];
    polygon.group = group;
    const GroupIndex parent = groups.nodes[group].parent;
    polygon.parent = parent == kNone ? -1 : static_cast<std::int64_t>(parent);
    polygon.height_min_m = std::numeric_limits<double>::infinity();
    polygon.height_max_m = -polygon.height_min_m;
  }
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex group = groups.group_of_triangle[t];
    if (group == kNone) continue;
    GroupPolygon& polygon = polygons[group];
    ++polygon.triangles;
    polygon.area_m2 += plan_area_m2(tin, t);
    for (const VertexIndex v : tin.triangles[t]) {
      polygon.height_min_m = std::min(polygon.height_min_m, heights_m[v]);
      polygon.height_max_m = std::max(polygon.height_max_m, heights_m[v]);
    }
  }
  const GeoFrame::Placer placer(frame);
  for (const GroupOutline& outline : trace_groups(tin, groups.group_of_triangle)) {
    for (const VertexPolygon& polygon : outline.polygons) {
      std::vector<Ring> rings;
      for (const VertexRing& vertices : polygon) {
        Ring& ring = rings.emplace_back();
        for (const VertexIndex v : vertices) {
          const MapPoint at = placer.unplace(tin.vertices[v]);
          ring.push_back({at.x, at.y});
        }
      }
      polygons[outline.group].polygons.push_back(std::move(rings));
    }
  }
  return polygons;
}

RasterLayer layer_over(const Dem& dem, LayerSamples samples, const std::string& band_name) {
  RasterLayer layer;
  layer.columns = dem.columns;
  layer.rows = dem.rows;
  layer.samples = samples;
  layer.geotransform = dem.geotransform;
  layer.crs_wkt = dem.frame->description().crs_wkt;
  layer.band_name = band_name;
  return layer;
}

}  // namespace scarp
