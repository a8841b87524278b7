#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geodesy/position.h"
#include "core/occlusion/certified/certified_regions.h"

namespace scarp {

/// Cells of camera places around a tile: sectors of azimuth, and rings of distance.
struct HorizonLayout {
  std::int32_t sectors = 0;
  std::int32_t rings = 0;
  std::int32_t rings_per_octave = 0;  ///< of distance

  constexpr std::size_t cells() const {
    return static_cast<std::size_t>(sectors) * static_cast<std::size_t>(rings);
  }
  friend bool operator==(const HorizonLayout&, const HorizonLayout&) = default;
};

/// Of tilesets, whose engines ask for tiles and not for groups: few numbers, up to 64 radii.
inline constexpr HorizonLayout kTilesetHorizon = {16, 12, 2};

/// Of a scene's own tree of tiles (tile_tree.h): 12 KB a tile, up to 64 radii.
inline constexpr HorizonLayout kTreeHorizon = {64, 48, 8};

/// Where cameras are hidden from a whole tile for certain, coarsely: one slope for each of a few
/// sectors of the camera's azimuth and rings of its distance from the tile.
///
/// A camera at the distance d from the centre, in the plane, d from radius_m * 2^(k/n) up to
/// radius_m * 2^((k+1)/n) for ring k of n in an octave, its azimuth (counter-clockwise from +x)
/// from 2 pi s / sectors up to 2 pi (s+1) / sectors, sees nothing of the tile where its z is
/// strictly below height_m + slope * d. Nearer and farther cameras are not told anything.
struct TileHorizon {
  /// A slope under which no camera is: nothing is hidden.
  static constexpr float kNothingHidden = -3.0e38F;

  HorizonLayout layout;
  double centre_x_m = 0, centre_y_m = 0;
  double height_m = 0;  ///< that slopes start from
  double radius_m = 0;  ///< of a circle that holds the tile
  /// [layout.cells()], ring by ring within a sector; +infinity while no group counts.
  std::vector<float> slopes;
};

/// A horizon that holds for no ground yet, so that everything is hidden.
TileHorizon horizon_of_nothing(const HorizonLayout& layout, double centre_x_m, double centre_y_m,
                               double height_m, double radius_m);

/// Has a horizon hold for groups too, which lie within its circle.
/// Side: never more hidden than the groups' regions say. The same bits for any number of threads.
/// Cost: for each group a tenth of a microsecond a cell in which something may still be hidden.
void cover_groups(const CertifiedRegions& regions, TileHorizon& horizon);

/// Has it hold for ground of which nothing is known.
void cover_uncertified(TileHorizon& horizon);

/// Has it hold for what another horizon of the same circle holds for (asserted).
void cover(const TileHorizon& other, TileHorizon& horizon);

/// Has it hold for what the horizon of another circle holds for, such as that of a smaller tile
/// within. Side: never more hidden than that one says.
/// Cost: about a microsecond a cell in which something may still be hidden.
void cover_tile(const TileHorizon& tile, TileHorizon& horizon);

/// Whether the tile is hidden from a camera. The definition.
bool hides_tile(const TileHorizon& horizon, const Position& eye);

}  // namespace scarp
