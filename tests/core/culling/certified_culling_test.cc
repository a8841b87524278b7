#include "core/culling/certified_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

constexpr double kPi = std::numbers::pi;

struct Scene {
  Tin tin;
  LeafGroups groups;
  CertifiedRegions regions;
};

const Scene& hills() {
  static const Scene scene = [] {
    Scene made{test::triangulated(test::random_hills(28, 28, 10, 4, 150, 0.01), 1), {}, {}};
    made.groups = group_by_squares(made.tin, 12);
    HidingOptions options;
    options.fans = 32;
    options.sectors = 32;
    made.regions =
        certify_groups(made.tin, made.groups.group_of_triangle, made.groups.count, options);
    return made;
  }();
  return scene;
}

/// A view, judged in long double: its border errs by less than 2^-60 of a distance, which is far
/// within what the method rounds outwards.
class View {
 public:
  View(const Position& eye, const ViewRange& view) : eye_(eye) {
    const double turn = 2 * kPi;
    double width_rad = view.to_rad - view.from_rad;
    if (width_rad < 0) width_rad += turn * std::ceil(-width_rad / turn);
    shows_all_ = width_rad >= turn;
    is_convex_ = width_rad <= kPi;
    const long double from = view.from_rad, to = from + width_rad;
    from_ = {std::cos(from), std::sin(from)}, to_ = {std::cos(to), std::sin(to)};
  }

  bool shows(const Position& p) const {
    const auto d = from_eye(p);
    const bool left_of_from = cross(from_, d) >= 0, right_of_to = cross(d, to_) >= 0;
    return shows_all_ || (is_convex_ ? left_of_from && right_of_to : left_of_from || right_of_to);
  }

  /// Whether any point of a triangle is in the view: a corner, or where a border of the view
  /// crosses an edge, or the eye stands in it.
  bool shows(const Tin& tin, TriangleIndex t) const {
    std::array<Vector, 3> corners;
    bool around_eye = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const Position& p = tin.vertices[tin.triangles[t][i]];
      if (shows(p)) return true;
      corners[i] = from_eye(p);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector &a = corners[i], &b = corners[(i + 1) % 3];
      around_eye &= cross(a, b) >= 0;
      for (const Vector& border : {from_, to_}) {
        const long double at_a = cross(border, a), at_b = cross(border, b);
        if (at_a * at_b > 0 || at_a == at_b) continue;
        const long double share = at_a / (at_a - at_b);
        const Vector met{a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
        if (met.x * border.x + met.y * border.y >= 0) return true;
      }
    }
    return around_eye;
  }

 private:
  struct Vector {
    long double x, y;
  };
  static long double cross(const Vector& a, const Vector& b) { return a.x * b.y - a.y * b.x; }
  Vector from_eye(const Position& p) const { return {p.x_m - eye_.x_m, p.y_m - eye_.y_m}; }

  Position eye_;
  bool shows_all_, is_convex_;
  Vector from_{}, to_{};
};

/// Cameras in and around the surface, with views of all widths; some borders go through vertices.
std::vector<Camera> cameras(const Tin& tin, int count) {
  std::mt19937_64 random(21);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto vertex = [&] { return tin.vertices[random() % tin.vertices.size()]; };
  std::vector<Camera> all;
  for (int i = 0; i < count; ++i) {
    Position eye = round_to_lattice({between(-150, 420), between(-150, 420), between(-50, 300)});
    if (i % 4 == 0) eye = vertex();
    double from_rad = between(-2 * kPi, 2 * kPi);
    if (i % 3 == 0) {
      const Position p = vertex();
      from_rad = std::atan2(p.y_m - eye.y_m, p.x_m - eye.x_m);
    }
    const double widths_rad[] = {0, 1e-9, 0.01, 0.3, kPi - 1e-9, kPi, 4, 6.28, 2 * kPi, 7};
    // A range may also be written from a greater to a lesser azimuth.
    const double width_rad = widths_rad[random() % std::size(widths_rad)];
    const bool wraps = i % 5 == 0 && width_rad < 2 * kPi;
    all.push_back({eye, ViewRange{from_rad, from_rad + width_rad - (wraps ? 2 * kPi : 0)}});
  }
  return all;
}

std::set<GroupIndex> visible(const CertifiedRegions& regions, const Camera& camera) {
  const auto answer = CertifiedCulling(regions).visible(camera).visible_groups;
  EXPECT_TRUE(std::is_sorted(answer.begin(), answer.end()));
  return {answer.begin(), answer.end()};
}

TEST(CertifiedCulling, AViewNeverLosesAGroupWithATriangleInIt) {
  const Scene& scene = hills();
  std::size_t kept = 0, left_out = 0;
  for (const Camera& camera : cameras(scene.tin, 400)) {
    const std::set<GroupIndex> around = visible(scene.regions, {camera.eye, {}});
    const std::set<GroupIndex> seen = visible(scene.regions, camera);
    ASSERT_TRUE(std::includes(around.begin(), around.end(), seen.begin(), seen.end()));
    const View view(camera.eye, *camera.view);
    for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t) {
      const GroupIndex group = scene.groups.group_of_triangle[t];
      if (!around.contains(group) || !view.shows(scene.tin, t)) continue;
      ++kept;
      ASSERT_TRUE(seen.contains(group))
          << "group " << group << " from " << camera.eye.x_m << " " << camera.eye.y_m << ", view "
          << camera.view->from_rad << " to " << camera.view->to_rad;
    }
    left_out += around.size() - seen.size();
  }
  EXPECT_GT(kept, 10'000U);
  EXPECT_GT(left_out, 5'000U);  // and views are of use
}

TEST(CertifiedCulling, AViewLeavesOutGroupsWhoseCircleLiesBehindTheEye) {
  const Scene& scene = hills();
  std::size_t behind = 0;
  for (const Camera& camera : cameras(scene.tin, 100)) {
    const std::set<GroupIndex> seen = visible(scene.regions, camera);
    double width_rad = camera.view->to_rad - camera.view->from_rad;
    if (width_rad < 0) width_rad += 2 * kPi;
    if (width_rad > kPi) continue;
    const double middle_rad = camera.view->from_rad + width_rad / 2;
    for (GroupIndex g = 0; g < scene.groups.count; ++g) {
      const CertifiedGroup& group = scene.regions.groups[g];
      const double x_m = group.centre_x_m - camera.eye.x_m;
      const double y_m = group.centre_y_m - camera.eye.y_m;
      const double ahead_m = x_m * std::cos(middle_rad) + y_m * std::sin(middle_rad);
      if (ahead_m >= -1.001 * static_cast<double>(group.radius_m)) continue;
      ++behind;
      EXPECT_FALSE(seen.contains(g));
    }
  }
  EXPECT_GT(behind, 1'000U);
}

TEST(CertifiedCulling, AnswersAsHidesGroupDoes) {
  const Scene& scene = hills();
  std::size_t hidden = 0;
  for (const Camera& camera : cameras(scene.tin, 300)) {
    const std::set<GroupIndex> seen = visible(scene.regions, {camera.eye, {}});
    for (GroupIndex g = 0; g < scene.groups.count; ++g) {
      EXPECT_EQ(seen.contains(g), !hides_group(scene.regions, g, camera.eye)) << g;
      hidden += !seen.contains(g);
    }
  }
  EXPECT_GT(hidden, 1'000U);
}

TEST(CertifiedCulling, OfNoGroupsAreNone) {
  EXPECT_TRUE(CertifiedCulling(CertifiedRegions{}).visible({{0, 0, 0}, {}}).visible_groups.empty());
}

}  // namespace
}  // namespace scarp
