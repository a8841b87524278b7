#pragma once

#include "core/geodesy/ellipsoid.h"
#include "core/geodesy/flattening.h"

namespace scarp {

/// A flattened frame and the ellipsoid that it was made on.
struct EarthFrame {
  Flattening frame;
  double semi_major_m = 0;
  double flattening = 0;
};

/// The outward normal of the ellipsoid through a point, and the height above it along the normal.
struct EllipsoidNormal {
  EcefPoint up;  ///< unit vector
  double height_m = 0;
};

/// Accuracy: below a millimetre in height and 1e-9 rad in direction, from 10 km under the
/// ellipsoid to 100 km above it. Requires a point that is not at the Earth's centre.
/// Source: Bowring 1976, one step.
EllipsoidNormal ellipsoid_normal(const Ellipsoid& earth, const EcefPoint& point);

/// On the frame's ellipsoid.
inline EllipsoidNormal ellipsoid_normal(const EarthFrame& earth, const EcefPoint& point) {
  return ellipsoid_normal(Ellipsoid{earth.semi_major_m, earth.flattening}, point);
}

}  // namespace scarp
