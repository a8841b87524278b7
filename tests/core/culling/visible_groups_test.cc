#include "core/culling/visible_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "core/occlusion/build_groups.h"
#include "core/occlusion/group_tree.h"
#include "core/occlusion/sector_range.h"
#include "tests/support/exact_region.h"
#include "tests/support/horizon_scenes.h"

namespace scarp {
namespace {

constexpr double kPi = std::numbers::pi;

double rolling_m(double x_m, double y_m) {
  return 60 * std::sin(x_m / 90) * std::cos(y_m / 70) + 25 * std::sin((x_m + y_m) / 37);
}

/// Ridges along x = 150 and x = 450, valleys at 0, 300 and 600, 150 m deep.
double two_ridges_m(double x_m, double) {
  const double from_valley_m = std::fmod(x_m, 300);
  return std::min(from_valley_m, 300 - from_valley_m);
}

struct Scene {
  Tin tin;
  HorizonTable horizon;
  Groups groups;
};

Scene scene_of(Tin tin, const SectorLayout& layout) {
  Scene scene{std::move(tin), {}, {}};
  scene.horizon = exhaustive_horizon(scene.tin, layout);
  CrystalOptions options;
  options.group_triangles = 40;
  options.min_group_triangles = 10;
  scene.groups = build_groups(scene.tin, scene.horizon, options);
  return scene;
}

const Scene& rolling() {
  static const Scene scene = scene_of(lattice_tin(40, 40, 10, rolling_m), {8, 2});
  return scene;
}

const Scene& ridges() {
  static const Scene scene = scene_of(lattice_tin(61, 61, 10, two_ridges_m), {8, 2});
  return scene;
}

bool is_visible(const CullingAnswer& answer, GroupIndex leaf) {
  return std::binary_search(answer.visible_groups.begin(), answer.visible_groups.end(), leaf);
}

/// Leaves all of whose vertices lie in a box.
std::vector<GroupIndex> leaves_within(const Scene& scene, double low_x_m, double high_x_m,
                                      double low_y_m, double high_y_m) {
  std::vector<bool> within(scene.groups.leaf_count, true);
  for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t)
    for (const VertexIndex v : scene.tin.triangles[t]) {
      const Position& p = scene.tin.vertices[v];
      const GroupIndex g = scene.groups.group_of_triangle[t];
      if (g != kNone &&
          (p.x_m < low_x_m || p.x_m > high_x_m || p.y_m < low_y_m || p.y_m > high_y_m))
        within[g] = false;
    }
  std::vector<GroupIndex> leaves;
  for (GroupIndex g = 0; g < within.size(); ++g)
    if (within[g]) leaves.push_back(g);
  return leaves;
}

/// The definition, without rounding: whether a vertex is hidden in each sector that has the camera.
bool vertex_is_hidden(const Scene& scene, VertexIndex v, const Position& eye) {
  const Position& p = scene.tin.vertices[v];
  const SectorLayout& layout = scene.horizon.layout;
  if (p.x_m == eye.x_m && p.y_m == eye.y_m) return false;
  const SectorRange sectors = sectors_towards(layout, eye.x_m - p.x_m, eye.y_m - p.y_m);
  for (std::int32_t i = 0; i < sectors.count; ++i) {
    const std::int32_t sector = (sectors.first + i) % layout.count;
    const VertexIndex horizon = scene.horizon.at(v, sector);
    if (horizon == kNone ||
        !exactly_hidden(p, scene.tin.vertices[horizon], sector_axis(layout, sector), eye))
      return false;
  }
  return true;
}

bool in_view(const std::optional<ViewRange>& view, const Position& eye, const Position& p) {
  if (!view) return true;
  double ahead_rad =
      std::fmod(std::atan2(p.y_m - eye.y_m, p.x_m - eye.x_m) - view->from_rad, 2 * kPi);
  if (ahead_rad < 0) ahead_rad += 2 * kPi;
  double width_rad = view->to_rad - view->from_rad;
  if (width_rad < 0) width_rad += 2 * kPi;
  return ahead_rad <= width_rad;
}

std::vector<Camera> random_cameras(std::uint64_t seed, int count, double size_m) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-0.5 * size_m, 1.5 * size_m), height(-80, 200),
      azimuth(-kPi, kPi), width(0.05, 4);
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    Camera camera{round_to_lattice({place(random), place(random), height(random)}), {}};
    const double from_rad = azimuth(random);
    if (i % 2 == 1) camera.view = ViewRange{from_rad, from_rad + width(random)};
    cameras.push_back(camera);
  }
  return cameras;
}

TEST(VisibleGroups, CullNothingThatAVertexOfTheViewDoesNotAgreeTo) {
  for (const Scene* scene : {&rolling(), &ridges()}) {
    std::size_t culled_vertices = 0;
    for (const Camera& camera : random_cameras(11, 60, 400)) {
      const auto culled = culled_triangles(scene->groups, visible_groups(scene->groups, camera));
      std::vector<bool> checked(scene->tin.vertices.size(), false);
      for (TriangleIndex t = 0; t < scene->tin.triangles.size(); ++t)
        for (const VertexIndex v : scene->tin.triangles[t]) {
          if (!culled[t] || checked[v]) continue;
          checked[v] = true;
          if (!in_view(camera.view, camera.eye, scene->tin.vertices[v])) continue;
          ++culled_vertices;
          ASSERT_TRUE(vertex_is_hidden(*scene, v, camera.eye)) << v;
        }
    }
    EXPECT_GT(culled_vertices, 2000U);
  }
}

TEST(VisibleGroups, AValleyBehindARidgeIsHiddenBeyondItAndSeenFromAbove) {
  // The west half of the west valley, away from its open ends.
  const std::vector<GroupIndex> valley = leaves_within(ridges(), 0, 110, 200, 400);
  ASSERT_FALSE(valley.empty());
  const CullingAnswer beyond = visible_groups(ridges().groups, {{1000, 300, 20}, {}});
  const CullingAnswer above = visible_groups(ridges().groups, {{1000, 300, 2000}, {}});
  const CullingAnswer inside = visible_groups(ridges().groups, {{5, 300, 20}, {}});
  for (const GroupIndex leaf : valley) {
    EXPECT_FALSE(is_visible(beyond, leaf));
    EXPECT_TRUE(is_visible(above, leaf));
    EXPECT_TRUE(is_visible(inside, leaf));
  }
}

/// A tree whose inner nodes are taken away: all leaves are top-level.
Groups flattened(Groups groups) {
  groups.nodes.resize(groups.leaf_count);
  for (GroupNode& node : groups.nodes) node.parent = kNone;
  return groups;
}

TEST(VisibleGroups, TheTreeNeverShowsMoreThanTheLeavesAlone) {
  const Groups flat = flattened(rolling().groups);
  std::uint64_t tree_tests = 0, flat_tests = 0;
  for (const Camera& camera : random_cameras(12, 200, 400)) {
    const CullingAnswer tree = visible_groups(rolling().groups, camera);
    const CullingAnswer leaves = visible_groups(flat, camera);
    EXPECT_TRUE(std::includes(leaves.visible_groups.begin(), leaves.visible_groups.end(),
                              tree.visible_groups.begin(), tree.visible_groups.end()));
    EXPECT_EQ(leaves.nodes_tested, flat.leaf_count);
    tree_tests += tree.nodes_tested;
    flat_tests += leaves.nodes_tested;
  }
  EXPECT_GT(tree_tests, 0U);
  EXPECT_LT(tree_tests, 2 * flat_tests);
}

TEST(VisibleGroups, AViewShowsWhatIsSeenAllAroundWithinItsWedge) {
  const Groups flat = flattened(rolling().groups);
  for (Camera camera : random_cameras(13, 100, 400)) {
    if (!camera.view) continue;
    const CullingAnswer seen = visible_groups(flat, camera);
    const ViewRange view = *std::exchange(camera.view, std::nullopt);
    const CullingAnswer around = visible_groups(flat, camera);
    EXPECT_TRUE(std::includes(around.visible_groups.begin(), around.visible_groups.end(),
                              seen.visible_groups.begin(), seen.visible_groups.end()));
    for (GroupIndex leaf = 0; leaf < flat.leaf_count; ++leaf) {
      // Sampled rim of the circle: all in view, or none and the eye outside.
      const GroupNode& node = flat.nodes[leaf];
      int rim_in_view = 0;
      for (int i = 0; i < 64; ++i) {
        const double a_rad = 2 * kPi * i / 64;
        rim_in_view += in_view(view, camera.eye,
                               {node.centre_x_m + node.radius_m * std::cos(a_rad),
                                node.centre_y_m + node.radius_m * std::sin(a_rad), 0});
      }
      const bool centre_in_view = in_view(view, camera.eye, {node.centre_x_m, node.centre_y_m, 0});
      if (rim_in_view == 64 && view.to_rad - view.from_rad < 3) {
        EXPECT_EQ(is_visible(seen, leaf), is_visible(around, leaf));
      }
      if (rim_in_view > 0 || centre_in_view) continue;
      const double away_m =
          std::hypot(node.centre_x_m - camera.eye.x_m, node.centre_y_m - camera.eye.y_m);
      // The samples leave gaps of a tenth of the radius.
      const double from_rad =
          std::atan2(node.centre_y_m - camera.eye.y_m, node.centre_x_m - camera.eye.x_m);
      if (away_m < 2 * node.radius_m) continue;
      const double margin_rad = 1.2 * std::asin(node.radius_m / away_m);
      if (arcs_overlap({from_rad - margin_rad, from_rad + margin_rad},
                       {view.from_rad, view.to_rad}))
        continue;
      EXPECT_FALSE(is_visible(seen, leaf));
    }
  }
}

TEST(VisibleGroups, OnlySectorsOppositeToTheViewMatter) {
  // One node of a triangle at the origin; its region hides everything low in the east only.
  Groups groups;
  groups.group_of_triangle = {0};
  groups.leaf_count = 1;
  groups.nodes.resize(1);
  groups.nodes[0].triangles = 1;
  groups.nodes[0].radius_m = 40;
  groups.regions.layout = {16, 1};
  groups.regions.first = {0};
  for (int sector = 0; sector < 16; ++sector) {
    if (sector == 0 || sector == 15) groups.regions.points.push_back({50, 1000});
    groups.regions.first.push_back(static_cast<std::uint32_t>(groups.regions.points.size()));
    groups.regions.end_slope.push_back(0);
  }
  // From (80, 0) the circle reaches 30 degrees to both sides: four sectors, two of which hide.
  const Position eye{80, 0, 10};
  EXPECT_TRUE(is_visible(visible_groups(groups, {eye, {}}), 0));
  EXPECT_FALSE(is_visible(visible_groups(groups, {eye, ViewRange{kPi - 0.3, kPi + 0.3}}), 0));
  EXPECT_FALSE(is_visible(visible_groups(groups, {eye, ViewRange{kPi - 0.3, -kPi + 0.3}}), 0));
  EXPECT_TRUE(is_visible(visible_groups(groups, {eye, ViewRange{kPi - 0.5, kPi + 0.3}}), 0));
  // Looking away it is out of view, whatever the regions say.
  EXPECT_FALSE(is_visible(visible_groups(groups, {eye, ViewRange{-1, 1}}), 0));
  // On a border between a sector that hides and one that does not, both count.
  groups.nodes[0].radius_m = 0;
  EXPECT_FALSE(is_visible(visible_groups(groups, {{100, 0, 10}, {}}), 0));
  const Position north_east{100 * std::cos(kPi / 8), 100 * std::sin(kPi / 8), 10};
  EXPECT_TRUE(is_visible(visible_groups(groups, {north_east, {}}), 0));
}

TEST(VisibleGroups, EyesInOddPlaces) {
  const Scene& scene = rolling();
  // On a vertex: its own groups are never hidden.
  for (const VertexIndex v : {0U, 41U, 820U, 1599U}) {
    const CullingAnswer answer = visible_groups(scene.groups, {scene.tin.vertices[v], {}});
    for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t) {
      const auto& corners = scene.tin.triangles[t];
      const GroupIndex group = scene.groups.group_of_triangle[t];
      const bool touches = std::find(corners.begin(), corners.end(), v) != corners.end();
      EXPECT_TRUE(group == kNone || !touches || is_visible(answer, group));
    }
  }
  // Far away and low: much is hidden. Far up: nothing is.
  const CullingAnswer low = visible_groups(scene.groups, {{1e6, 200, -50}, {}});
  EXPECT_LT(low.visible_groups.size(), scene.groups.leaf_count);
  const CullingAnswer high = visible_groups(scene.groups, {{200, 200, 1e6}, {}});
  EXPECT_EQ(high.visible_groups.size(), scene.groups.leaf_count);
}

TEST(VisibleGroups, OfNoGroupsAreNone) {
  const Groups none;
  EXPECT_TRUE(visible_groups(none, {{0, 0, 0}, {}}).visible_groups.empty());
  Groups orphans;
  orphans.group_of_triangle = {kNone, kNone};
  EXPECT_EQ(culled_triangles(orphans, {}), (std::vector<std::uint8_t>{0, 0}));
}

TEST(ThesisCulling, AnswersAsTheFunction) {
  ThesisCulling method(rolling().groups);
  EXPECT_EQ(method.name(), "thesis");
  const Camera camera{{500, 200, 0}, ViewRange{2, 4}};
  EXPECT_EQ(method.visible(camera).visible_groups,
            visible_groups(rolling().groups, camera).visible_groups);
}

}  // namespace
}  // namespace scarp
