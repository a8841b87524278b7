#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"
#include "tests/stability/compare_methods.h"
#include "tests/stability/stability_scenes.h"

namespace scarp::test {
namespace {

const std::vector<StabilityScene>& scenes() {
  static const std::vector<StabilityScene> all = stability_scenes();
  return all;
}

const StabilityScene& scene_named(const std::string& name) {
  for (const StabilityScene& scene : scenes())
    if (scene.name == name) return scene;
  throw std::runtime_error("no scene " + name);
}

/// Coarse, so that it is quick; docs/stability.md is made with the usual settings.
ComparisonOptions quick() {
  ComparisonOptions options;
  options.hiding.fans = 16;
  options.hiding.sectors = 16;
  options.scattered_eyes = 10;
  options.searches = 40;
  options.thesis_searches = 0;
  return options;
}

TEST(DrawnScenes, TheJudgeSeesWhatIsDrawn) {
  std::size_t drawn = 0;
  for (const DrawnScene& scene : drawn_scenes()) {
    if (scene.tin.triangles.empty()) continue;
    ASSERT_EQ(check_tin(scene.tin), std::nullopt) << scene.name;
    const TinIndex index(scene.tin);
    for (const DrawnSight& expected : scene.sights) {
      ++drawn;
      for (const NamedEye& eye : scene.eyes) {
        if (eye.name != expected.eye) continue;
        EXPECT_EQ(draw_sight(scene.grid, judge_all(index, eye.position)), expected.rows)
            << scene.name << ", eye " << eye.name;
      }
    }
  }
  EXPECT_GE(drawn, 25U);
}

TEST(DrawnScenes, ReaderNamesWhatIsWrong) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      read_drawn_scene("x", "shows a\nfails b\n" + text);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(complaint("terrain\n0 1\n2 ?\n"), "none");
  EXPECT_EQ(complaint("terrain\n0 1\n2\n"), "scene x, line 5: a row of 1 samples under one of 2");
  EXPECT_EQ(complaint("terrain\n0 x\n"), "scene x, line 4: 'x' is no number");
  EXPECT_EQ(complaint("draw . 0\nterrain\n.#\n"), "scene x, line 5: no height is drawn as #");
  EXPECT_EQ(complaint("terrane\n"),
            "scene x, line 3: 'terrane' is none of shows, fails, cell, groups, draw, terrain, "
            "eye, expect");
  EXPECT_EQ(complaint("terrain\n0 1\n2 3\n\neye a 9 9 +2\n"),
            "scene x, line 7: eye a is not over ground; give its height as =Z");
  EXPECT_EQ(complaint("terrain\n0 1\n2 3\n\nexpect a\nv\n"), "scene x, line 8: there is no eye a");
  EXPECT_EQ(complaint(""), "scene x, line 2: no terrain was drawn");
}

TEST(Stability, EveryLineOfTheCatalogueHasAScene) {
  std::set<std::string> lines;
  for (const StabilityScene& scene : scenes()) {
    lines.insert(scene.fails);
    EXPECT_EQ(check_tin(scene.tin), std::nullopt) << scene.name;
  }
  // Thread counts are tested below.
  for (const char* line :
       {"thin sectors that no vertex falls into, while an edge crosses them",
        "wide sectors with a gap",
        "plateaus and terraces (equal heights, ties)",
        "a one-sample spike and a one-sample pit",
        "walls one sample thick, along rows",
        "walls one sample thick, along columns",
        "walls one sample thick, on diagonals",
        "near-vertical cliffs",
        "collinear points on sector boundaries",
        "azimuth 0 and 360",
        "slivers and needle triangles",
        "duplicate and almost duplicate samples",
        "very unequal cell sizes",
        "map coordinates in the millions (float loses centimetres)",
        "heights below zero",
        "an eye on a vertex, on an edge, in a triangle, below ground, on nodata, outside the data, "
        "a metre above and 1000 km above; target under the eye",
        "holes of nodata",
        "coastlines of nodata",
        "one-cell rasters",
        "one-row rasters",
        "empty rasters",
        "the antimeridian",
        "the poles",
        "a DEM in degrees",
        "a far ridge behind a near hill",
        "grazing sight lines",
        "a patch that contains the camera",
        "refraction 0 and 1",
        "tile borders",
        "tile sizes"})
    EXPECT_TRUE(lines.contains(line)) << line;
}

/// Neither from the scenes' own eyes, nor from scattered ones, nor where a search looks for it.
TEST(Stability, CertifiedIsNeverOnTheUnsafeSide) {
  std::uint64_t culled = 0, searched = 0;
  for (const StabilityScene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    const SceneCounts counts = compare_methods(scene, quick());
    EXPECT_EQ(counts.certified.falsely_culled, 0U);
    EXPECT_EQ(counts.certified.search.false_culls, 0U);
    culled += counts.certified.culled_of_hidden;
    searched += counts.certified.search.cameras;
  }
  // It is no safety to cull nothing.
  EXPECT_GT(culled, 20'000U);
  EXPECT_GT(searched, 5'000U);
}

TEST(Stability, ComparisonSeesWhereTheThesisIsWrong) {
  ComparisonOptions options = quick();
  options.thesis_searches = 4;
  const SceneCounts counts = compare_methods(scene_named("sector_borders"), options);
  EXPECT_GT(counts.thesis.falsely_culled, 0U);
  EXPECT_GT(counts.thesis.search.cameras, 0U);
  EXPECT_GT(counts.thesis.culled_of_hidden, 0U);
}

TEST(Stability, SameBitsForAnyNumberOfThreads) {
  for (const char* name : {"random_voids", "near_pole", "tile_borders"}) {
    SCOPED_TRACE(name);
    const auto answer = [&](int threads) {
      set_thread_count(threads);
      const GroupedScene grouped = group_scene(scene_named(name), quick().hiding);
      const AdversarialReport report = adversarial_check(
          grouped.tin, grouped.groups.group_of_triangle, grouped.groups.certified, 7, 12);
      set_thread_count(0);
      return std::tuple(grouped.groups.certified.steps, grouped.groups.regions.end_slope,
                        report.cameras, report.worst->eye, report.worst->margin);
    };
    const auto one = answer(1);
    EXPECT_TRUE(one == answer(2));
    EXPECT_TRUE(one == answer(5));
  }
}

}  // namespace
}  // namespace scarp::test
