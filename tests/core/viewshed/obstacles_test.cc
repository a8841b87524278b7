#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/sight/line_of_sight.h"
#include "core/viewshed/tin_viewshed.h"
#include "core/viewshed/viewshed.h"
#include "tests/core/viewshed/random_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

using test::GroundRecipe;
using test::Relief;

/// Trees and pits over some samples of a ground; void where that is void.
GroundGrid grown_over(const GroundGrid& ground, std::uint32_t seed) {
  GroundGrid obstacles(ground.columns(), ground.rows(), ground.placement());
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::int32_t r = 0; r < ground.rows(); ++r) {
    for (std::int32_t c = 0; c < ground.columns(); ++c) {
      if (!ground.is_known(c, r)) continue;
      const double kind = unit(random);
      const double more_m = kind < 0.2 ? 25 * unit(random) : kind < 0.25 ? -10 : 0;
      obstacles.set_z(c, r, ground.at(c, r).z_m + more_m);
    }
  }
  return obstacles;
}

struct Scene {
  GroundGrid ground, obstacles;
  std::vector<Position> eyes;
};

Scene scene_of(Relief relief, double bend, double void_share) {
  const auto seed = static_cast<std::uint32_t>(relief) + 3;
  GroundGrid ground = test::random_ground({relief, 50, 43, bend, void_share, seed});
  GroundGrid obstacles = grown_over(ground, seed);
  Scene scene{std::move(ground), std::move(obstacles), {}};
  for (const auto& [column, row, height_m] :
       {std::tuple(20, 17, 30.0), std::tuple(33, 9, 2.0), std::tuple(1, 40, 400.0)}) {
    Position eye = scene.obstacles.at(column, row);
    eye.z_m += height_m;
    scene.eyes.push_back(eye);
    eye.x_m += 11;
    eye.y_m -= 7;
    scene.eyes.push_back(round_to_lattice(eye));
  }
  return scene;
}

template <typename Body>
void for_scenes(const Body& body) {
  for (int relief = 0; relief < static_cast<int>(Relief::kCount); ++relief)
    for (const double bend : {0.0, 1.5})
      for (const double void_share : {0.0, 0.06}) {
        SCOPED_TRACE(testing::Message()
                     << "relief " << relief << " bend " << bend << " void " << void_share);
        body(scene_of(static_cast<Relief>(relief), bend, void_share));
      }
}

TEST(Obstacles, BlockWhatTheJudgeSaysTheyBlock) {
  for_scenes([](const Scene& scene) {
    const GroundGrid& ground = scene.ground;
    std::vector<Seen> seen(static_cast<std::size_t>(ground.columns() * ground.rows()));
    for (const Position& eye : scene.eyes) {
      const GridSight judge(scene.obstacles, eye);
      for (const double target_m : {0.0, 4.0}) {
        view_from(ViewGround::under(ground, scene.obstacles), {}, {eye, target_m, {}}, seen);
        for (std::int32_t r = 0; r < ground.rows(); ++r)
          for (std::int32_t c = 0; c < ground.columns(); ++c)
            ASSERT_EQ(seen[static_cast<std::size_t>(r * ground.columns() + c)],
                      ground.is_known(c, r) ? judge.judge(ground.raised(c, r, target_m), c, r)
                                            : Seen::kUnknown)
                << "column " << c << " row " << r << " target " << target_m;
      }
    }
  });
}

TEST(Obstacles, LeastHeightsClearThem) {
  for_scenes([](const Scene& scene) {
    const GroundGrid& ground = scene.ground;
    const ViewGround view = ViewGround::under(ground, scene.obstacles);
    std::vector<float> least_m(static_cast<std::size_t>(ground.columns() * ground.rows()));
    LeastHeight together(ground), apart(ground);
    for (const Position& eye : scene.eyes) {
      const GridSight judge(scene.obstacles, eye);
      together.lower(view, {}, {eye, 0, {}});
      apart.add(heights_from(view, {}, {eye, 0, {}}, least_m), least_m);
      for (std::int32_t r = 0; r < ground.rows(); ++r) {
        for (std::int32_t c = 0; c < ground.columns(); ++c) {
          if (!ground.is_known(c, r)) continue;
          const float h = least_m[static_cast<std::size_t>(r * ground.columns() + c)];
          const auto sight_at = [&](double height_m) {
            return judge.judge(ground.raised(c, r, height_m), c, r);
          };
          SCOPED_TRACE(testing::Message() << "column " << c << " row " << r << " height " << h);
          ASSERT_EQ(h == 0, sight_at(0) == Seen::kVisible);
          if (std::isnan(h)) {
            ASSERT_NE(sight_at(1e6), Seen::kVisible);
            continue;
          }
          ASSERT_EQ(sight_at(h), Seen::kVisible);
          const double step_m = 0.002 + h * 1e-6;
          if (h > step_m) {
            ASSERT_EQ(sight_at(h - step_m), Seen::kHidden);
          }
        }
      }
    }
    for (std::size_t i = 0; i < least_m.size(); ++i) {
      const float a = together.heights_m()[i], b = apart.heights_m()[i];
      ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << a << ' ' << b;
    }
  });
}

TEST(TinViewshed, EqualsItsJudgeAtEverySample) {
  const SampleGrid samples = test::random_hills(40, 34, 30, 5, 12, 1 / 256.0, 0.04);
  const Tin tin = test::triangulated(samples, 7);
  const TinIndex index(tin);
  GroundGrid grid(samples);
  stand_on(index, grid);
  std::vector<Seen> seen(samples.positions.size());
  std::vector<float> least_m(samples.positions.size());
  int hidden = 0, raised = 0;
  for (const std::int32_t column : {3, 12, 20, 35}) {
    Position eye = grid.at(column, 10);
    eye.z_m += 2;
    const ViewGround view = ViewGround::of_tin(grid, index);
    for (const double target_m : {0.0, 3.0}) {
      view_from(view, {}, {eye, target_m, {}}, seen);
      for (std::int32_t r = 0; r < grid.rows(); ++r) {
        for (std::int32_t c = 0; c < grid.columns(); ++c) {
          const Seen at = seen[samples.index(c, r)];
          if (!grid.is_known(c, r)) {
            EXPECT_EQ(at, Seen::kUnknown);
            continue;
          }
          const Position target = grid.raised(c, r, target_m);
          EXPECT_GE(index.above_ground(target).value_or(-1), 0);
          const Sight sight = line_of_sight(index, eye, target);
          EXPECT_EQ(at == Seen::kVisible, sight == Sight::kVisible);
          EXPECT_EQ(at == Seen::kHidden, sight == Sight::kHidden);
          hidden += at == Seen::kHidden;
        }
      }
    }
    view_from(view, {}, {eye, 0, {}}, seen);
    heights_from(view, {}, {eye, 0, {}}, least_m);
    for (std::int32_t r = 0; r < grid.rows(); ++r) {
      for (std::int32_t c = 0; c < grid.columns(); ++c) {
        const float h = least_m[samples.index(c, r)];
        EXPECT_EQ(h == 0, seen[samples.index(c, r)] == Seen::kVisible);
        if (!(h > 0)) continue;
        ++raised;
        EXPECT_EQ(line_of_sight(index, eye, grid.raised(c, r, h)), Sight::kVisible);
        if (h > 0.002) {
          EXPECT_EQ(line_of_sight(index, eye, grid.raised(c, r, h - 0.002)), Sight::kHidden);
        }
      }
    }
  }
  EXPECT_GT(hidden, 100);
  EXPECT_GT(raised, 100);
}

}  // namespace
}  // namespace scarp
