#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "cli/sight_surface.h"
#include "core/viewshed/sight_profile.h"

namespace scarp {

/// Ground on the line that stands in the way.
struct SightBlocker {
  MapPoint map;
  double distance_m = 0;
  double clearance_m = 0;  ///< below 0
};

/// All that is known of one sight line: the work of `scarp sight` and of the server.
struct SightLine {
  SightEnd from, to;
  Sight sight = Sight::kUnknown;
  double distance_m = 0, azimuth_deg = 0;
  std::vector<ProfilePoint> profile;
  std::vector<MapPoint> ground;  ///< of each point of the profile
  bool void_at_end = false;
  double wavelength_m = 0;  ///< 0: no Fresnel zone was asked for
  std::optional<SightBlocker> blocker;
  /// Least height above ground at which an end would be free, the other as it is.
  std::optional<double> least_from_m, least_to_m;

  /// The points of the profile with the least clearance, and with the least share of the zone.
  std::optional<std::size_t> least_clear() const;
  std::optional<std::size_t> least_ratio() const;
};

/// @param frequency_hz  none: without a Fresnel zone
/// Throws Error{kInput} where both ends are one place on the map, @param from_text, to_text  as
/// given, for the message.
SightLine measure_sight(const SightSurface& surface, const SightEnd& from, const SightEnd& to,
                        std::optional<double> frequency_hz, const std::string& from_text,
                        const std::string& to_text);

const char* word_of(Sight sight);

}  // namespace scarp
