#include "cli/ground_eye.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

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

MapPoint converted(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame) {
  const MapPoint point{typed.x, typed.y, typed.height_m};
  if (crs.empty()) return point;
  if (frame.description().crs_wkt.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("--crs {}: the data have no coordinate system to convert to; give "
                            "positions in the units of the data and leave --crs out",
                            crs));
  return convert_coordinates(crs, frame.description().crs_wkt, point);
}

}  // namespace

GroundEye place_eye(const MapPoint& point, bool above_datum, const std::string& text,
                    const Ground& ground) {
  const Dem& dem = ground.dem;
  GroundEye eye;
  eye.map = point;
  const GeoFrame::Placer placer(*dem.frame);
  const double column =
      snapped((point.x - dem.geotransform[0]) / dem.geotransform[1] - 0.5, dem.columns);
  const double row = snapped((point.y - dem.geotransform[3]) / dem.geotransform[5] - 0.5, dem.rows);
  const bool inside = column >= 0 && column <= dem.columns - 1 && row >= 0 && row <= dem.rows - 1;
  const double undulation_m = placer.undulation_m(point.x, point.y);
  if (!above_datum) {
    const auto ground_m = inside ? ground_height_m(ground.grid, column, row) : std::nullopt;
    if (!ground_m)
      throw Error(ErrorCode::kInput,
                  fmt::format("position '{}': {}; a place on known ground was expected; check the "
                              "order X,Y and --crs, or give an absolute height, such as 1200asl "
                              "for H",
                              text, inside ? "the ground is void there" : "is outside the data"));
    eye.map.height_m += *ground_m - undulation_m;
  }
  eye.position = inside ? ground.grid.place(column, row, eye.map.height_m + undulation_m)
                        : placer.place(eye.map);
  return eye;
}

GroundEye place_eye(const TypedPosition& typed, const std::string& crs, const Ground& ground) {
  return place_eye(converted(typed, crs, *ground.dem.frame), typed.above_datum, typed.text, ground);
}

}  // namespace scarp
