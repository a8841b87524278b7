#include "cli/serve/mercator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace scarp {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr double kHalfWorldM = std::numbers::pi * kMercatorRadiusM;

}  // namespace

MercatorPoint to_mercator(const LonLat& at) {
  return {kMercatorRadiusM * at.longitude_deg * kRadiansPerDegree,
          kMercatorRadiusM * std::asinh(std::tan(at.latitude_deg * kRadiansPerDegree))};
}

LonLat to_lon_lat(const MercatorPoint& at) {
  return {at.x_m / kMercatorRadiusM / kRadiansPerDegree,
          std::atan(std::sinh(at.y_m / kMercatorRadiusM)) / kRadiansPerDegree};
}

MercatorBox tile_box(int zoom, std::int64_t x, std::int64_t y) {
  const double side_m = 2 * kHalfWorldM / static_cast<double>(std::int64_t{1} << zoom);
  const double west_m = static_cast<double>(x) * side_m - kHalfWorldM;
  const double north_m = kHalfWorldM - static_cast<double>(y) * side_m;
  return {west_m, north_m - side_m, west_m + side_m, north_m};
}

MercatorMap::MercatorMap(
    const MercatorBox& box, double cell_m,
    const std::function<std::optional<std::pair<double, double>>(LonLat)>& place)
    : box_(box) {
  const double middle_y_m = (box.south_m + box.north_m) / 2;
  const double stretch = std::cosh(middle_y_m / kMercatorRadiusM);
  pixel_m_ = cell_m * stretch;
  // A bilinear piece of side h is off by h^2 / 8 times the bend, which is about 1 / radius of the
  // Earth, more towards the poles: this keeps it under a hundredth of a cell.
  constexpr double kCellsApart = 32, kMostBend = 4;
  const double straight_m = std::sqrt(8 * 0.01 * cell_m * kMercatorRadiusM / kMostBend);
  knot_m_ = std::min(kCellsApart * cell_m, straight_m) * stretch;
  // Small rasters and tiny ones have some knots too; large ones no more than memory is worth.
  const double longer_m = std::max(box.east_m - box.west_m, box.north_m - box.south_m);
  knot_m_ = std::clamp(knot_m_, longer_m / 2000, std::max(longer_m / 4, 1e-6));
  across_ = static_cast<std::int64_t>(std::ceil((box.east_m - box.west_m) / knot_m_)) + 1;
  down_ = static_cast<std::int64_t>(std::ceil((box.north_m - box.south_m) / knot_m_)) + 1;
  knots_.reserve(static_cast<std::size_t>(across_ * down_));
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (std::int64_t r = 0; r < down_; ++r) {
    for (std::int64_t c = 0; c < across_; ++c) {
      const auto at = place(to_lon_lat({box.west_m + static_cast<double>(c) * knot_m_,
                                        box.north_m - static_cast<double>(r) * knot_m_}));
      knots_.push_back(
          at ? RasterPlace{static_cast<float>(at->first), static_cast<float>(at->second)}
             : RasterPlace{kNone, kNone});
    }
  }
}

void MercatorMap::places(double y_m, double first_x_m, double step_m,
                         std::span<RasterPlace> places) const {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  const double v = (box_.north_m - y_m) / knot_m_;
  const auto row = std::min(static_cast<std::int64_t>(std::floor(v)), down_ - 2);
  const auto down = static_cast<float>(v - static_cast<double>(row));
  if (!(v >= 0) || v > static_cast<double>(down_ - 1)) {
    std::fill(places.begin(), places.end(), RasterPlace{kNone, kNone});
    return;
  }
  const RasterPlace* above = &knots_[static_cast<std::size_t>(row * across_)];
  const RasterPlace* below = above + across_;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double u = (first_x_m + static_cast<double>(i) * step_m - box_.west_m) / knot_m_;
    if (!(u >= 0) || u > static_cast<double>(across_ - 1)) {
      places[i] = {kNone, kNone};
      continue;
    }
    const auto c = std::min(static_cast<std::int64_t>(u), across_ - 2);
    const auto right = static_cast<float>(u - static_cast<double>(c));
    const auto between = [&](float a, float b, float p, float q) {
      const float upper = a + right * (b - a), lower = p + right * (q - p);
      return upper + down * (lower - upper);
    };
    places[i] = {
        between(above[c].column, above[c + 1].column, below[c].column, below[c + 1].column),
        between(above[c].row, above[c + 1].row, below[c].row, below[c + 1].row)};
  }
}

}  // namespace scarp
