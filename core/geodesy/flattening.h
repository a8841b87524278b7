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
/// and the lines through one point, the origin, are parallel verticals, so that terrain on the
/// ellipsoid is an ordinary height field over a plane and no algorithm needs to know about
/// curvature.
///
/// With X east, Y north, Z from the origin towards the scene's centre, D the distance between the
/// two, and R = kEarthRadiusM:
///   x = D X/Z,  y = D Y/Z,  z = D (1 - D/Z) + k D^2/R (sqrt(1 + (X/Z)^2 + (Y/Z)^2) - 1)
/// The factors D make x, y and z metres at the centre. With refraction k the rays that this makes
/// straight are 1/r = k/R + A cos(t - t0): of curvature k/R where they are horizontal.
///
/// Any origin keeps lines straight. Where the normals of the centre's parallel meet the Earth's
/// axis, verticals at the centre are plumb, which the Earth's centre gives only to 0.0034.
///
/// Requires points less than 87 degrees from the centre. Errors: none.
/// Accuracy: rounding only; see tests/core/geodesy. Source: docs/architecture.md, "Flattening".
class Flattening {
 public:
  /// @param centre       the scene's centre, where z is 0; not the origin
  /// @param refraction   k in [0, 1]; 0 is a vacuum, 0.13 light, 0.25 radio
  /// @param origin       where the verticals meet; the Earth's centre unless given
  Flattening(const EcefPoint& centre, double refraction, const EcefPoint& origin = {});

  /// Unrounded flattened coordinates; round_to_lattice makes a position of them.
  Position flatten(const EcefPoint& point) const;

  /// Cosine of the angle between a point and the centre, seen from the origin.
  double cosine_from_centre(const EcefPoint& point) const;

  /// The inverse, for what leaves the program. Exact up to rounding.
  EcefPoint unflatten(const Position& p) const;

  /// What the map is made of, for formats that repeat it: where the verticals meet, unit vectors,
  /// D and k D^2 / R.
  const EcefPoint& origin() const { return origin_; }
  const EcefPoint& east() const { return east_; }
  const EcefPoint& north() const { return north_; }
  const EcefPoint& up() const { return up_; }
  double scale_m() const { return scale_m_; }
  double bend_m() const { return bend_m_; }

 private:
  EcefPoint origin_;
  EcefPoint east_, north_, up_;  // unit vectors
  double scale_m_;               // from the origin to the centre
  double bend_m_;                // k D^2 / R
};

}  // namespace scarp
