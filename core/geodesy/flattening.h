#pragma once

#include "core/geodesy/position.h"

namespace scarp {

/// Mean Earth radius (IUGG R1), metres; the radius that refraction is stated against.
inline constexpr double kEarthRadiusM = 6'371'008.8;

/// A point in Earth-centred, Earth-fixed coordinates, metres (EPSG:4978).
struct EcefPoint {
  double x_m = 0;
  double y_m = 0;
  double z_m = 0;
};

/// Projective map from ECEF to the scene's flattened frame, in which lines of sight are straight
/// and the radial lines are parallel verticals, so that terrain on the ellipsoid is an ordinary
/// height field over a plane and no algorithm needs to know about curvature.
///
/// With X east, Y north, Z radial at the scene's centre and R = kEarthRadiusM:
///   x = R X/Z,  y = R Y/Z,  z = R (1 - R/Z) + k R (sqrt(1 + (X/Z)^2 + (Y/Z)^2) - 1)
/// The factors R keep the scale near one: x, y and z are metres at the centre on the sphere R.
/// With refraction k the rays that this makes straight are 1/r = k/R + A cos(t - t0).
///
/// Requires points less than 87 degrees from the centre. Errors: none.
/// Accuracy: rounding only; see tests/core/geodesy. Source: docs/architecture.md, "Flattening".
class Flattening {
 public:
  /// @param centre       any point on the radial line of the scene's centre, not the origin
  /// @param refraction   k in [0, 1]; 0 is a vacuum, 0.13 light, 0.25 radio
  Flattening(const EcefPoint& centre, double refraction);

  /// Unrounded flattened coordinates; round_to_lattice makes a position of them.
  Position flatten(const EcefPoint& point) const;

  /// The inverse, for what leaves the program. Exact up to rounding.
  EcefPoint unflatten(const Position& p) const;

  double refraction() const { return refraction_; }
  EcefPoint centre() const { return up_; }

 private:
  EcefPoint east_, north_, up_;  // unit vectors
  double refraction_;
};

}  // namespace scarp
