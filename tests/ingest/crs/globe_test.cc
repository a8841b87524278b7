#include "ingest/crs/globe.h"

#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <random>
#include <utility>

#include "core/error/error.h"
#include "tests/ingest/crs/frame_at.h"

namespace scarp {
namespace {

using test::frame_at;

/// By PROJ through OGR, of a CRS with ellipsoidal heights.
EcefPoint by_proj(const std::string& crs_3d, const MapPoint& at) {
  OGRSpatialReference from, to;
  from.SetFromUserInput(crs_3d.c_str());
  from.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  to.SetFromUserInput("EPSG:4978");
  const std::unique_ptr<OGRCoordinateTransformation> convert(
      OGRCreateCoordinateTransformation(&from, &to));
  double x = at.x, y = at.y, z = at.height_m;
  EXPECT_TRUE(convert && convert->Transform(1, &x, &y, &z));
  return {x, y, z};
}

double distance_m(const EcefPoint& p, const EcefPoint& q) {
  return std::hypot(p.x_m - q.x_m, p.y_m - q.y_m, p.z_m - q.z_m);
}

/// What the lattice may move a position by: half a step in each coordinate.
constexpr double kLatticeM = kLatticeStepM * 0.87 * 1.001;

TEST(Globe, Wgs84IsUnflattenedToATenthOfAMillimetre) {
  std::mt19937_64 random(2);
  for (const double refraction : {0.0, 0.25}) {
    FrameDescription description = frame_at("EPSG:32632", 500'000, 5'200'000);
    description.refraction = refraction;
    const GeoFrame frame(description);
    const Globe globe(frame);
    EXPECT_EQ(globe.datum_shift(), "");
    const GeoFrame::Placer placer(frame);
    const Globe::Placer on_globe(globe);
    std::uniform_real_distribution<double> around(-60'000, 60'000), height(-400, 8000);
    OGRSpatialReference flat;
    flat.SetFromUserInput("EPSG:32632");
    flat.PromoteTo3D(nullptr);
    char* wkt = nullptr;
    const char* const options[] = {"FORMAT=WKT2_2019", nullptr};
    flat.exportToWkt(&wkt, options);
    const std::string solid = wkt;
    CPLFree(wkt);
    for (int i = 0; i < 100; ++i) {
      const MapPoint at{500'000 + around(random), 5'200'000 + around(random), height(random)};
      EXPECT_LT(distance_m(on_globe.ecef(placer.place(at)), by_proj(solid, at)), kLatticeM + 1e-5);
    }
  }
}

/// NAD27: about 100 m from WGS 84, by the one transformation that PROJ prefers there.
TEST(Globe, AnotherDatumIsShifted) {
  const GeoFrame frame(frame_at("EPSG:26710", 560'000, 5'110'000));
  const Globe globe(frame);
  EXPECT_NE(globe.datum_shift(), "");
  const GeoFrame::Placer placer(frame);
  const Globe::Placer on_globe(globe);
  const Flattening own = frame.earth_frame()->frame;
  for (const double away : {-8000.0, 0.0, 7000.0}) {
    const Position p = placer.place({560'000 + away, 5'110'000 - away, 1500});
    const EcefPoint shifted = on_globe.ecef(p);
    EXPECT_GT(distance_m(shifted, own.unflatten(p)), 50);
    EXPECT_LT(distance_m(shifted, own.unflatten(p)), 300);
    // A shift, not a tear: a step of 1 m stays one.
    Position beside = p;
    beside.x_m += 1;
    EXPECT_NEAR(distance_m(on_globe.ecef(beside), shifted),
                distance_m(own.unflatten(beside), own.unflatten(p)), 1e-4);
  }
}

/// Heights above the geoid: PROJ's own conversion from EGM96 heights comes to the same place.
TEST(Globe, UndulationsAreAddedOnWgs84AndElsewhere) {
  const std::string egm96 = "/usr/share/proj/egm96_15.gtx";
  if (!std::filesystem::exists(egm96)) GTEST_SKIP() << "left out, proj-data not found: " << egm96;
  const MapPoint at{8.65, 46.55, 1200};
  // WGS 84, and ETRS89, which goes the long way round and lies within a metre of it.
  for (const auto& [crs, away_m] : {std::pair{"EPSG:4326", 0.01}, std::pair{"EPSG:4258", 1.0}}) {
    FrameDescription description = frame_at(crs, at.x, at.y);
    description.geoid_file = egm96;
    const GeoFrame frame(description);
    const Globe globe(frame);
    const EcefPoint placed = Globe::Placer(globe).ecef(GeoFrame::Placer(frame).place(at));
    EXPECT_LT(distance_m(placed, by_proj("EPSG:4326+5773", at)), away_m) << crs;
  }
}

TEST(Globe, FlatScenesHaveNoPlace) {
  FrameDescription description = frame_at("EPSG:32632", 500'000, 5'200'000);
  description.earth = Earth::kFlat;
  const GeoFrame frame(description);
  EXPECT_THROW(Globe{frame}, Error);
}

}  // namespace
}  // namespace scarp
