#pragma once

#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"
#include "core/occlusion/certified/certified_regions.h"

namespace scarp {

/// Where cameras are hidden from a whole tile for certain, coarsely: one slope for each of a few
/// sectors of the camera's azimuth and rings of its distance from the tile, for engines that ask
/// for tiles and not for groups.
///
/// A camera at the distance d from the centre, in the plane, d from radius_m * 2^(k/2) up to
/// radius_m * 2^((k+1)/2) for ring k, its azimuth (counter-clockwise from +x) from 2 pi s / sectors
/// up to 2 pi (s+1) / sectors, sees nothing of the tile where its z is strictly below
/// height_m + slope * d. Nearer and farther cameras are not told anything.
struct TileHorizon {
  static constexpr std::int32_t kSectors = 16;
  static constexpr std::int32_t kTileRings = 12;  ///< up to 64 radii
  /// A slope under which no camera is: nothing is hidden.
  static constexpr float kNothingHidden = -3.0e38F;

  double centre_x_m = 0, centre_y_m = 0;
  double height_m = 0;  ///< that slopes start from
  double radius_m = 0;  ///< of a circle that holds the tile
  /// [kSectors * kTileRings], ring by ring within a sector; +infinity while no group counts.
  std::vector<float> slopes;
};

/// A horizon that holds for no ground yet, so that everything is hidden.
TileHorizon horizon_of_nothing(double centre_x_m, double centre_y_m, double height_m,
                               double radius_m);

/// Has a horizon hold for groups too, which lie within its circle.
/// Side: never more hidden than the groups' regions say.
/// Cost: tens of microseconds a group.
void cover_groups(const CertifiedRegions& regions, TileHorizon& horizon);

/// Has it hold for ground of which nothing is known.
void cover_uncertified(TileHorizon& horizon);

/// Has it hold for what another horizon of the same circle holds for (asserted).
void cover(const TileHorizon& other, TileHorizon& horizon);

/// Whether the tile is hidden from a camera. The definition.
bool hides_tile(const TileHorizon& horizon, const Position& eye);

}  // namespace scarp
