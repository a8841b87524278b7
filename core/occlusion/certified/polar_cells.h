#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace scarp {

/// Cells of camera places around a group, made so that a camera's cell costs no transcendental
/// function: sectors of azimuth and rings of distance. The cell of a camera that is computed in
/// float may be a neighbour's when the camera is within kCellOverlap of the border; cells hold
/// what is true that much beyond their borders.

/// Rings of distances; the last one holds all beyond.
inline constexpr std::int32_t kRings = 64;

/// How far over the borders of a cell its bounds hold: radians, and relative to the distance.
/// Float makes errors of about 2^-21 in both.
inline constexpr double kCellOverlap = 0x1p-14;

/// A group's nearest ring begins at this many radii of its circle: clear of it despite rounding.
inline constexpr double kFirstRing = 1 + 0x1p-10;

struct PolarLayout {
  std::int32_t sectors = 248;  ///< a multiple of 8, at most 4096
  /// Rings halve the square of the distance 2^ring_bits times an octave: 2 gives steps of 7 to
  /// 12 % and reaches 256 radii, 3 gives half the steps and reaches 16.
  std::int32_t ring_bits = 2;

  friend bool operator==(const PolarLayout&, const PolarLayout&) = default;
};

/// Where ring k begins, in units of kFirstRing radii.
inline double ring_start(const PolarLayout& layout, std::int32_t ring) {
  const std::int32_t parts = 1 << layout.ring_bits;
  return std::sqrt(std::ldexp(1 + static_cast<double>(ring % parts) / parts, ring / parts));
}

/// Ring of a distance by its square in units of kFirstRing radii; below 0 nearer than ring 0.
inline std::int32_t ring_of(const PolarLayout& layout, float square) {
  const auto bits = std::bit_cast<std::int32_t>(square);
  const std::int32_t ring = (bits >> (23 - layout.ring_bits)) - (127 << layout.ring_bits);
  return std::min(ring, kRings - 1);
}

/// Sector of a direction; sector 0 begins at +x, counter-clockwise. Sectors are nearly equal: in
/// each eighth of the circle they divide s (1.273 - 0.273 s) equally, s the lesser coordinate over
/// the greater. Requires (x, y) other than zero.
template <class Real>
std::int32_t sector_of(const PolarLayout& layout, Real x, Real y) {
  const Real ax = std::abs(x), ay = std::abs(y);
  const Real s = std::min(ax, ay) / std::max(ax, ay);
  const Real f = s * (Real(1.273) - Real(0.273) * s);
  // Eighths of the circle from +x: the azimuth folded into the first quarter, then unfolded.
  const Real quarter = ay > ax ? 2 - f : f;
  const Real half = x < 0 ? 4 - quarter : quarter;
  const Real eighths = y < 0 ? 8 - half : half;
  const auto sector = static_cast<std::int32_t>(eighths * static_cast<Real>(layout.sectors / 8));
  return sector < layout.sectors ? sector : 0;
}

/// The azimuth, radians, at a place in the row of sectors: 2.5 is the middle of sector 2.
inline double azimuth_at(const PolarLayout& layout, double sector) {
  const double eighths = sector * 8 / layout.sectors;
  const auto eighth = static_cast<int>(eighths);
  const double part = eighths - eighth;
  const double f = eighth % 2 == 0 ? part : 1 - part;
  const double s = (1.273 - std::sqrt(1.273 * 1.273 - 4 * 0.273 * f)) / (2 * 0.273);
  return std::numbers::pi / 4 * (eighth % 2 == 0 ? eighth : eighth + 1) +
         (eighth % 2 == 0 ? 1 : -1) * std::atan(s);
}

}  // namespace scarp
