#include "core/raster/preview.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// A plane of cells x cells squares of 10 m, without the square of squares [hole, hole + 4).
Tin plain(int cells, int hole, double slope_x) {
  Tin tin;
  std::map<std::array<int, 2>, VertexIndex> index;
  const auto vertex = [&](int column, int row) {
    const auto [it, is_new] =
        index.try_emplace({column, row}, static_cast<VertexIndex>(tin.vertices.size()));
    if (is_new) tin.vertices.push_back({column * 10.0, row * 10.0, slope_x * column * 10.0});
    return it->second;
  };
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      if (column >= hole && column < hole + 4 && row >= hole && row < hole + 4) continue;
      const VertexIndex a = vertex(column, row), b = vertex(column + 1, row);
      const VertexIndex c = vertex(column, row + 1), d = vertex(column + 1, row + 1);
      tin.triangles.push_back({a, b, c});
      tin.triangles.push_back({b, d, c});
    }
  }
  connect_neighbours(tin);
  return tin;
}

std::array<int, 3> pixel(const Picture& picture, int x, int y) {
  const auto at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) +
                       static_cast<std::size_t>(x));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

std::array<int, 3> bytes(const Rgb& c) {
  return {static_cast<int>(std::lround(c.r * 255)), static_cast<int>(std::lround(c.g * 255)),
          static_cast<int>(std::lround(c.b * 255))};
}

int brightness(const std::array<int, 3>& c) {
  return c[0] + c[1] + c[2];
}

int count_of(const Picture& picture, const std::array<int, 3>& colour, int within = 1) {
  int count = 0;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      const auto p = pixel(picture, x, y);
      bool same = true;
      for (std::size_t i = 0; i < 3; ++i) same = same && std::abs(p[i] - colour[i]) <= within;
      count += same ? 1 : 0;
    }
  }
  return count;
}

/// Flat ground keeps its unlit colour, so pixels can be counted by it.
class FlatGroups : public testing::Test {
 protected:
  void SetUp() override {
    for (const auto& t : tin.triangles) {
      // Group 0 the western 60 m, group 1 from there to 140 m, orphans beyond.
      double x_m = 0;
      for (const VertexIndex v : t) x_m += tin.vertices[v].x_m / 3;
      groups.group_of_triangle.push_back(x_m < 60 ? 0 : x_m < 140 ? 1 : kNone);
    }
    options.width_px = 420;
    options.height_px = 440;
    options.margin_px = 10;  // 2 px a metre
  }

  Tin tin = plain(20, 14, 0);
  Groups groups;
  PreviewOptions options;
};

TEST_F(FlatGroups, SharesOfPixelsAreThoseOfTheGroundWithinAPixelOfTheBorders) {
  const Picture picture = preview_from_above(tin, groups, options);
  ASSERT_EQ(picture.rgb.size(), 3U * 420 * 440);
  // Lines between groups, and around the ground, take up to a pixel on either side.
  const auto expect_area = [&](const Rgb& colour, int width_px, int height_px, int hole_px) {
    const int area_px = width_px * height_px - hole_px * hole_px;
    const int rim_px = 4 * (width_px + height_px) + 8 * hole_px;
    const int count = count_of(picture, bytes(colour));
    EXPECT_LE(count, area_px + 4);
    EXPECT_GE(count, area_px - rim_px);
  };
  expect_area(group_colour(0), 120, 400, 0);
  expect_area(group_colour(1), 160, 400, 0);
  expect_area(kOrphan, 120, 400, 80);
  const int background = 420 * 440 - 400 * 400 + 80 * 80;
  EXPECT_NEAR(count_of(picture, bytes(kBackground)), background, 4);
  EXPECT_EQ(pixel(picture, 330, 440 - 350), bytes(kBackground)) << "the void";
}

TEST_F(FlatGroups, TheEyeIsMarkedWhereItIs) {
  options.eye = Position{50, 150, 4000};
  const Picture picture = preview_from_above(tin, groups, options);
  EXPECT_EQ(pixel(picture, 10 + 100, 440 - 20 - 300), bytes(kMark));
  EXPECT_NEAR(count_of(picture, bytes(kMark)), 120, 100);
}

TEST_F(FlatGroups, CulledTrianglesAreWiresOnly) {
  std::vector<std::uint8_t> culled(tin.triangles.size());
  for (std::size_t t = 0; t < culled.size(); ++t) culled[t] = groups.group_of_triangle[t] == 0;
  options.culled = culled;
  const Picture picture = preview_from_above(tin, groups, options);
  EXPECT_EQ(count_of(picture, bytes(group_colour(0))), 0);
  EXPECT_GT(count_of(picture, bytes(group_colour(1))), 150 * 390);
  // Squares of 20 px cut by diagonals: the middle of a triangle is paper, its edge is not.
  const int left = 10 + 40, bottom = 440 - 20 - 60;
  EXPECT_EQ(pixel(picture, left + 6, bottom - 7), bytes(kBackground));
  EXPECT_LT(brightness(pixel(picture, left, bottom - 7)), brightness(bytes(kBackground)) - 60);
}

TEST(Preview, SlopesTowardsTheNorthWestAreBrighterThanThoseAway) {
  PreviewOptions options;
  options.width_px = options.height_px = 100;
  const auto middle = [&](double slope_x) {
    return brightness(pixel(preview_from_above(plain(8, 9, slope_x), {}, options), 50, 50));
  };
  EXPECT_GT(middle(0.5), middle(-0.5) + 60);  // rising eastwards faces west
}

TEST_F(FlatGroups, TheBlockFillsThe3dPictureUnderTheSky) {
  const View view = default_view(tin.vertices, 420, 440);
  options.eye = Position{100, 100, 1};
  const Picture picture = preview_3d(tin, groups, view, options);
  const ClipPosition eye = look_at(view, 420, 440).project({100, 100, 1});
  EXPECT_EQ(pixel(picture, static_cast<int>((eye.x / eye.w + 1) * 210),
                  static_cast<int>((1 - eye.y / eye.w) * 220)),
            bytes(kMark));
  const auto top = pixel(picture, 5, 5), bottom = pixel(picture, 5, 435);
  EXPECT_GT(top[2], top[0] + 20) << "blue";
  EXPECT_GT(brightness(bottom), brightness(top));
  // The near, western ground is of group 0, with little haze.
  const ClipPosition near = look_at(view, 420, 440).project({20, 20, 0});
  const auto seen = pixel(picture, static_cast<int>((near.x / near.w + 1) * 210),
                          static_cast<int>((1 - near.y / near.w) * 220));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen[i], bytes(group_colour(0))[i], 6);
}

TEST_F(FlatGroups, SameBytesForAnyNumberOfThreads) {
  const View view = default_view(tin.vertices, 420, 440);
  set_thread_count(1);
  const Picture one = preview_3d(tin, groups, view, options);
  set_thread_count(4);
  EXPECT_EQ(preview_3d(tin, groups, view, options).rgb, one.rgb);
  set_thread_count(0);
}

TEST(Preview, SceneWithoutGroundIsBackground) {
  PreviewOptions options;
  options.width_px = options.height_px = 40;
  EXPECT_EQ(count_of(preview_from_above({}, {}, options), bytes(kBackground)), 1600);
  EXPECT_EQ(preview_3d({}, {}, View{}, options).rgb.size(), 4800U);
}

TEST(Preview, ColoursOfGroupsMadeOneAfterTheOtherDiffer) {
  for (GroupIndex g = 0; g < 1000; ++g) {
    const Rgb a = group_colour(g);
    for (GroupIndex other = g + 1; other < g + 4; ++other) {
      const Rgb b = group_colour(other);
      EXPECT_GT(std::hypot(a.r - b.r, a.g - b.g, a.b - b.b), 0.12) << g << ' ' << other;
    }
  }
}

}  // namespace
}  // namespace scarp
