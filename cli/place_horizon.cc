#include "cli/place_horizon.h"

#include <cmath>
#include <optional>

#include "core/threads/parallel_for.h"
#include "core/viewshed/ray_horizon.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

std::vector<HorizonLine> horizon_of(const SightSurface& surface, const SightEnd& eye,
                                    int azimuths) {
  const GeoFrame& frame = surface.frame();
  const GeoFrame::Placer placer(frame);
  // A little beyond the data, so that its border is crossed.
  const double reach_m = surface.reach_m(eye.position) * 1.001 + 1;
  const auto count = static_cast<std::size_t>(azimuths);
  std::vector<HorizonLine> lines(count);
  std::vector<Position> ends(count);
  for (std::size_t i = 0; i < count; ++i) {
    lines[i].azimuth_deg = 360.0 * static_cast<double>(i) / azimuths;
    ends[i] =
        ray_end(eye.position, placer.plane_direction_rad(eye.map, lines[i].azimuth_deg), reach_m);
  }
  std::vector<std::optional<RayHorizon>> found(count);
  parallel_for(count, [&](std::size_t i) {
    found[i] = ray_horizon(eye.position, ends[i], surface.ground_along(eye.position, ends[i]));
  });
  const EyeBearings bearings(eye.position, frame.earth_frame());
  for (std::size_t i = 0; i < count; ++i) {
    HorizonLine& line = lines[i];
    if (!found[i]) continue;
    const Position& place = found[i]->place;
    line.found = true;
    line.over_void = found[i]->over_void;
    line.elevation_deg = bearings.apparent_pitch_rad(place) * 180 / M_PI;
    line.distance_m = bearings.to(place).distance_m;
    const MapPoint at = placer.unplace(place);
    line.x = at.x;
    line.y = at.y;
    if (!frame.earth_frame()) continue;
    const GeodeticPoint geodetic = placer.geodetic(at.x, at.y);
    line.x = geodetic.longitude_deg;
    line.y = geodetic.latitude_deg;
  }
  return lines;
}

}  // namespace scarp
