#include "core/occlusion/sector_range.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace scarp {
namespace {

constexpr double kTurnRad = 2 * std::numbers::pi;

}  // namespace

SectorRange sectors_touching(const SectorLayout& layout, const AzimuthArc& arc) {
  assert(arc.from_rad <= arc.to_rad);
  if (arc.to_rad - arc.from_rad >= kTurnRad) return {0, layout.count};
  const double sectors_per_rad = layout.count / kTurnRad;
  const auto low =
      static_cast<std::int32_t>(std::floor((arc.from_rad - kAzimuthRoundingRad) * sectors_per_rad));
  const auto high =
      static_cast<std::int32_t>(std::floor((arc.to_rad + kAzimuthRoundingRad) * sectors_per_rad));
  const std::int32_t first = (low % layout.count + layout.count) % layout.count;
  return {first, std::min(layout.count, high - low + 1)};
}

SectorRange sectors_towards(const SectorLayout& layout, double x, double y) {
  assert(x != 0 || y != 0);
  const double azimuth_rad = std::atan2(y, x);
  return sectors_touching(layout, {azimuth_rad, azimuth_rad});
}

bool arcs_overlap(const AzimuthArc& a, const AzimuthArc& b) {
  double ahead_rad = std::fmod(b.from_rad - a.from_rad, kTurnRad);  // from a's start to b's
  if (ahead_rad < 0) ahead_rad += kTurnRad;
  return ahead_rad <= a.to_rad - a.from_rad + kAzimuthRoundingRad ||
         kTurnRad - ahead_rad <= b.to_rad - b.from_rad + kAzimuthRoundingRad;
}

}  // namespace scarp
