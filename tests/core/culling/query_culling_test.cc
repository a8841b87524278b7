#include "core/culling/query_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/grouped_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// A ridge across the view with ground before and behind it.
test::GroupedGround ridge() {
  return test::grouped_by_squares(
      test::triangulated(test::grid_of(48, 48, 10,
                                       [](std::int32_t, std::int32_t row) {
                                         return 100 * std::exp(-std::pow((row - 24) / 3.0, 2));
                                       }),
                         1),
      64);
}

Camera camera_at(double x_m, double y_m) {
  Shot shot;
  shot.width_px = 320;
  shot.height_px = 180;
  shot.view.eye = {x_m, y_m, 20};
  shot.view.target = {x_m, y_m + 100, 20};  // north, at the ridge
  return camera_of(shot);
}

class Queries : public testing::Test {
 protected:
  /// Groups wholly behind the ridge, by their boxes.
  std::set<GroupIndex> behind() const {
    std::set<GroupIndex> found;
    for (GroupIndex g = 0; g < batches_.groups(); ++g)
      if (batches_.box(g).low.y_m > 310) found.insert(g);
    return found;
  }
  std::set<GroupIndex> before() const {
    std::set<GroupIndex> found;
    for (GroupIndex g = 0; g < batches_.groups(); ++g)
      if (batches_.box(g).high.y_m < 200 && batches_.box(g).low.y_m > 60 &&
          std::abs(batches_.box(g).low.x_m - 200) < 30)
        found.insert(g);
    return found;
  }

  test::GroupedGround scene_ = ridge();
  GroupBatches batches_{scene_.tin, scene_.groups};
  CoarseBatches coarse_{batches_, {0.5, 0.2}};
};

TEST_F(Queries, CoarseLevelsHaveFewerTrianglesOfTheSameGroup) {
  for (GroupIndex g = 0; g < batches_.groups(); ++g) {
    std::size_t before = batches_.triangles(g).size();
    for (std::size_t level = 0; level < 2; ++level) {
      GroupBatches::Drawing drawing;
      coarse_.add_to(level, g, drawing);
      EXPECT_LE(drawing.triangles.size(), before);
      before = drawing.triangles.size();
      for (const std::uint32_t object : drawing.objects) EXPECT_EQ(object, g);
      for (const Position& p : drawing.vertices) {
        EXPECT_GE(p.x_m, batches_.box(g).low.x_m);
        EXPECT_LE(p.x_m, batches_.box(g).high.x_m);
      }
    }
    EXPECT_LT(before, batches_.triangles(g).size());
  }
}

TEST_F(Queries, LeavesOutWhatIsBehindTheRidgeAndKeepsWhatIsBeforeIt) {
  QueryCulling query(batches_, coarse_, QueryUse::kSameFrame);
  StopAndWaitCulling wait(batches_);
  for (CullingMethod* method :
       {static_cast<CullingMethod*>(&query), static_cast<CullingMethod*>(&wait)}) {
    const auto answer = method->visible(camera_at(240, 40)).visible_groups;
    const std::set<GroupIndex> seen(answer.begin(), answer.end());
    // Coarse groups gape, so that some of what is behind shows through.
    const std::size_t shown = static_cast<std::size_t>(
        std::count_if(seen.begin(), seen.end(), [&](GroupIndex g) { return behind().count(g); }));
    EXPECT_LE(shown, method == &wait ? 0 : behind().size() / 2) << method->name();
    for (const GroupIndex g : before()) EXPECT_EQ(seen.count(g), 1U) << method->name() << g;
  }
}

TEST_F(Queries, MultiFrameTakesTheAnswersOfTheFrameBefore) {
  QueryCulling now(batches_, coarse_, QueryUse::kSameFrame);
  QueryCulling later(batches_, coarse_, QueryUse::kNextFrame);
  const Camera first = camera_at(240, 40), second = camera_at(240, 60);
  const auto of_first = now.visible(first).visible_groups;
  const auto unasked = later.visible(first).visible_groups;
  EXPECT_GT(unasked.size(), of_first.size()) << "nothing is known before the first frame";
  std::vector<GroupIndex> in_both;
  const auto after = later.visible(second).visible_groups;
  std::set_intersection(after.begin(), after.end(), of_first.begin(), of_first.end(),
                        std::back_inserter(in_both));
  EXPECT_EQ(in_both.size(), after.size()) << "what was hidden in the first frame stays left out";
  EXPECT_FALSE(after.empty());
}

TEST_F(Queries, AHigherThresholdLeavesOutMore) {
  QueryOptions strict;
  strict.threshold_px = 300;
  QueryCulling loose(batches_, coarse_, QueryUse::kSameFrame);
  QueryCulling tight(batches_, coarse_, QueryUse::kSameFrame, strict);
  EXPECT_LT(tight.visible(camera_at(240, 40)).visible_groups.size(),
            loose.visible(camera_at(240, 40)).visible_groups.size());
}

}  // namespace
}  // namespace scarp
