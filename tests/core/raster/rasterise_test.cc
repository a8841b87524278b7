#include "core/raster/rasterise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

using Corners = std::array<VertexIndex, 3>;

/// A point of the screen, in subpixels from the upper left.
struct ScreenPoint {
  std::int64_t x = 0;
  std::int64_t y = 0;
};

/// Clip position that lands exactly on the point; exact where the sizes are powers of two.
ClipPosition at_screen(const ScreenPoint& p, double depth, int width_px, int height_px) {
  return {2.0 * static_cast<double>(p.x) / (kSubpixels * width_px) - 1,
          1 - 2.0 * static_cast<double>(p.y) / (kSubpixels * height_px), depth, 1};
}

std::int64_t twice_area(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
}

/// The judge of coverage: the centre is inside all three edges, or on a top or left one.
bool covers(std::array<ScreenPoint, 3> t, int x_px, int y_px) {
  if (twice_area(t[0], t[1], t[2]) == 0) return false;
  if (twice_area(t[0], t[1], t[2]) < 0) std::swap(t[1], t[2]);
  const ScreenPoint centre = {x_px * kSubpixels + kSubpixels / 2,
                              y_px * kSubpixels + kSubpixels / 2};
  for (std::size_t i = 0; i < 3; ++i) {
    const ScreenPoint& a = t[i];
    const ScreenPoint& b = t[(i + 1) % 3];
    // y points down and the order is clockwise on the screen: tops run right, lefts run up.
    const bool top_or_left = (a.y == b.y && b.x > a.x) || b.y < a.y;
    const std::int64_t side = twice_area(a, b, centre);
    if (side < 0 || (side == 0 && !top_or_left)) return false;
  }
  return true;
}

double depth_at(const std::array<ScreenPoint, 3>& t, const std::array<double, 3>& depth, int x_px,
                int y_px) {
  const ScreenPoint centre = {x_px * kSubpixels + kSubpixels / 2,
                              y_px * kSubpixels + kSubpixels / 2};
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    sum += depth[i] * static_cast<double>(twice_area(t[(i + 1) % 3], t[(i + 2) % 3], centre));
  }
  return sum / static_cast<double>(twice_area(t[0], t[1], t[2]));
}

struct RandomScene {
  std::vector<ScreenPoint> points;
  std::vector<double> depths;
  std::vector<ClipPosition> clip;
  std::vector<Corners> triangles;
};

/// Triangles of every size, many with corners on pixel centres, some degenerate, some outside.
RandomScene random_scene(std::mt19937& random, int count, int width_px, int height_px) {
  std::uniform_int_distribution<int> step(0, 5);
  std::uniform_int_distribution<std::int64_t> x(-20, width_px + 20), y(-20, height_px + 20);
  std::uniform_int_distribution<std::int64_t> sub(0, kSubpixels - 1);
  std::uniform_real_distribution<double> depth(0.1, 0.9);
  std::uniform_int_distribution<int> reach(1, 80);
  RandomScene scene;
  for (int t = 0; t < count; ++t) {
    const std::int64_t x_px = x(random), y_px = y(random);
    std::uniform_int_distribution<std::int64_t> near(-reach(random), reach(random));
    const auto offset = [&] { return step(random) < 3 ? kSubpixels / 2 : sub(random); };
    const auto first = static_cast<VertexIndex>(scene.clip.size());
    for (int corner = 0; corner < 3; ++corner) {
      const ScreenPoint p = {(x_px + near(random)) * kSubpixels + offset(),
                             (y_px + near(random)) * kSubpixels + offset()};
      const double z = depth(random);
      scene.points.push_back(p);
      scene.depths.push_back(z);
      scene.clip.push_back(at_screen(p, z, width_px, height_px));
    }
    scene.triangles.push_back({first, first + 1, first + 2});
  }
  return scene;
}

TEST(Rasterise, CoverageDepthAndObjectAreThoseOfTheExactRayCaster) {
  constexpr int kWidth = 256, kHeight = 128;  // more than one tile each way
  std::mt19937 random(1);
  int compared = 0;
  for (int round = 0; round < 8; ++round) {
    const RandomScene scene = random_scene(random, 60, kWidth, kHeight);
    Target target = empty_target(kWidth, kHeight);
    rasterise(target, scene.clip, scene.triangles);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        double best = 0, second = -1;
        std::uint32_t nearest = kNone;
        for (std::uint32_t t = 0; t < scene.triangles.size(); ++t) {
          const auto [a, b, c] = scene.triangles[t];
          const std::array<ScreenPoint, 3> points = {scene.points[a], scene.points[b],
                                                     scene.points[c]};
          if (!covers(points, x, y)) continue;
          const double z =
              depth_at(points, {scene.depths[a], scene.depths[b], scene.depths[c]}, x, y);
          if (nearest == kNone || z > best) {
            second = best;
            best = z;
            nearest = t;
          } else {
            second = std::max(second, z);
          }
        }
        const std::size_t at = target.index(x, y);
        ASSERT_NEAR(target.depth[at], best, 4e-7) << x << ' ' << y;
        ASSERT_EQ(target.object[at] == kNone, nearest == kNone) << x << ' ' << y;
        if (nearest == kNone || best - second < 1e-6) continue;
        ASSERT_EQ(target.object[at], nearest) << x << ' ' << y;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 50'000);
}

/// Adds one to the count of every pixel that each triangle covers, each drawn alone.
std::vector<int> coverage_counts(std::span<const ClipPosition> clip,
                                 std::span<const Corners> triangles, int width_px, int height_px) {
  std::vector<int> counts(static_cast<std::size_t>(width_px * height_px), 0);
  for (const Corners& triangle : triangles) {
    Target target = empty_target(width_px, height_px);
    rasterise(target, clip, {&triangle, 1});
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += target.object[i] != kNone ? 1 : 0;
  }
  return counts;
}

TEST(Rasterise, TrianglesThatShareEdgesCoverEachPixelExactlyOnce) {
  // A grid of points moved at random, each by less than half a cell, so that no triangle turns
  // over; wider than the picture, so that every pixel has its triangle. Unrounded corners.
  constexpr int kWidth = 64, kHeight = 64, kCells = 10;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> moved(-0.24, 0.24);
    std::vector<ClipPosition> clip;
    for (int row = 0; row <= kCells; ++row) {
      for (int column = 0; column <= kCells; ++column) {
        const auto coordinate = [&](int i) {
          return seed % 2 == 0 ? (i + moved(random)) * 2.6 / kCells - 1.3
                               : std::round(i * 80.0 / kCells - 8) / 32 - 1 + 1.0 / 64;
        };
        clip.push_back({coordinate(column), coordinate(row), 0.5, 1});
      }
    }
    std::vector<Corners> triangles;
    for (VertexIndex row = 0; row < kCells; ++row) {
      for (VertexIndex column = 0; column < kCells; ++column) {
        const VertexIndex a = row * (kCells + 1) + column, b = a + 1, c = a + kCells + 1, d = c + 1;
        triangles.push_back({a, b, c});
        triangles.push_back({c, d, b});
      }
    }
    const std::vector<int> counts = coverage_counts(clip, triangles, kWidth, kHeight);
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 1), kWidth * kHeight) << "seed " << seed;
  }
}

TEST(Rasterise, FansCoverEachPixelExactlyOnceHoweverThin) {
  constexpr int kSize = 64;
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int64_t> inner(20 * kSubpixels, 44 * kSubpixels);
  for (int round = 0; round < 20; ++round) {
    // The hub on a pixel centre, a corner of a pixel, or anywhere; spokes far out of the picture.
    const ScreenPoint hub = round == 0   ? ScreenPoint{32 * kSubpixels + 128, 32 * kSubpixels + 128}
                            : round == 1 ? ScreenPoint{32 * kSubpixels, 32 * kSubpixels}
                                         : ScreenPoint{inner(random), inner(random)};
    std::vector<ClipPosition> clip = {at_screen(hub, 0.5, kSize, kSize)};
    constexpr VertexIndex kSpokes = 48;
    std::vector<Corners> triangles;
    for (VertexIndex i = 0; i < kSpokes; ++i) {
      const double angle = 2 * 3.14159265358979 * i / kSpokes;
      clip.push_back({20 * std::cos(angle), 20 * std::sin(angle), 0.5, 1});
      triangles.push_back({0, 1 + i, 1 + (i + 1) % kSpokes});
    }
    const std::vector<int> counts = coverage_counts(clip, triangles, kSize, kSize);
    EXPECT_EQ(std::count(counts.begin(), counts.end(), 1), kSize * kSize) << "round " << round;
  }
}

/// Distance along the ray to the triangle, in units of the direction, or nothing.
std::optional<double> cast(const Position& eye, const std::array<double, 3>& direction,
                           const std::array<Position, 3>& t) {
  const auto minus = [](const Position& a, const Position& b) {
    return std::array<double, 3>{a.x_m - b.x_m, a.y_m - b.y_m, a.z_m - b.z_m};
  };
  const auto cross = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                 a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  };
  const auto u = minus(t[1], t[0]), v = minus(t[2], t[0]), from = minus(eye, t[0]);
  const auto normal = cross(direction, v);
  const double determinant = dot(u, normal);
  if (determinant == 0) return std::nullopt;
  const double a = dot(from, normal) / determinant;
  const auto q = cross(from, u);
  const double b = dot(direction, q) / determinant;
  if (a < 0 || b < 0 || a + b > 1) return std::nullopt;
  return dot(v, q) / determinant;
}

TEST(Rasterise, TrianglesAreCutAtTheNearPlaneAsRaysSay) {
  constexpr int kWidth = 160, kHeight = 120;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-30, 30);
  View view;
  view.eye = {0, 0, 0};
  view.target = {3, 10, 1};
  view.near_m = 2;
  view.vertical_field_of_view_rad = 1.2;
  std::vector<Position> positions;
  std::vector<Corners> triangles;
  for (VertexIndex i = 0; i < 3 * 40; i += 3) {  // most reach behind the eye
    for (int corner = 0; corner < 3; ++corner) {
      positions.push_back({place(random), place(random), place(random)});
    }
    triangles.push_back({i, i + 1, i + 2});
  }
  const Projection projection = look_at(view, kWidth, kHeight);
  Target target = empty_target(kWidth, kHeight);
  rasterise(target, project_all(projection, positions), triangles);

  struct Seen {
    std::uint32_t object = kNone;
    double depth = 0;
  };
  const auto cast_at = [&](double x_px, double y_px) {
    // The direction whose clip position is (x, y, near, 1): row 3 . d = 1, rows 0 and 1 give x, y.
    const double x = 2 * x_px / kWidth - 1, y = 1 - 2 * y_px / kHeight;
    const auto& m = projection.rows;
    std::array<double, 3> d{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double sx = m[0] * m[0] + m[1] * m[1] + m[2] * m[2];
      const double sy = m[4] * m[4] + m[5] * m[5] + m[6] * m[6];
      d[k] = m[12 + k] + x * m[k] / sx + y * m[4 + k] / sy;
    }
    Seen seen;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const auto [a, b, c] = triangles[t];
      const auto hit = cast(view.eye, d, {positions[a], positions[b], positions[c]});
      if (hit && *hit >= view.near_m && view.near_m / *hit > seen.depth) {
        seen = {t, view.near_m / *hit};
      }
    }
    return seen;
  };
  int compared = 0, drawn = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Seen seen = cast_at(x + 0.5, y + 0.5);
      // Corners are rounded by up to 1/512 pixel: what changes within 1/64 is not compared.
      bool steady = true;
      for (const double dx : {-1.0 / 64, 1.0 / 64}) {
        for (const double dy : {-1.0 / 64, 1.0 / 64}) {
          steady = steady && cast_at(x + 0.5 + dx, y + 0.5 + dy).object == seen.object;
        }
      }
      if (!steady) continue;
      ASSERT_EQ(target.object[target.index(x, y)], seen.object) << x << ' ' << y;
      ASSERT_NEAR(target.depth[target.index(x, y)], seen.depth, 2e-3) << x << ' ' << y;
      ++compared;
      drawn += seen.object != kNone ? 1 : 0;
    }
  }
  EXPECT_GT(compared, kWidth * kHeight * 9 / 10);
  EXPECT_GT(drawn, kWidth * kHeight / 2);
}

TEST(Rasterise, GroundUnderTheEyeHasNoGaps) {
  // The eye stands on a grid of triangles that go on behind it; every pixel below the horizon
  // must be covered, with corners cut by the near plane and by the guard far out of the picture.
  constexpr int kSize = 200, kCells = 40;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> moved(-0.3, 0.3);
  std::vector<Position> positions;
  std::vector<Corners> triangles;
  for (VertexIndex row = 0; row <= kCells; ++row) {
    for (VertexIndex column = 0; column <= kCells; ++column) {
      positions.push_back({(column + moved(random) - kCells / 2) * 1000,
                           (row + moved(random) - kCells / 2) * 1000, 0});
      if (row == kCells || column == kCells) continue;
      const VertexIndex a = row * (kCells + 1) + column, b = a + 1, c = a + kCells + 1, d = c + 1;
      triangles.push_back({a, b, c});
      triangles.push_back({c, b, d});
    }
  }
  View view;
  view.eye = {13, -27, 0.002};
  view.target = {13, 973, -200};
  view.near_m = 0.001;
  Target target = empty_target(kSize, kSize);
  rasterise(target, project_all(look_at(view, kSize, kSize), positions), triangles);
  const double pitch_rad = std::atan2(200.002, 1000);
  const double horizon_px =
      kSize / 2.0 * (1 - std::tan(pitch_rad) / std::tan(view.vertical_field_of_view_rad / 2));
  for (int y = static_cast<int>(horizon_px) + 2; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) ASSERT_NE(target.object[target.index(x, y)], kNone) << x << y;
  }
}

TEST(Rasterise, CornersFarBeyondThePictureAreCutNotOverflown) {
  // The picture lies on both sides of the edge y = 0, whose ends are 10^12 pictures away.
  const std::vector<ClipPosition> clip = {
      {-1e9, 0, 2e-4, 1e-3}, {1e9, 0, 5e-4, 1e-3}, {0, 1e9, 3e-4, 1e-3}, {0, -1e9, 3e-4, 1e-3}};
  const std::vector<Corners> triangles = {{0, 1, 2}, {0, 1, 3}};
  Target target = empty_target(64, 64);
  rasterise(target, clip, triangles);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      ASSERT_EQ(target.object[target.index(x, y)], y < 32 ? 0U : 1U) << x << ' ' << y;
      ASSERT_NEAR(target.depth[target.index(x, y)], 0.35, 1e-6);
    }
  }
}

TEST(Rasterise, OfEqualDepthsTheLowestObjectStays) {
  const std::vector<ClipPosition> clip = {{-1, -1, 0.5, 1}, {1, -1, 0.5, 1}, {0, 1, 0.5, 1}};
  const std::vector<Corners> triangles(3, Corners{0, 1, 2});
  const std::vector<std::uint32_t> objects = {8, 3, 5};
  Target target = empty_target(32, 32);
  rasterise(target, clip, triangles, objects);
  EXPECT_EQ(target.object[target.index(16, 16)], 3U);
  EXPECT_EQ(target.object[target.index(0, 0)], kNone);
}

TEST(Rasterise, NothingBeyondTheFarthestDepthIsDrawn) {
  const std::vector<ClipPosition> clip = {{-1, -1, -0.5, 1}, {1, -1, 0.5, 1}, {0, 1, -0.5, 1}};
  const std::vector<Corners> triangles = {{0, 1, 2}};
  Target target = empty_target(64, 64);
  rasterise(target, clip, triangles);
  EXPECT_EQ(target.object[target.index(20, 40)], kNone);
  EXPECT_EQ(target.object[target.index(56, 60)], 0U);
}

TEST(Rasterise, SameBitsForAnyNumberOfThreadsAndAnyOrder) {
  constexpr int kWidth = 300, kHeight = 200;
  std::mt19937 random(7);
  RandomScene scene = random_scene(random, 20'000, kWidth, kHeight);
  std::vector<std::uint32_t> objects(scene.triangles.size());
  for (std::uint32_t i = 0; i < objects.size(); ++i) objects[i] = i / 3;
  set_thread_count(1);
  Target one = empty_target(kWidth, kHeight);
  rasterise(one, scene.clip, scene.triangles, objects);
  for (const int threads : {2, 5}) {
    set_thread_count(threads);
    Target many = empty_target(kWidth, kHeight);
    rasterise(many, scene.clip, scene.triangles, objects);
    EXPECT_EQ(one.depth, many.depth);
    EXPECT_EQ(one.object, many.object);
  }
  set_thread_count(0);
  std::reverse(scene.triangles.begin(), scene.triangles.end());
  std::reverse(objects.begin(), objects.end());
  Target reversed = empty_target(kWidth, kHeight);
  rasterise(reversed, scene.clip, scene.triangles, objects);
  EXPECT_EQ(one.depth, reversed.depth);
  EXPECT_EQ(one.object, reversed.object);

  Target depth_only = empty_depth_target(kWidth, kHeight);
  rasterise(depth_only, scene.clip, scene.triangles, objects);
  EXPECT_EQ(one.depth, depth_only.depth);
}

}  // namespace
}  // namespace scarp
