#include "tests/support/horizon_scenes.h"

#include <cmath>
#include <numbers>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

struct Steepest {
  double slope = -HUGE_VAL;
  VertexIndex vertex = kNone;
};

}  // namespace

Tin lattice_tin(int columns, int rows, double step_m,
                const std::function<double(double x_m, double y_m)>& height_m) {
  Tin tin;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const double x_m = column * step_m, y_m = row * step_m;
      tin.vertices.push_back(round_to_lattice({x_m, y_m, height_m(x_m, y_m)}));
    }
  const auto at = [&](int column, int row) {
    return static_cast<VertexIndex>(row * columns + column);
  };
  for (int row = 0; row + 1 < rows; ++row)
    for (int column = 0; column + 1 < columns; ++column) {
      const VertexIndex a = at(column, row), b = at(column + 1, row);
      const VertexIndex c = at(column + 1, row + 1), d = at(column, row + 1);
      tin.triangles.push_back({a, b, c});
      tin.triangles.push_back({a, c, d});
    }
  connect_neighbours(tin);
  return tin;
}

HorizonTable exhaustive_horizon(const Tin& tin, const SectorLayout& layout) {
  const auto sectors = static_cast<std::size_t>(layout.count);
  const auto parts = static_cast<std::size_t>(layout.subsectors);
  HorizonTable table{layout, std::vector<VertexIndex>(tin.vertices.size() * sectors, kNone)};
  std::vector<SectorAxis> axes;
  for (std::int32_t s = 0; s < layout.count; ++s) axes.push_back(sector_axis(layout, s));
  parallel_for(tin.vertices.size(), [&](std::size_t v) {
    std::vector<Steepest> steepest(sectors * parts);
    const Position& from = tin.vertices[v];
    for (VertexIndex w = 0; w < tin.vertices.size(); ++w) {
      if (w == v) continue;
      const double dx_m = tin.vertices[w].x_m - from.x_m, dy_m = tin.vertices[w].y_m - from.y_m;
      double turns = std::atan2(dy_m, dx_m) / (2 * std::numbers::pi);
      if (turns < 0) turns += 1;
      const std::size_t part =
          static_cast<std::size_t>(turns * static_cast<double>(sectors * parts)) %
          (sectors * parts);
      const SectorAxis& axis = axes[part / parts];
      const double slope = (tin.vertices[w].z_m - from.z_m) / (axis.x * dx_m + axis.y * dy_m);
      if (slope > steepest[part].slope) steepest[part] = {slope, w};
    }
    for (std::size_t s = 0; s < sectors; ++s) {
      Steepest lowest = steepest[s * parts];
      for (std::size_t i = 1; i < parts; ++i)
        if (steepest[s * parts + i].slope < lowest.slope) lowest = steepest[s * parts + i];
      table.horizon_vertex[v * sectors + s] = lowest.vertex;
    }
  });
  return table;
}

}  // namespace scarp
