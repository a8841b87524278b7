#include "core/horizon/sectors.h"

#include <cmath>
#include <numbers>

namespace scarp {

SectorAxis sector_axis(const SectorLayout& layout, std::int32_t sector) {
  const double azimuth_rad = 2 * std::numbers::pi * (sector + 0.5) / layout.count;
  return {std::cos(azimuth_rad), std::sin(azimuth_rad)};
}

HorizonTable no_horizons(std::size_t vertices) {
  constexpr SectorLayout kFewest{4, 1};
  return {kFewest, std::vector<VertexIndex>(vertices * kFewest.count, kNone)};
}

}  // namespace scarp
