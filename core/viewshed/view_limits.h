#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/geodesy/earth_frame.h"
#include "core/geodesy/position.h"
#include "core/terrain/ground_grid.h"

namespace scarp {

/// Which targets count, seen from an eye. Each range includes its ends.
struct ViewLimits {
  double min_distance_m = 0;  ///< along the ground
  double max_distance_m = std::numeric_limits<double>::infinity();
  /// Clockwise from north, [0, 2 pi); a range with its end before its begin passes over north.
  std::optional<double> azimuth_begin_rad, azimuth_end_rad;
  double min_pitch_rad = -2;  ///< of the straight line from the eye to the target, above level
  double max_pitch_rad = 2;

  bool only_distance() const {
    return !(min_distance_m > 0 || azimuth_begin_rad || min_pitch_rad > -2 || max_pitch_rad < 2);
  }
  bool any() const {
    return min_distance_m > 0 || max_distance_m < std::numeric_limits<double>::infinity() ||
           azimuth_begin_rad || min_pitch_rad > -2 || max_pitch_rad < 2;
  }
};

/// Where a target is, as an eye has it.
struct Bearing {
  double distance_m = 0;   ///< along the ground
  double azimuth_rad = 0;  ///< clockwise from north, [0, 2 pi)
  double pitch_rad = 0;
};

/// Bearings from one eye. On the ellipsoid: distance is the arc between the feet of the two
/// normals, from their chord reduced to the ellipsoid and the radius of curvature in its
/// direction, within 1 cm of the geodesic up to 50 km, 3e-7 of it up to 500 km (towards the poles
/// and across them as well); azimuth is that of the vertical plane through the target, from true
/// north; pitch is against the level plane of the eye. On the flat earth: distance in the plane,
/// azimuth from grid north.
class EyeBearings {
 public:
  /// @param earth  nothing for the flat earth
  EyeBearings(const Position& eye, const std::optional<EarthFrame>& earth);
  Bearing to(const Position& target) const;
  /// Is a target within the limits for certain, without its bearing? True only where no more than
  /// the greatest distance is limited and the target is nearer by a hundredth and more: the ground
  /// between is longer than the straight line by less than that up to kShortM, with ground down to
  /// 20 km under the ellipsoid. Cost: a tenth of to().
  bool surely_within(const ViewLimits& limits, const Position& target) const;
  /// Pitch at which the eye sees a target: of the ray where it leaves the eye, which refraction
  /// bends away from the straight line. Requires a target elsewhere in plan. Error below 1e-8 rad.
  double apparent_pitch_rad(const Position& target) const;
  /// Direction in the frame's plane, radians counter-clockwise from +x, in which an azimuth leaves
  /// the eye: that of the vertical plane, radians clockwise from true north (from grid north on the
  /// flat earth). Within 1e-6 rad of the geodesic's.
  double plane_direction_rad(double azimuth_rad) const;
  /// Where an infinitely far point lies in the sky. @param ecef  unit vector towards it
  /// On the flat earth the vector's components are east, north and up.
  Bearing to_far(const EcefPoint& ecef) const;

 private:
  static constexpr double kShortM = 500'000;

  Position eye_;
  std::optional<EarthFrame> earth_;
  EcefPoint eye_ecef_, east_, north_, up_;
  double height_m_ = 0;
};

/// Is a bearing within the limits?
bool within(const ViewLimits& limits, const Bearing& bearing);

/// A rectangle of samples, ends included; empty where last < first.
struct SampleWindow {
  std::int32_t first_column = 0, first_row = 0;
  std::int32_t last_column = -1, last_row = -1;

  bool contains(std::int32_t column, std::int32_t row) const {
    return column >= first_column && column <= last_column && row >= first_row && row <= last_row;
  }
};

SampleWindow whole_window(const GroundGrid& grid);

/// A window that holds every sample within max_distance_m of the eye, nearly the smallest.
SampleWindow reach_window(const GroundGrid& grid, const Position& eye, const EyeBearings& bearings,
                          double max_distance_m);

}  // namespace scarp
