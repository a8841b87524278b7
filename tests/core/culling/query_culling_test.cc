#include "core/culling/query_culling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
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

  std::optional<GroupIndex> nearest_to(double y_m) const {
    std::optional<GroupIndex> found;
    double least = HUGE_VAL;
    for (GroupIndex g = 0; g < batches_.groups(); ++g) {
      const double off =
          std::abs(batches_.box(g).low.y_m - y_m) + std::abs(batches_.box(g).low.x_m - 220);
      if (off < least) least = off, found = g;
    }
    return found;
  }
  std::optional<GroupIndex> before_eye() const { return nearest_to(60); }
  std::optional<GroupIndex> far_away() const { return nearest_to(420); }

  test::GroupedGround scene_ = ridge();
  GroupBatches batches_{scene_.tin, scene_.groups};
  CoarseBatches coarse_{batches_, {std::begin(kQueryShares), std::end(kQueryShares)}};
};

TEST_F(Queries, CoarseLevelsHaveFewerTrianglesOfTheSameGroup) {
  for (GroupIndex g = 0; g < batches_.groups(); ++g) {
    const std::size_t whole = batches_.triangles(g).size();
    std::size_t least = whole;
    for (std::size_t level = 0; level < coarse_.levels(); ++level) {
      GroupBatches::Drawing drawing;
      coarse_.add_to(level, g, drawing);
      EXPECT_LE(drawing.triangles.size(), whole);
      EXPECT_EQ(drawing.triangles.size(), coarse_.triangles(level, g));
      least = drawing.triangles.size();
      for (const std::uint32_t object : drawing.objects) EXPECT_EQ(object, g);
      for (const Position& p : drawing.vertices) {
        EXPECT_GE(p.x_m, batches_.box(g).low.x_m);
        EXPECT_LE(p.x_m, batches_.box(g).high.x_m);
      }
    }
    EXPECT_LT(least, whole / 4);
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

TEST_F(Queries, LevelsStayWithinTheBudgetAndTheNearestAreFinest) {
  std::vector<GroupIndex> all;
  for (GroupIndex g = 0; g < batches_.groups(); ++g) all.push_back(g);
  const Position eye{240, 40, 20};
  const auto triangles = [&](const std::vector<std::uint8_t>& levels) {
    std::uint64_t sum = 0;
    for (const GroupIndex g : all)
      sum += levels[g] == 0 ? batches_.triangles(g).size() : coarse_.triangles(levels[g] - 1U, g);
    return sum;
  };
  const auto finest = levels_within(batches_, coarse_, eye, all, 3, 1'000'000'000);
  EXPECT_EQ(std::count(finest.begin(), finest.end(), 0), static_cast<std::ptrdiff_t>(all.size()));
  std::uint64_t before = 0;
  for (const std::uint64_t budget : {1500, 2000, 3000, 4000}) {
    const auto levels = levels_within(batches_, coarse_, eye, all, 3, budget);
    const std::uint64_t used = triangles(levels);
    EXPECT_LE(used, budget);
    EXPECT_GT(used, before);
    EXPECT_GT(used, budget * 9 / 10) << "and it is used";
    before = used;
    // A group beside the eye is never coarser than one far away of the same size.
    EXPECT_LE(levels[*before_eye()], levels[*far_away()]);
  }
}

TEST_F(Queries, MultiFrameFindsAgainWhatComesIntoSight) {
  QueryCulling later(batches_, coarse_, QueryUse::kNextFrame);
  later.visible(camera_at(240, 40));
  later.visible(camera_at(240, 40));
  // Over the ridge at once: boxes behind it were hidden, are asked now, and drawn at the next
  // frame.
  later.visible(camera_at(240, 300));
  const auto after = later.visible(camera_at(240, 300)).visible_groups;
  QueryCulling now(batches_, coarse_, QueryUse::kSameFrame);
  for (const GroupIndex g : now.visible(camera_at(240, 300)).visible_groups)
    EXPECT_TRUE(std::binary_search(after.begin(), after.end(), g)) << "boxes show no less";
}

TEST_F(Queries, MovingBoxesAreAskedAgainstWhatTheGroupsLeft) {
  QueryCulling query(batches_, coarse_, QueryUse::kSameFrame);
  StopAndWaitCulling wait(batches_);
  for (CullingMethod* method :
       {static_cast<CullingMethod*>(&query), static_cast<CullingMethod*>(&wait)}) {
    Camera camera = camera_at(240, 40);
    camera.shot->view.vertical_field_of_view_rad = 1.2;  // over the ridge, too
    method->visible(camera);
    EXPECT_TRUE(method->may_show({{238, 100, 2}, {242, 105, 4}})) << method->name();
    EXPECT_FALSE(method->may_show({{238, 400, 2}, {242, 405, 4}})) << "behind the ridge";
    EXPECT_TRUE(method->may_show({{238, 400, 200}, {242, 405, 204}})) << "in the air behind it";
    EXPECT_FALSE(method->may_show({{238, -100, 2}, {242, -90, 4}})) << "behind the eye";
  }
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
