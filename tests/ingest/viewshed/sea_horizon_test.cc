#include <gdal_priv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/viewshed/viewshed.h"
#include "ingest/dem/dem.h"
#include "tests/support/temp_folder.h"

namespace scarp {
namespace {

/// A sea at height 0.
struct Sea {
  const char* crs;
  double x, y;            ///< its middle
  double cell_x, cell_y;  ///< in units of the CRS
};

constexpr int kSide = 121;

Ground read_sea(const Sea& sea) {
  GDALAllRegister();
  const test::TempFolder folder;
  const std::string path = folder.path("sea.tif");
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      path.c_str(), kSide, kSide, 1, GDT_Float32, nullptr);
  double transform[6] = {sea.x - kSide / 2.0 * sea.cell_x, sea.cell_x, 0,
                         sea.y + kSide / 2.0 * sea.cell_y, 0,          -sea.cell_y};
  dataset->SetGeoTransform(transform);
  OGRSpatialReference crs;
  crs.SetFromUserInput(sea.crs);
  dataset->SetSpatialRef(&crs);
  GDALClose(dataset);
  return read_ground({path}, {}, {});
}

struct Vector {
  double x, y, z;
};

/// A place on the ellipsoid of WGS 84 and the normal there.
std::pair<Vector, Vector> on_ellipsoid(const GeodeticPoint& at, double height_m) {
  constexpr double kA = 6'378'137, kF = 1 / 298.257223563, kE2 = kF * (2 - kF);
  const double latitude = at.latitude_deg * std::numbers::pi / 180,
               longitude = at.longitude_deg * std::numbers::pi / 180;
  const double n = kA / std::sqrt(1 - kE2 * std::sin(latitude) * std::sin(latitude));
  const Vector up{std::cos(latitude) * std::cos(longitude),
                  std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
  return {{(n + height_m) * up.x, (n + height_m) * up.y, (n * (1 - kE2) + height_m) * up.z}, up};
}

class SeaHorizon : public testing::TestWithParam<Sea> {};

/// The sea is convex: a place is seen where the eye is above its tangent plane.
TEST_P(SeaHorizon, LiesWithinACellOfTheClosedForm) {
  const Ground ground = read_sea(GetParam());
  const GroundGrid& grid = ground.grid;
  const GeoFrame::Placer placer(*ground.dem.frame);
  constexpr double kEyeM = 100;
  constexpr int kMiddle = kSide / 2;
  const Position eye = grid.place(kMiddle, kMiddle, kEyeM);
  const Vector e =
      on_ellipsoid(placer.geodetic(ground.dem.x_of(kMiddle), ground.dem.y_of(kMiddle)), kEyeM)
          .first;
  std::vector<Seen> seen(static_cast<std::size_t>(kSide * kSide));
  view_from(grid, ground.dem.frame->earth_frame(), {eye, 0, {}}, seen);
  std::vector<bool> expected;
  for (int r = 0; r < kSide; ++r) {
    for (int c = 0; c < kSide; ++c) {
      const auto [p, up] = on_ellipsoid(placer.geodetic(ground.dem.x_of(c), ground.dem.y_of(r)), 0);
      expected.push_back((e.x - p.x) * up.x + (e.y - p.y) * up.y + (e.z - p.z) * up.z >= 0);
    }
  }
  int compared = 0, hidden = 0;
  for (int r = 1; r + 1 < kSide; ++r) {
    for (int c = 1; c + 1 < kSide; ++c) {
      const auto at = [&](int dc, int dr) {
        return expected[static_cast<std::size_t>((r + dr) * kSide + c + dc)];
      };
      bool alike = true;
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc) alike = alike && at(dc, dr) == at(0, 0);
      if (!alike) continue;
      ++compared;
      hidden += !at(0, 0);
      EXPECT_EQ(seen[static_cast<std::size_t>(r * kSide + c)] == Seen::kVisible, at(0, 0))
          << "column " << c << " row " << r;
    }
  }
  EXPECT_GT(compared, kSide * kSide * 9 / 10);
  EXPECT_GT(hidden, kSide * kSide / 10);
}

INSTANTIATE_TEST_SUITE_P(All, SeaHorizon,
                         testing::Values(Sea{"EPSG:4326", 7, 0.001, 0.009, 0.009},
                                         Sea{"EPSG:4326", 7, 46, 0.0128, 0.009},
                                         Sea{"EPSG:4326", -70, -71, 0.0275, 0.009},
                                         Sea{"EPSG:4326", 30, 84, 0.086, 0.009},
                                         Sea{"EPSG:32632", 500'000, 5'000'000, 1000, 1000},
                                         Sea{"EPSG:32733", 200'000, 8'000'000, 1000, 1000},
                                         Sea{"EPSG:32633", 600'000, 8'900'000, 1000, 1000}));

}  // namespace
}  // namespace scarp
