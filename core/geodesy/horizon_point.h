#pragma once

#include <optional>
#include <span>

#include "core/geodesy/ellipsoid.h"
#include "core/geodesy/flattening.h"

namespace scarp {

/// One point that stands for a whole piece of ground where the Earth's bulge hides it: a camera
/// from which the ellipsoid hides the point sees nothing of the ground.
///
/// A camera V does not see a point P of the scaled space (each ECEF axis divided by the ellipsoid's
/// half axis, which makes the ellipsoid the unit sphere) where the segment VP runs through the unit
/// sphere; where V itself is inside the sphere, where P.V < V.V. These are the tests of engines
/// that cull by the horizon (TILE_HORIZON_OCCLUSION_POINT of 3D Tiles).
///
/// The ellipsoid is not the Earth: ground below it (a sea's geoid, a depression, the sag of a wide
/// triangle) does not hide what the ellipsoid would. What is taken as solid is the ball of radius
/// rho = 1 - depth / b in scaled space, which holds no point higher than `depth_m` under the
/// ellipsoid. With alpha the angle from the direction to a ground point q, the point lies at
///   1 / cos(max over q of (alpha + acos(rho / |q|)) + acos(rho))
/// along the direction. acos(rho) pays for the shell between the ball and the ellipsoid: a camera
/// on the ellipsoid sees that much farther than the test says. Ground under a plane through points
/// is covered by the points, because what a horizon leaves hidden is convex.
///
/// @param points     ECEF, metres; all ground lies in their convex hull
/// @param towards    ECEF, metres: a point in whose direction the result lies; the middle of the
///                   ground gives the best one
/// @param depth_m    no solid ground lies deeper below the ellipsoid, 0 or more (asserted)
/// @return in scaled space, or nothing where the ground is so wide that no point can stand for it:
///         about 85 degrees from its middle. Points deeper than depth_m count as if at that depth.
/// Side: where the point is hidden, all of the ground is hidden by the ball.
/// Cost: O(n). Errors: none. Derived here; with rho = 1 it is the formula of Ring 2013, "Horizon
/// culling".
std::optional<EcefPoint> horizon_point(std::span<const EcefPoint> points, const EcefPoint& towards,
                                       const Ellipsoid& ellipsoid, double depth_m);

}  // namespace scarp
