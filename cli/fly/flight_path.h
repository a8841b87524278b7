#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/fly/flown_ground.h"
#include "core/culling/camera.h"

namespace scarp {

/// Where a camera is at a frame, and where it looks.
struct Waypoint {
  MapPoint eye;
  double azimuth_deg = 0;  ///< clockwise from true north, from grid north where there is no CRS
  double pitch_deg = 0;    ///< above the horizon
};

/// Kinds of paths that are found on a scene.
enum class Route {
  kStreet,      ///< 2 m above the streets of a town, 2 m a frame
  kWalk,        ///< 2 m above a valley's floor, 2 m a frame
  kDrive,       ///< 2 m above it, 15 m a frame
  kHelicopter,  ///< 100 m above a valley, 40 m a frame
  kAirliner,    ///< 10 km above the mean ground, straight across, 250 m a frame
};

/// A kind by its name. Requires street, walk, drive, helicopter or airliner.
Route route_of(const std::string& name);

/// Reads a path: a line "x,y,height_m,azimuth_deg,pitch_deg", then a line a frame, in the CRS of
/// the scene, heights above its datum. Throws Error{kInput} that names the line.
std::vector<Waypoint> read_path(const std::string& file);

std::string to_csv(const std::vector<Waypoint>& path);

/// Finds a path of a kind: the same seed finds the same one. As many frames as were asked for, or
/// fewer where the way ends earlier.
/// Throws Error{kInput} where there is no ground to go along.
std::vector<Waypoint> find_path(const FlownGround& ground, Route route, int frames,
                                std::uint64_t seed);

/// The picture that is taken at a waypoint.
struct Lens {
  int width_px = 640;
  int height_px = 360;
  double vertical_field_of_view_deg = 45;
};
Shot shot_at(const GeoFrame::Placer& placer, const Waypoint& waypoint, const Lens& lens);

}  // namespace scarp
