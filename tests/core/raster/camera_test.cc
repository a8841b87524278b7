#include "core/raster/camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace scarp {
namespace {

TEST(Camera, PerspectivePutsTheTargetInTheMiddleAndUpOnTop) {
  View view;
  view.eye = {100, 200, 50};
  view.target = {100, 1200, 50};  // due north
  view.near_m = 0.5;
  const Projection projection = look_at(view, 200, 100);
  const ClipPosition middle = projection.project(view.target);
  EXPECT_NEAR(middle.x, 0, 1e-9);
  EXPECT_NEAR(middle.y, 0, 1e-9);
  EXPECT_DOUBLE_EQ(middle.w, 1000);
  EXPECT_DOUBLE_EQ(middle.z, 0.5);
  EXPECT_GT(projection.project({200, 1200, 50}).x, 0) << "east is right";
  const double top_m = 1000 * std::tan(view.vertical_field_of_view_rad / 2);
  const ClipPosition top = projection.project({100, 1200, 50 + top_m});
  EXPECT_NEAR(top.y / top.w, 1, 1e-12);
  const ClipPosition right = projection.project({100 + 2 * top_m, 1200, 50});
  EXPECT_NEAR(right.x / right.w, 1, 1e-12) << "pixels are square";
}

TEST(Camera, LookingStraightDownHasNorthUp) {
  View view;
  view.eye = {0, 0, 1000};
  view.target = {0, 0, 0};
  const Projection projection = look_at(view, 100, 100);
  EXPECT_GT(projection.project({0, 10, 0}).y, 0);
  EXPECT_GT(projection.project({10, 0, 0}).x, 0);
}

TEST(Camera, FromAboveFitsTheBoundsWithSquarePixelsAndReversedDepth) {
  const Bounds bounds = {{100, 200, 5}, {300, 250, 25}};
  const Projection projection = ortho_from_above(bounds, 440, 200, 20);
  const ClipPosition low = projection.project(bounds.low);
  const ClipPosition high = projection.project(bounds.high);
  EXPECT_NEAR((low.x + 1) * 220, 20, 1e-9);
  EXPECT_NEAR((high.x + 1) * 220, 420, 1e-9);
  EXPECT_NEAR((high.y - low.y) * 100, 50 * 2, 1e-9) << "2 px a metre, as in x";
  EXPECT_NEAR(low.z, 0, 1e-12);
  EXPECT_NEAR(high.z, 1, 1e-12);
}

std::vector<Position> corners_of(const Bounds& bounds) {
  std::vector<Position> corners;
  for (const double x_m : {bounds.low.x_m, bounds.high.x_m}) {
    for (const double y_m : {bounds.low.y_m, bounds.high.y_m}) {
      for (const double z_m : {bounds.low.z_m, bounds.high.z_m}) corners.push_back({x_m, y_m, z_m});
    }
  }
  return corners;
}

TEST(Camera, DefaultViewHoldsAllGroundAndWastesNoPicture) {
  for (const Bounds& bounds :
       {Bounds{{0, 0, 100}, {5000, 4000, 900}}, Bounds{{-1e5, -3e4, 0}, {1e5, 3e4, 50}},
        Bounds{{0, 0, 0}, {10, 4000, 5000}}, Bounds{{7, 7, 7}, {7, 7, 7}}}) {
    const std::vector<Position> ground = corners_of(bounds);
    const View view = default_view(ground, 1200, 800);
    const Projection projection = look_at(view, 1200, 800);
    double greatest = 0;
    for (const Position& p : ground) {
      const ClipPosition corner = projection.project(exaggerated(view, p));
      EXPECT_GT(corner.w, view.near_m);
      greatest = std::max({greatest, std::abs(corner.x / corner.w), std::abs(corner.y / corner.w)});
    }
    EXPECT_LE(greatest, 0.951);
    if (bounds.high.y_m > bounds.low.y_m) {
      EXPECT_GE(greatest, 0.85);
    }
    EXPECT_LT(view.target.z_m, view.eye.z_m);
  }
}

TEST(Camera, OnlyFlatScenesAreExaggerated) {
  const auto exaggeration = [](double relief_m) {
    return default_view(corners_of({{0, 0, 0}, {1000, 1000, relief_m}}), 100, 100)
        .vertical_exaggeration;
  };
  EXPECT_EQ(exaggeration(300), 1);
  EXPECT_EQ(exaggeration(25), 5);
  EXPECT_EQ(exaggeration(1), 20);
  EXPECT_EQ(exaggeration(0), 1);
}

}  // namespace
}  // namespace scarp
