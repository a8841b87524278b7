#include "tests/support/adversarial_check.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "core/sight/triangle_sight.h"
#include "tests/support/terrain.h"

namespace scarp::test {
namespace {

struct Scene {
  Tin tin;
  LeafGroups groups;
  CertifiedRegions regions;
};

Scene hills() {
  Scene scene{triangulated(random_hills(16, 16, 10, 8, 120, 0.01)), {}, {}};
  scene.groups = group_by_squares(scene.tin, 8);
  HidingOptions options;
  options.fans = options.sectors = 16;
  scene.regions =
      certify_groups(scene.tin, scene.groups.group_of_triangle, scene.groups.count, options);
  return scene;
}

TEST(AdversarialCheck, FindsNothingWrongWithWhatIsRight) {
  const Scene scene = hills();
  const AdversarialReport report =
      adversarial_check(scene.tin, scene.groups.group_of_triangle, scene.regions, 1, 100);
  EXPECT_EQ(report.false_culls, 0U);
  EXPECT_GT(report.cameras, 500U);
  ASSERT_TRUE(report.worst);
  EXPECT_GT(report.worst->margin, 0);
  EXPECT_LT(report.worst->margin, 0.1);
  EXPECT_TRUE(hides_group(scene.regions, report.worst->group, report.worst->eye));
}

TEST(AdversarialCheck, FindsAnErrorInOneGroupAndTellsHowLargeItIs) {
  Scene scene = hills();
  const TinIndex index(scene.tin);
  // One group claims to be hidden from cameras up to 40 m higher than it was.
  const GroupIndex wrong = scene.groups.count / 2;
  scene.regions.groups[wrong].height_m += 40;
  const AdversarialReport report =
      adversarial_check(scene.tin, scene.groups.group_of_triangle, scene.regions, 1, 400);
  EXPECT_GT(report.false_culls, 0U);
  ASSERT_TRUE(report.worst);
  EXPECT_EQ(report.worst->group, wrong);
  EXPECT_LT(report.worst->margin, 0);
  bool seen = false;
  for (TriangleIndex t = 0; t < scene.tin.triangles.size(); ++t)
    if (scene.groups.group_of_triangle[t] == wrong)
      seen |= judge_triangle(index, report.worst->eye, t) == TriangleSight::kVisible;
  EXPECT_TRUE(seen);
  EXPECT_TRUE(hides_group(scene.regions, wrong, report.worst->eye));
}

TEST(AdversarialCheck, NothingToSearchIsFine) {
  const Scene scene = hills();
  const std::vector<GroupIndex> none(scene.tin.triangles.size(), kNone);
  EXPECT_EQ(adversarial_check(scene.tin, none, {}, 1, 10).cameras, 0U);
  const TinIndex index(scene.tin);
  const auto never = [](GroupIndex, const Position&) { return false; };
  const AdversarialReport report =
      adversarial_check(index, scene.groups.group_of_triangle, scene.groups.count, never, 1, 10);
  EXPECT_EQ(report.cameras, 0U);
  EXPECT_FALSE(report.worst);
}

}  // namespace
}  // namespace scarp::test
