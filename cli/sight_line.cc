#include "cli/sight_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error/error.h"
#include "core/viewshed/view_limits.h"

namespace scarp {
namespace {

constexpr double kSpeedOfLightMPerS = 299'792'458;

/// The height above ground at which one end would be free, the other as it is.
template <class Judge>
std::optional<double> least_height_m(const SightSurface& surface, const SightEnd& end,
                                     Judge judge) {
  if (!end.ground_m) return {};
  return least_free_height_m([&](double height_m) {
    const MapPoint raised{end.map.x, end.map.y, *end.ground_m + height_m};
    return judge(surface.place(raised).position) != Sight::kHidden;
  });
}

std::optional<SightBlocker> blocker_of(const SightSurface& surface, const SightLine& line) {
  if (line.sight != Sight::kHidden) return {};
  const auto under = [](const SightEnd& end, double distance_m) {
    const double ground_m = end.ground_m.value_or(end.map.height_m);
    return SightBlocker{{end.map.x, end.map.y, ground_m}, distance_m, end.map.height_m - ground_m};
  };
  if (surface.starts_under_ground(line.from.position, line.to.position)) return under(line.from, 0);
  const auto first = std::find_if(line.profile.begin(), line.profile.end(),
                                  [](const ProfilePoint& p) { return p.blocks; });
  if (first == line.profile.end()) return under(line.to, line.distance_m);
  return SightBlocker{line.ground[static_cast<std::size_t>(first - line.profile.begin())],
                      first->distance_m, first->clearance_m};
}

template <class Measure>
std::optional<std::size_t> least(const std::vector<ProfilePoint>& profile, Measure of) {
  if (profile.empty()) return {};
  const auto found =
      std::min_element(profile.begin(), profile.end(),
                       [&](const ProfilePoint& p, const ProfilePoint& q) { return of(p) < of(q); });
  return static_cast<std::size_t>(found - profile.begin());
}

}  // namespace

std::optional<std::size_t> SightLine::least_clear() const {
  return least(profile, [](const ProfilePoint& p) { return p.clearance_m; });
}

std::optional<std::size_t> SightLine::least_ratio() const {
  if (wavelength_m == 0) return {};
  return least(profile, [](const ProfilePoint& p) { return p.fresnel_ratio(); });
}

SightLine measure_sight(const SightSurface& surface, const SightEnd& from, const SightEnd& to,
                        std::optional<double> frequency_hz, const std::string& from_text,
                        const std::string& to_text) {
  const Position &a = from.position, &b = to.position;
  if (a.x_m == b.x_m && a.y_m == b.y_m)
    throw Error(ErrorCode::kInput,
                fmt::format("--from {} and --to {}: are the same place on the map; two places "
                            "were expected; move one of them",
                            from_text, to_text));
  const auto earth = surface.frame().earth_frame();
  SightLine line;
  line.from = from;
  line.to = to;
  line.sight = surface.judge(a, b);
  const GroundAlong along = surface.ground_along(a, b);
  line.void_at_end = along.void_at_end;
  line.wavelength_m = frequency_hz ? kSpeedOfLightMPerS / *frequency_hz : 0;
  line.profile = sight_profile(a, b, along, earth, line.wavelength_m);
  const GeoFrame::Placer placer(surface.frame());
  for (const ProfilePoint& point : line.profile)
    line.ground.push_back(placer.unplace(point.ground));
  const Bearing bearing = EyeBearings(a, earth).to(b);
  line.distance_m = bearing.distance_m;
  line.azimuth_deg = bearing.azimuth_rad * 180 / M_PI;
  line.blocker = blocker_of(surface, line);
  line.least_from_m =
      least_height_m(surface, from, [&](const Position& p) { return surface.judge(p, b); });
  line.least_to_m =
      least_height_m(surface, to, [&](const Position& p) { return surface.judge(a, p); });
  return line;
}

const char* word_of(Sight sight) {
  return sight == Sight::kVisible ? "visible" : sight == Sight::kHidden ? "hidden" : "unknown";
}

}  // namespace scarp
