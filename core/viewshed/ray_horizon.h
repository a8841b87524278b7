#pragma once

#include <optional>

#include "core/sight/ground_along.h"

namespace scarp {

/// The horizon of an eye in one direction.
struct RayHorizon {
  Position place;          ///< on the ground, unrounded
  bool over_void = false;  ///< void that might rise higher lies before known ground on the ray
};

/// Where a ray from an eye ends, as a lattice position at the eye's height.
/// @param direction_rad  in the plane, counter-clockwise from +x
/// @param reach_m        the ray's length, unless it leaves the lattice earlier
Position ray_end(const Position& eye, double direction_rad, double reach_m);

/// The highest ground along a ray, seen from its begin: of all crossings the one with the greatest
/// slope in the flattened frame, the farthest of equal ones. Nothing where there is no crossing.
///
/// The flattened frame keeps the order of heights over a line in plan, so this is the highest on
/// the Earth as well, in the plane through the eye and the frame's vertical. That leans against
/// the normal by less than 1e-4 within 100 km of the centre.
/// @param end    of the ray, beyond the data; its height does not matter
/// @param along  the ground from eye to end
std::optional<RayHorizon> ray_horizon(const Position& eye, const Position& end,
                                      const GroundAlong& along);

}  // namespace scarp
