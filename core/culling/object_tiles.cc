#include "core/culling/object_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {
namespace {

/// Of the plane.
struct Rectangle {
  double low_x_m = std::numeric_limits<double>::infinity(), low_y_m = low_x_m;
  double high_x_m = -low_x_m, high_y_m = -low_x_m;
  std::uint32_t triangles = 0;

  void hold(const Position& p) {
    low_x_m = std::min(low_x_m, p.x_m), high_x_m = std::max(high_x_m, p.x_m);
    low_y_m = std::min(low_y_m, p.y_m), high_y_m = std::max(high_y_m, p.y_m);
  }
};

/// How a group's rectangle is cut.
struct Cut {
  Rectangle box;
  std::uint32_t columns = 1, rows = 1;

  std::uint32_t cell_of(double x_m, double y_m) const {
    const auto place = [](double at_m, double low_m, double high_m, std::uint32_t count) {
      return std::min(count - 1, static_cast<std::uint32_t>((at_m - low_m) / (high_m - low_m) *
                                                            static_cast<double>(count)));
    };
    const std::uint32_t column = columns > 1 ? place(x_m, box.low_x_m, box.high_x_m, columns) : 0;
    const std::uint32_t row = rows > 1 ? place(y_m, box.low_y_m, box.high_y_m, rows) : 0;
    return row * columns + column;
  }
};

Cut cut_of(const Rectangle& box, double most_x_m, double most_y_m, std::uint32_t most_triangles) {
  const auto parts = [](double width_m, double most_m) {
    return width_m > most_m ? static_cast<std::uint32_t>(std::ceil(width_m / most_m)) : 1U;
  };
  const double width_m = box.high_x_m - box.low_x_m, depth_m = box.high_y_m - box.low_y_m;
  Cut cut{box, parts(width_m, most_x_m), parts(depth_m, most_y_m)};
  // The longer side of a cell is halved: a side without length, as a wall has, never is.
  while (box.triangles / (cut.columns * cut.rows) > most_triangles && (width_m > 0 || depth_m > 0))
    (width_m / cut.columns >= depth_m / cut.rows ? cut.columns : cut.rows) *= 2;
  return cut;
}

}  // namespace

ObjectTiles cut_into_tiles(const Tin& tin, const Groups& groups, const ObjectTileOptions& options) {
  std::vector<Rectangle> boxes(groups.leaf_count);
  Rectangle scene;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex g = groups.group_of_triangle[t];
    for (const VertexIndex v : tin.triangles[t]) {
      scene.hold(tin.vertices[v]);
      if (g != kNone) boxes[g].hold(tin.vertices[v]);
    }
    if (g != kNone) ++boxes[g].triangles;
  }
  std::vector<Cut> cuts;
  std::vector<std::uint32_t> first_cell = {0};  // [groups + 1]
  for (const Rectangle& box : boxes) {
    cuts.push_back(cut_of(box, options.most_share * (scene.high_x_m - scene.low_x_m),
                          options.most_share * (scene.high_y_m - scene.low_y_m),
                          options.most_triangles));
    first_cell.push_back(first_cell.back() + cuts.back().columns * cuts.back().rows);
  }
  ObjectTiles tiles;
  tiles.tiles.group_of_triangle.assign(tin.triangles.size(), kNone);
  std::vector<GroupIndex> tile_of_cell(first_cell.back(), kNone);
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    const GroupIndex g = groups.group_of_triangle[t];
    if (g == kNone) continue;
    double x_m = 0, y_m = 0;
    for (const VertexIndex v : tin.triangles[t])
      x_m += tin.vertices[v].x_m / 3, y_m += tin.vertices[v].y_m / 3;
    const std::uint32_t cell = first_cell[g] + cuts[g].cell_of(x_m, y_m);
    tiles.tiles.group_of_triangle[t] = cell;
    tile_of_cell[cell] = 0;
  }
  // Cells without triangles are no tiles.
  for (GroupIndex g = 0; g < groups.leaf_count; ++g)
    for (std::uint32_t cell = first_cell[g]; cell < first_cell[g + 1]; ++cell)
      if (tile_of_cell[cell] != kNone) {
        tile_of_cell[cell] = tiles.tiles.leaf_count++;
        tiles.group_of_tile.push_back(g);
      }
  for (GroupIndex& of_triangle : tiles.tiles.group_of_triangle)
    if (of_triangle != kNone) of_triangle = tile_of_cell[of_triangle];
  return tiles;
}

CullingAnswer TiledCulling::visible(const Camera& camera) {
  CullingAnswer answer = method_->visible(camera);
  for (GroupIndex& tile : answer.visible_groups) tile = tiles_.group_of_tile[tile];
  auto& groups = answer.visible_groups;
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  return answer;
}

bool TiledCulling::set_present(std::span<const std::uint8_t> is_present) {
  std::vector<std::uint8_t> of_tiles;
  for (const GroupIndex group : tiles_.group_of_tile) of_tiles.push_back(is_present[group]);
  return method_->set_present(of_tiles);
}

}  // namespace scarp
