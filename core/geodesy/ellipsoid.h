#pragma once

namespace scarp {

/// An ellipsoid of revolution around the z axis.
struct Ellipsoid {
  double semi_major_m = 0;
  double flattening = 0;

  double semi_minor_m() const { return semi_major_m * (1 - flattening); }
};

/// The ellipsoid of EPSG:4978 and EPSG:4979.
inline constexpr Ellipsoid kWgs84 = {6'378'137, 1 / 298.257223563};

}  // namespace scarp
