#include "core/occlusion/virtual_occluders.h"

#include <gtest/gtest.h>

#include <random>

#include "core/culling/group_batches.h"
#include "core/sight/triangle_sight.h"
#include "core/terrain/edge_collapse.h"
#include "tests/support/grouped_ground.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

/// Hills with blocks of buildings on them, up to 60 m high: walls are a cell wide.
Tin town(std::uint64_t seed) {
  SampleGrid grid = test::random_hills(41, 41, 10, seed, 40, 0.01, 0);
  std::mt19937_64 random(seed);
  for (int i = 0; i < 12; ++i) {
    const auto column = static_cast<std::int32_t>(2 + random() % 34);
    const auto row = static_cast<std::int32_t>(2 + random() % 34);
    const double roof_m =
        grid.positions[grid.index(column, row)].z_m + 20 + static_cast<double>(random() % 40);
    for (std::int32_t r = row; r < row + 4; ++r)
      for (std::int32_t c = column; c < column + 4; ++c)
        grid.positions[grid.index(c, r)].z_m = roof_m;
  }
  return test::triangulated(grid, seed);
}

Tin ground(std::uint64_t seed) {
  if (seed % 3 == 0) return town(seed);
  return test::triangulated(
      test::random_hills(41, 37, 10, seed, 150, seed % 2 == 0 ? 10 : 0.01, seed % 4 == 1 ? 0.1 : 0),
      seed);
}

TEST(VirtualOccluders, LieNowhereAboveTheGroundAndAreFew) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Tin tin = ground(seed);
    const Occluder mesh = simplified_under(tin, {});
    ASSERT_EQ(check_tin(mesh.tin), std::nullopt);
    ASSERT_EQ(check_under(mesh.tin, tin), std::nullopt) << "seed " << seed;
    EXPECT_LT(mesh.tin.triangles.size(), tin.triangles.size() / 2);
    EXPECT_GT(mesh.tin.triangles.size(), 10U);
    // Lowering is what makes it true.
    VirtualOccluderOptions options;
    CollapseOptions collapses;
    collapses.triangles_left = tin.triangles.size() / 10;
    const Tin both_sides = simplified(tin, collapse_edges(tin, collapses));
    EXPECT_TRUE(check_under(both_sides, tin).has_value());
  }
}

TEST(VirtualOccluders, SectionsAreUnderGroundAndHideNothingThatIsSeen) {
  std::uint64_t hidden = 0, sections = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const test::GroupedGround scene = test::grouped_by_squares(ground(seed), 24);
    const TinIndex index(scene.tin);
    const GroupBatches batches(scene.tin, scene.groups);
    const VirtualOccluders occluders = find_virtual_occluders(scene.tin, {});
    sections += occluders.sections.size();
    for (const UprightOccluder& section : occluders.sections)
      ASSERT_TRUE(is_under_ground(index, section.top()));
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
    for (int i = 0; i < 12; ++i) {
      Position eye = scene.tin.vertices[random() % scene.tin.vertices.size()];
      eye.z_m += 2;
      Bounds cell{eye, eye};
      cell.high.x_m += round_to_lattice(10 * unit());
      cell.high.y_m += round_to_lattice(10 * unit());
      cell.high.z_m += round_to_lattice(5 * unit());
      for (GroupIndex g = 0; g < batches.groups(); ++g) {
        bool is_hidden = false;
        for (const UprightOccluder& section : occluders.sections)
          is_hidden |= section.judge(cell, batches.box(g)) == FullOcclusion::kHidden;
        if (!is_hidden) continue;
        ++hidden;
        for (const Position& corner : {cell.low, cell.high})
          for (const TriangleSight sight : judge_each(index, corner, batches.triangles(g)))
            ASSERT_EQ(sight, TriangleSight::kHidden) << "seed " << seed << ", group " << g;
      }
    }
  }
  EXPECT_GT(sections, 200U);
  EXPECT_GT(hidden, 300U);
}

TEST(VirtualOccluders, ALineOverTheGroundOrOverVoidIsNotUnderIt) {
  SampleGrid grid = test::grid_of(9, 9, 10, [](int c, int) { return c == 4 ? 20.0 : 10.0; });
  const Tin whole = test::triangulated(grid);
  const TinIndex index(whole);
  EXPECT_TRUE(is_under_ground(index, {{10, 35, 9}, {70, 35, 9}}));
  EXPECT_FALSE(is_under_ground(index, {{10, 35, 9}, {70, 35, 10}}));
  EXPECT_TRUE(is_under_ground(index, {{30, 35, 9}, {40, 35, 19}, {50, 35, 9}}));
  EXPECT_FALSE(is_under_ground(index, {{10, 35, 9}, {40, 35, 19}, {70, 35, 9}}));
  EXPECT_FALSE(is_under_ground(index, {{10, 35, 9}, {90, 35, 9}})) << "ends outside";
  grid.known[grid.index(4, 4)] = 0;
  const Tin holed = test::triangulated(grid);
  EXPECT_FALSE(is_under_ground(TinIndex(holed), {{10, 35, 9}, {70, 35, 9}}));
}

}  // namespace
}  // namespace scarp
