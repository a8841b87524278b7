#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "cli/eyes_raster.h"
#include "cli/serve/served_scene.h"

namespace scarp {

/// A tile of the XYZ scheme.
struct MapTile {
  int zoom = 0;
  std::int64_t x = 0, y = 0;  ///< y from the north
};

/// Pictures of 256 x 256 pixels as PNG. What lies outside of the data is transparent.

/// Relief in colours by height, lit from the north-west, 45 degrees high.
std::string hillshade_tile(const ServedScene& scene, const MapTile& tile);

/// Heights above the datum of the data as Mapbox has them: -10000 m + (65536 R + 256 G + B) 0.1 m,
/// rounded. What is void or outside has the scene's least height, so that no cliff stands there.
std::string terrain_rgb_tile(const ServedScene& scene, const MapTile& tile);

/// Groups of a scene, each in a colour of its own, borders darker. Requires a scene.
std::string groups_tile(const ServedScene& scene, const MapTile& tile);

/// The numbers of the groups as 65536 R + 256 G + B, for clients that paint them themselves; ground
/// without a group has kNoGroupNumber, and what is void or outside is transparent. Requires a
/// scene.
inline constexpr std::uint32_t kNoGroupNumber = 0xFFFFFF;
std::string group_numbers_tile(const ServedScene& scene, const MapTile& tile);

/// What eyes see: see SeenColours.
std::string seen_tile(const ServedScene& scene, const EyesRaster& seen, const MapTile& tile);

/// A picture in web mercator of what eyes see, about a pixel a cell, nearest sample: of the part of
/// the map that they reach.
struct SeenPicture {
  std::string png;
  int width_px = 0, height_px = 0;
  std::array<double, 4> bounds_deg{};  ///< west, south, east, north of its edges
};

/// Pixels of a picture at most; coarser than a cell where the window has more.
inline constexpr std::int64_t kMostPicturePx = 16 << 20;

SeenPicture seen_picture(const ServedScene& scene, const EyesRaster& seen);

/// Colours of values in pictures of what eyes see, red, green, blue, alpha. Mode visible: what is
/// not seen is transparent. Mode count: by how many of the eyes. Modes ground and dem: by the
/// height that a target needs, in steps of kHeightSteps_m.
inline constexpr std::array<std::uint8_t, 4> kSeenColour = {235, 104, 20, 178};
inline constexpr std::array<float, 7> kHeightSteps_m = {0.5F, 2, 5, 10, 25, 50, 100};

}  // namespace scarp
