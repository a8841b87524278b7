#pragma once

#include "core/geodesy/flattening.h"

namespace scarp {

/// Direction of the sun's centre from the Earth's, a unit vector in ECEF.
///
/// @param days  since 2000-01-01T12:00 UTC (leap seconds not counted)
/// Accuracy: 0.01 degree from 1950 to 2050; parallax (0.0024 degree at most) is left out.
/// Source: Meeus, Astronomical Algorithms (1998), chapters 12 and 25, low accuracy.
EcefPoint sun_direction(double days);

/// Elevation at which air shows what is at a true elevation, radians both: at 10 degrees Celsius
/// and 1010 hPa. Below -1 degree nothing is added. Accuracy: 0.002 degree above 5 degrees; near the
/// horizon weather matters more. Source: Saemundsson 1986 (Meeus, formula 16.4).
double refracted_elevation_rad(double true_elevation_rad);

}  // namespace scarp
