#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/geodesy/flattening.h"

namespace scarp {

/// A point of a tileset, metres: x and y level at its centre, z up.
using TilePoint = std::array<double, 3>;

/// The Cartesian frame of a tileset, the same for all of its tiles: the globe turned and moved so
/// that numbers are small and boxes lie level. Its inverse is the root tile's transform.
///
/// Coordinates of vertices are whole steps of a power of two, so that floats relative to a tile's
/// origin, itself of whole steps, are exact: a vertex of two tiles has the same coordinates in
/// both, to the bit, and no crack can open between them.
class TilesetFrame {
 public:
  /// @param centre  on the globe, EPSG:4978
  /// @param ahead   a point in whose direction, made level, x shall point; not above the centre
  TilesetFrame(const EcefPoint& centre, const EcefPoint& ahead);

  TilePoint from_ecef(const EcefPoint& p) const;
  EcefPoint to_ecef(const TilePoint& p) const;

  /// Of the ellipsoid through a point, upwards, in the tileset's axes.
  TilePoint up_at(const TilePoint& p) const;

  /// Column by column, from the tileset to EPSG:4978.
  std::array<double, 16> transform() const;

 private:
  EcefPoint centre_;
  std::array<TilePoint, 3> axes_;  // in EPSG:4978
};

/// The finest step, and how many steps a float holds on either side of its tile's origin.
inline constexpr double kFinestStepM = 0x1p-11;
inline constexpr double kFloatSteps = 0x1p24;

/// The step of a level: the finest one with which tiles reach as far as the largest of the level.
/// @param reach_m  from a tile's origin to its farthest coordinate
double step_for(double reach_m);

/// Nearest multiple of a power of two.
TilePoint round_to_step(const TilePoint& p, double step_m);

/// A box around points, level where its middle lies. Half axes are orthogonal.
struct TileBox {
  TilePoint centre{};
  std::array<TilePoint, 3> half_axes{};

  std::array<double, 12> numbers() const;
  std::array<TilePoint, 8> corners() const;
};

/// The least level box that holds points, its sides along the tileset's x and y. Requires a point.
TileBox box_around(const TilesetFrame& frame, std::span<const TilePoint> points);

}  // namespace scarp
