#include "core/raster/occlusion_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/raster/coverage_pyramid.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// The nearest depth at which a ray through a place of the screen meets one of some triangles, 0
/// where it meets none: every triangle is tried, in homogeneous coordinates.
double nearest_depth(const Tin& tin, const Projection& projection,
                     std::span<const TriangleIndex> triangles, double x, double y) {
  double nearest = 0;
  for (const TriangleIndex t : triangles) {
    // Corners as seen along the ray: (x, y, w) -> offset from the ray.
    std::array<ClipPosition, 3> p;
    for (std::size_t i = 0; i < 3; ++i)
      p[i] = projection.project(tin.vertices[tin.triangles[t][i]]);
    const auto turn = [&](const ClipPosition& a, const ClipPosition& b) {
      return (a.x - x * a.w) * (b.y - y * b.w) - (b.x - x * b.w) * (a.y - y * a.w);
    };
    const double u = turn(p[1], p[2]), v = turn(p[2], p[0]), w = turn(p[0], p[1]);
    if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) || u + v + w == 0) continue;
    const double sum = u + v + w;
    const double at_w = (u * p[0].w + v * p[1].w + w * p[2].w) / sum;
    const double at_z = (u * p[0].z + v * p[1].z + w * p[2].z) / sum;
    if (at_w > 0 && at_z <= at_w) nearest = std::max(nearest, at_z / at_w);
  }
  return nearest;
}

struct Case {
  Tin tin;
  Projection projection;
  std::vector<TriangleIndex> occluders;
};

/// Hills seen from over their ground, with most of their triangles, or all but a patch.
Case random_case(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  Case made;
  made.tin = test::triangulated(test::random_hills(24, 24, 10, seed, 20 + 80 * unit(), 0.01), seed);
  View view;
  const Position& under = made.tin.vertices[random() % made.tin.vertices.size()];
  view.eye = {under.x_m, under.y_m, under.z_m + (seed % 2 == 0 ? 2 : 60 * unit() + 1)};
  const double turn = 6.28 * unit();
  view.target = {view.eye.x_m + std::cos(turn), view.eye.y_m + std::sin(turn),
                 view.eye.z_m + 0.4 - unit()};
  view.vertical_field_of_view_rad = 0.3 + unit();
  if (seed % 4 == 1) view.near_m = 40;  // cuts through what is in the picture
  made.projection = look_at(view, 64, 48);
  const double kept = seed % 3 == 0 ? 1 : 0.8 + 0.2 * unit();
  for (TriangleIndex t = 0; t < made.tin.triangles.size(); ++t)
    if (unit() <= kept) made.occluders.push_back(t);
  return made;
}

TEST(OcclusionMap, EveryRayOfACoveredPixelIsStoppedAtItsDepthOrNearer) {
  std::size_t covered = 0, pixels = 0;
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    const Case c = random_case(seed);
    OcclusionMap map{64, 48, {}};
    OcclusionMapper(c.tin).draw(c.projection, c.occluders, map);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> within(0, 1);
    for (int y = 0; y < map.height_px; ++y)
      for (int x = 0; x < map.width_px; ++x) {
        const double depth = static_cast<double>(map.depth[static_cast<std::size_t>(y * 64 + x)]);
        ++pixels;
        if (depth == 0) continue;
        ++covered;
        for (int ray = 0; ray < 6; ++ray) {
          // Corners and borders of the pixel as often as its inside.
          const double dx = ray < 2 ? std::round(within(random)) : within(random);
          const double dy = ray < 3 ? std::round(within(random)) : within(random);
          const double found =
              nearest_depth(c.tin, c.projection, c.occluders, 2 * (x + dx) / map.width_px - 1,
                            1 - 2 * (y + dy) / map.height_px);
          ASSERT_GE(found, depth) << "seed " << seed << ", pixel " << x << "," << y;
        }
      }
  }
  EXPECT_GT(covered, pixels / 4) << "it must also find something";
}

TEST(OcclusionMap, AWallOfSmallTrianglesCoversWhatOneOfThemCannot) {
  // A steep slope that fills the picture, with triangles much smaller than a pixel.
  const Tin tin = test::triangulated(
      test::grid_of(80, 80, 1, [](std::int32_t, std::int32_t row) { return 4.0 * row; }), 3);
  View view;
  view.eye = {40, 200, 160};
  view.target = {40, 40, 160};
  view.vertical_field_of_view_rad = 0.25;
  std::vector<TriangleIndex> all(tin.triangles.size());
  for (TriangleIndex t = 0; t < all.size(); ++t) all[t] = t;
  OcclusionMap map{16, 16, {}};
  OcclusionMapper(tin).draw(look_at(view, 16, 16), all, map);
  EXPECT_EQ(std::count(map.depth.begin(), map.depth.end(), 0.0F), 0);
}

TEST(CoveragePyramid, CoversABoxExactlyWhereEveryPixelOfItIsNearer) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> depth(0.1F, 1);
  for (int repeat = 0; repeat < 40; ++repeat) {
    const int width = 1 + static_cast<int>(random() % 37),
              height = 1 + static_cast<int>(random() % 23);
    std::vector<float> depths;
    for (int i = 0; i < width * height; ++i)
      depths.push_back(random() % 50 == 0 ? 0 : depth(random) + (repeat % 2 == 0 ? 0.5F : 0));
    CoveragePyramid pyramid;
    pyramid.build(width, height, depths, 2 + repeat % 3);
    for (int look = 0; look < 50; ++look) {
      const int x = static_cast<int>(random() % static_cast<unsigned>(width));
      const int y = static_cast<int>(random() % static_cast<unsigned>(height));
      const PixelBox box{x, y, std::min(width - 1, x + static_cast<int>(random() % 6)),
                         std::min(height - 1, y + static_cast<int>(random() % 6))};
      const float nearest = 0.6F * depth(random);
      bool is_covered = true;
      for (int py = box.top; py <= box.bottom; ++py)
        for (int px = box.left; px <= box.right; ++px)
          is_covered &= depths[static_cast<std::size_t>(py * width + px)] > nearest;
      ASSERT_EQ(pyramid.covers(box, nearest), is_covered);
    }
  }
}

TEST(CoveragePyramid, OverlooksHolesThatAreSmallBesideATexelWhereAskedTo) {
  std::vector<float> depths(16 * 16, 0.5F);
  depths[16 * 7 + 5] = 0;
  CoveragePyramid pyramid;
  pyramid.build(16, 16, depths);
  EXPECT_FALSE(pyramid.covers({0, 0, 15, 15}, 0.1F));
  EXPECT_TRUE(pyramid.covers({0, 0, 15, 15}, 0.1F, 0.9F));
  EXPECT_FALSE(pyramid.covers({0, 0, 15, 15}, 0.6F, 0.9F)) << "nearer than what covers it";
}

}  // namespace
}  // namespace scarp
