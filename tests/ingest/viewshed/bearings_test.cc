#include <gtest/gtest.h>

#include <GeographicLib/Geodesic.hpp>
#include <cmath>
#include <numbers>

#include "core/viewshed/view_limits.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

/// Distances along the ground and azimuths against GeographicLib's geodesics.
TEST(EyeBearings, AgreeWithGeodesics) {
  const GeographicLib::Geodesic& geodesic = GeographicLib::Geodesic::WGS84();
  for (const double latitude : {0.0, 33.0, 46.5, -71.0, 88.5}) {
    FrameDescription description;
    description.crs_wkt = "EPSG:4326";
    description.centre_x = 10;
    description.centre_y = latitude + 0.2;
    const GeoFrame frame(description);
    const GeoFrame::Placer placer(frame);
    for (const double eye_m : {2.0, 3000.0}) {
      const EyeBearings bearings(placer.place({10, latitude, eye_m}), frame.earth_frame());
      for (const double distance_m : {30.0, 2000.0, 50'000.0, 150'000.0}) {
        for (double azimuth = 1; azimuth < 360; azimuth += 43) {
          double to_latitude, to_longitude;
          geodesic.Direct(latitude, 10, azimuth, distance_m, to_latitude, to_longitude);
          const Bearing found = bearings.to(placer.place({to_longitude, to_latitude, 700}));
          EXPECT_NEAR(found.distance_m, distance_m, 0.01 + 3e-7 * distance_m)
              << latitude << ' ' << azimuth;
          // The lattice turns a line of 30 m by less than 1e-3 degrees.
          EXPECT_NEAR(found.azimuth_rad * kDegreesPerRadian, azimuth, 1e-3)
              << latitude << ' ' << distance_m;
        }
      }
    }
  }
}

TEST(EyeBearings, PitchIsAgainstTheLevelPlaneOfTheEye) {
  FrameDescription description;
  description.crs_wkt = "EPSG:4326";
  description.centre_x = 10;
  description.centre_y = 46;
  const GeoFrame frame(description);
  const GeoFrame::Placer placer(frame);
  const EyeBearings bearings(placer.place({10, 46.1, 100}), frame.earth_frame());
  EXPECT_NEAR(bearings.to(placer.place({10, 46.1, 1100})).pitch_rad, std::numbers::pi / 2, 1e-6);
  // Level with the eye, 11.1 km away: the Earth has fallen away by half the arc.
  const Bearing level = bearings.to(placer.place({10, 46.2, 100}));
  EXPECT_NEAR(level.pitch_rad, -level.distance_m / (2 * 6.37e6), 2e-6);
}

/// The direction of an azimuth in the plane is that of the frame's own, from a geodesic.
TEST(EyeBearings, DirectionInThePlaneIsThatOfTheFrame) {
  for (const double latitude : {0.0, 46.5, -71.0, 88.5}) {
    FrameDescription description;
    description.crs_wkt = "EPSG:4326";
    description.centre_x = 10;
    description.centre_y = latitude;
    const GeoFrame frame(description);
    const GeoFrame::Placer placer(frame);
    const MapPoint from{10.4, latitude + 0.3, 800};
    const EyeBearings bearings(placer.place(from), frame.earth_frame());
    for (double azimuth = 0; azimuth < 360; azimuth += 31)
      EXPECT_NEAR(std::remainder(bearings.plane_direction_rad(azimuth / kDegreesPerRadian) -
                                     placer.plane_direction_rad(from, azimuth),
                                 2 * std::numbers::pi),
                  0, 1e-6)
          << latitude << ' ' << azimuth;
  }
}

}  // namespace
}  // namespace scarp
