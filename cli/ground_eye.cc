#include "cli/ground_eye.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error/error.h"

namespace scarp {
namespace {

/// This much of a cell outside the outermost samples, or beside a sample, is rounding.
constexpr double kRoundingCells = 1e-6;

/// Snaps to whole samples and into the data what is off by rounding only.
double snapped(double index, std::int32_t count) {
  const double near = std::round(index);
  if (std::abs(index - near) < kRoundingCells) index = near;
  return near == 0 || near == count - 1 ? std::clamp(index, 0.0, count - 1.0) : index;
}

/// Column and row of a map point.
std::pair<double, double> sample_at(const Dem& dem, const MapPoint& map) {
  return {snapped((map.x - dem.geotransform[0]) / dem.geotransform[1] - 0.5, dem.columns),
          snapped((map.y - dem.geotransform[3]) / dem.geotransform[5] - 0.5, dem.rows)};
}

bool is_inside(const Dem& dem, const MapPoint& map) {
  const auto [column, row] = sample_at(dem, map);
  return column >= 0 && column <= dem.columns - 1 && row >= 0 && row <= dem.rows - 1;
}

/// Bilinear height above the ellipsoid, from the samples that have a share in it.
std::optional<double> ground_height_m(const GroundGrid& grid, double column, double row) {
  const auto c = static_cast<std::int32_t>(column), r = static_cast<std::int32_t>(row);
  double sum_m = 0;
  for (const std::int32_t down : {0, 1}) {
    for (const std::int32_t right : {0, 1}) {
      const double share =
          (right ? column - c : 1 - (column - c)) * (down ? row - r : 1 - (row - r));
      if (share == 0) continue;
      if (!grid.is_known(c + right, r + down)) return {};
      sum_m += share * grid.height_m(c + right, r + down);
    }
  }
  return sum_m;
}

}  // namespace

GroundEye place_eye(const MapPoint& map, const Ground& ground, const GeoFrame::Placer& placer) {
  const Dem& dem = ground.dem;
  GroundEye eye;
  eye.map = map;
  const auto [column, row] = sample_at(dem, map);
  if (!is_inside(dem, map)) {
    eye.position = placer.place(map);
    return eye;
  }
  const double undulation_m = placer.undulation_m(map.x, map.y);
  eye.position = ground.grid.place(column, row, map.height_m + undulation_m);
  if (const auto ground_m = ground_height_m(ground.grid, column, row))
    eye.ground_m = *ground_m - undulation_m;
  return eye;
}

GroundEye place_eye(const MapPoint& point, bool above_datum, const std::string& text,
                    const Ground& ground) {
  const GeoFrame::Placer placer(*ground.dem.frame);
  if (above_datum) return place_eye(point, ground, placer);
  const GroundEye foot = place_eye({point.x, point.y, 0}, ground, placer);
  if (!foot.ground_m)
    throw Error(ErrorCode::kInput,
                fmt::format("position '{}': {}; a place on known ground was expected; check the "
                            "order X,Y and --crs, or give an absolute height, such as 1200asl "
                            "for H",
                            text,
                            is_inside(ground.dem, point) ? "the ground is void there"
                                                         : "is outside the data"));
  return place_eye({point.x, point.y, point.height_m + *foot.ground_m}, ground, placer);
}

GroundEye place_eye(const TypedPosition& typed, const std::string& crs, const Ground& ground) {
  return place_eye(to_map_point(typed, crs, *ground.dem.frame), typed.above_datum, typed.text,
                   ground);
}

}  // namespace scarp
