#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/geodesy/earth_frame.h"
#include "core/skyline/march_ground.h"
#include "core/terrain/ground_grid.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// Azimuth of the rays from a place, radians clockwise from north: the same everywhere, or that of
/// the sun.
using AzimuthAt = std::function<double(const EyeBearings& from)>;

/// A rectangle of cells in lanes and lines of a march.
struct MarchTile {
  std::int32_t first_lane = 0, lanes = 0;
  std::int32_t first_line = 0, lines = 0;
};

/// A value that varies linearly over a tile.
struct TileLinear {
  double middle = 0, per_lane = 0, per_line = 0;
  double at(double lanes_off, double lines_off) const {
    return middle + lanes_off * per_lane + lines_off * per_line;
  }
};

/// The rays of one azimuth from all cells of a tile. Meridians converge, map grids bend and levels
/// tilt, so that rays of one azimuth are neither parallel nor straight in columns and rows; over a
/// tile all of it is nearly linear.
///
/// The ray from the cell (p lanes, q lines) off the tile's middle crosses the k-th line
///   place[k] + k turn(p, q)                 lanes from the cell,
///   1 / (inverse_run[k]) * stretch(p, q)    metres from it in the plane,
/// the former within slack(k), and a slope s in the frame is seen under the elevation
///   tangent(s) = level(p, q, z) + s rise(p, q, z) + s^2 bend, within tangent_error (1 + s^2).
///
/// Side of error: slack and tangent_error are twice the greatest error that is measured at the
/// corners and sides of the tile, where that of a linear model is greatest, and what rounding to
/// the lattice and the lean of the verticals can add.
struct RayFan {
  int line_step = 1;  ///< +1 towards later lines, -1 towards earlier ones
  std::vector<double> place;
  std::vector<double> inverse_run;  ///< [0] is 0
  TileLinear turn, stretch;
  double slack_fixed = 0, slack_rate = 0;
  double bulge = 0;  ///< lanes by which 1 line of squared half-length may leave its chord
  TileLinear level, rise;
  double level_z = 0, rise_z = 0;  ///< per metre of z above middle_z_m
  double middle_z_m = 0;
  double bend = 0;
  double tangent_error = 0;

  std::int32_t reach() const { return static_cast<std::int32_t>(place.size()) - 1; }
  double slack(double k) const { return slack_fixed + slack_rate * k; }
};

/// How much rays of an azimuth from a tile's middle run along lines for each line crossed; a march
/// serves well up to 1, and at all up to kMostAlong.
inline constexpr double kMostAlong = 1.5;
struct Course {
  double lanes_per_line = 0;  ///< crossed
  int line_step = 1;
};
Course course_of(const GroundGrid& grid, const std::optional<EarthFrame>& earth, March march,
                 double lane, double line, const AzimuthAt& azimuth);
double runs_along(const GroundGrid& grid, const std::optional<EarthFrame>& earth, March march,
                  const MarchTile& tile, const AzimuthAt& azimuth);

/// How far the verticals of a grid lean at most.
double greatest_tilt(const GroundGrid& grid);

/// Cells below this are no wider than a few steps of the lattice, and no fan holds, metres.
inline constexpr double kLeastCellM = 0.02;

/// Requires runs_along of at most kMostAlong and cells of at least kLeastCellM.
/// @param tilt  greatest_tilt
/// Cost: about 50 microseconds and O(lines).
RayFan ray_fan(const GroundGrid& grid, const std::optional<EarthFrame>& earth, double tilt,
               March march, const MarchTile& tile, const AzimuthAt& azimuth);

}  // namespace scarp
