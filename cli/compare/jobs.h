#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "cli/compare/compared_ground.h"
#include "cli/compare/compared_job.h"
#include "core/threads/progress.h"
#include "core/viewshed/grid_sight.h"

namespace scarp {

/// Another program's viewshed, for benchmarks that have it.
struct ViewshedPeer {
  std::string method, setting, command;
  /// Sees from an eye kComparedEyeHeightM over a sample. @param seen[out]  [rows * columns]
  /// @return seconds of each of kComparedRuns, without its start and its files. Throws Error.
  std::function<std::vector<double>(const ComparedGround::Eye&, std::span<Seen> seen)> look;
};
inline constexpr double kComparedEyeHeightM = 2;

/// Another program's horizons.
struct HorizonPeer {
  std::string method, setting, command;
  double looks = 0;  ///< points and directions that its time is for; 0: those it is asked for
  /// @param elevation_deg[out]  [places * kComparedAzimuths], NaN where it has none
  /// @return seconds of each of kComparedRuns. Throws Error.
  std::function<std::vector<double>(std::span<const ComparedGround::Eye> places,
                                    std::span<double> elevation_deg)>
      look;
};
/// From north clockwise.
inline constexpr int kComparedAzimuths = 16;

/// What eyes 2 m over samples see of the square: shares of samples wrong, against the judge. Every
/// accuracy, meshes of several errors, and gdal_viewshed's algorithm where map units are metres.
ComparedJob compare_viewsheds(const ComparedGround& ground, const Progress& progress,
                              std::span<const ViewshedPeer> peers = {});

/// Least heights at which targets are seen: metres off, against the judge.
ComparedJob compare_heights(const ComparedGround& ground, const Progress& progress);

/// Horizons: degrees off the judge's, at samples and azimuths drawn at random, and how far apart
/// the bounds are. Time is that of a point and direction, because methods have other points.
ComparedJob compare_horizons(const ComparedGround& ground, std::uint64_t seed,
                             const Progress& progress, std::span<const HorizonPeer> peers = {});

/// Meshes: triangles and time for an error, measured at every sample by one looker for all.
ComparedJob compare_meshes(const ComparedGround& ground, const Progress& progress);

}  // namespace scarp
