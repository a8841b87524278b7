#pragma once

#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"
#include "core/terrain/tin.h"

namespace scarp {

/// A fan of directions in the flattened plane: one of `count` equal parts of the circle, both ends
/// included, fan 0 beginning at +x, counter-clockwise. Places are written as u along its middle
/// direction and v to the left of it, so that along every ray of the fan u grows and |dv| is at
/// most tan_half * du.
struct Fan {
  double axis_x, axis_y;  ///< middle direction, a unit vector but for rounding
  double middle_rad;
  double half_rad;                      ///< half the angle, widened by kFanWidening
  double tan_half, sin_half, cos_half;  ///< of half_rad
};

/// Relative widening of a fan's angle: far more than the rounding of its axis, so that fans
/// overlap and every direction lies in one of them.
inline constexpr double kFanWidening = 0x1p-30;

/// Requires 8 <= count <= 2^16, so that rounding stays under the widening.
Fan fan_of(std::int32_t count, std::int32_t index);

/// A place in a fan's frame; heights are not changed. Metres.
struct FanPlace {
  double u_m, v_m, z_m;
};

/// The vertices of a TIN in the frame of a fan around an origin in the plane.
struct FanView {
  Fan fan;
  std::vector<FanPlace> vertices;
  double low_u_m = 0, high_u_m = 0, low_v_m = 0, high_v_m = 0;
  /// Greatest error of a u or v: kFanPlaceRounding times the greatest distance from the origin.
  double error_m = 0;
  /// Allowance for the rounding of a height between two of the vertices.
  double height_error_m = 0;
};

/// u and v are sums of two rounded products of a rounded direction: below 4 * 2^-53 of the sum of
/// their sizes, which is below sqrt(2) times the distance. The rest is left to interpolation.
inline constexpr double kFanPlaceRounding = 0x1p-48;

/// @param origin_x_m, origin_y_m  a lattice place amid the vertices
/// @param view[out]               its memory is reused
void view_along(const Fan& fan, const Tin& tin, double origin_x_m, double origin_y_m,
                FanView& view);

/// The place in the frame, with the error that the view states for vertices.
inline FanPlace place_in(const Fan& fan, double dx_m, double dy_m, double z_m) {
  return {fan.axis_x * dx_m + fan.axis_y * dy_m, fan.axis_x * dy_m - fan.axis_y * dx_m, z_m};
}

}  // namespace scarp
