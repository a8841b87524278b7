#include "core/horizon/certified/fan.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace scarp {

Fan fan_of(std::int32_t count, std::int32_t index) {
  assert(count >= 8 && count <= (1 << 16) && index >= 0 && index < count);
  Fan fan{};
  fan.middle_rad = 2 * std::numbers::pi * (index + 0.5) / count;
  fan.axis_x = std::cos(fan.middle_rad);
  fan.axis_y = std::sin(fan.middle_rad);
  fan.half_rad = std::numbers::pi / count * (1 + kFanWidening);
  fan.tan_half = std::tan(fan.half_rad);
  fan.sin_half = std::sin(fan.half_rad);
  fan.cos_half = std::cos(fan.half_rad);
  return fan;
}

void view_along(const Fan& fan, const Tin& tin, double origin_x_m, double origin_y_m,
                FanView& view) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  view.fan = fan;
  view.vertices.resize(tin.vertices.size());
  view.low_u_m = view.low_v_m = kInfinity;
  view.high_u_m = view.high_v_m = -kInfinity;
  double reach_m = 0, height_m = 0;
  for (std::size_t i = 0; i < tin.vertices.size(); ++i) {
    const Position& p = tin.vertices[i];
    const double dx_m = p.x_m - origin_x_m, dy_m = p.y_m - origin_y_m;
    const FanPlace place = place_in(fan, dx_m, dy_m, p.z_m);
    view.vertices[i] = place;
    view.low_u_m = std::min(view.low_u_m, place.u_m);
    view.high_u_m = std::max(view.high_u_m, place.u_m);
    view.low_v_m = std::min(view.low_v_m, place.v_m);
    view.high_v_m = std::max(view.high_v_m, place.v_m);
    reach_m = std::max({reach_m, std::abs(dx_m), std::abs(dy_m)});
    height_m = std::max(height_m, std::abs(p.z_m));
  }
  view.error_m = kFanPlaceRounding * 2 * reach_m;
  view.height_error_m = kFanPlaceRounding * height_m;
}

}  // namespace scarp
