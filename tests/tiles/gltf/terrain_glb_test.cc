#include "tiles/gltf/terrain_glb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/glb_reader.h"
#include "tests/tiles/small_scene.h"
#include "tiles/tileset/tile_ground.h"

namespace scarp {
namespace {

/// Ground of a grid, its frame at a place on the globe, in three groups and some of none.
struct PlacedGround {
  Tin tin;
  std::vector<EcefPoint> ecef;
  TilesetFrame frame;
  Groups groups;
};

PlacedGround ground(std::uint32_t side) {
  const EcefPoint centre{4'300'000, 600'000, 4'650'000};
  PlacedGround placed{test::grid_tin(side, side),
                      {},
                      TilesetFrame(centre, {centre.x_m, centre.y_m + 1000, centre.z_m}),
                      {}};
  for (const Position& p : placed.tin.vertices)
    placed.ecef.push_back(placed.frame.to_ecef({p.x_m, p.y_m, p.z_m}));
  for (std::uint32_t t = 0; t < placed.tin.triangles.size(); ++t)
    placed.groups.group_of_triangle.push_back(t % 9 == 8 ? kNone : (t / 5) % 3);
  placed.groups.leaf_count = 3;
  return placed;
}

test::ReadGlb written(const PlacedGround& placed, GlbCompression compression) {
  const TerrainMesh mesh =
      tile_ground(placed.tin, placed.ecef, placed.frame, &placed.groups, 100, kFinestStepM);
  const std::vector<std::byte> bytes = terrain_glb(mesh, compression);
  return test::read_glb({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Each triangle of the surface as its corners' places in steps, by group, order aside.
std::vector<std::array<std::int64_t, 10>> triangles_of(const PlacedGround& placed) {
  std::vector<std::array<std::int64_t, 10>> all;
  for (std::size_t t = 0; t < placed.tin.triangles.size(); ++t) {
    std::array<std::int64_t, 10> steps{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const TilePoint p = placed.frame.from_ecef(placed.ecef[placed.tin.triangles[t][corner]]);
      for (std::size_t i = 0; i < 3; ++i) steps[3 * corner + i] = std::llround(p[i] / kFinestStepM);
    }
    const GroupIndex group = placed.groups.group_of_triangle[t];
    steps[9] = group == kNone ? -1 : 100 + static_cast<std::int64_t>(group);
    all.push_back(steps);
  }
  return all;
}

std::vector<std::array<std::int64_t, 10>> triangles_of(const test::ReadGlb& glb) {
  std::vector<std::array<std::int64_t, 10>> all;
  for (std::size_t t = 0; t < glb.corners.size() / 3; ++t) {
    std::array<std::int64_t, 10> steps{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t v = glb.corners[3 * t + corner];
      for (std::size_t i = 0; i < 3; ++i)
        steps[3 * corner + i] = std::llround(glb.vertex(v)[i] / kFinestStepM);
      const auto feature = static_cast<std::uint32_t>(glb.features[v]);
      const std::int64_t group =
          feature == glb.null_feature ? -1 : static_cast<std::int64_t>(glb.group[feature]);
      EXPECT_TRUE(corner == 0 || group == steps[9]) << "corners of two groups";
      steps[9] = group;
    }
    all.push_back(steps);
  }
  return all;
}

/// Turned so that the least corner comes first, and sorted.
std::vector<std::array<std::int64_t, 10>> in_order(std::vector<std::array<std::int64_t, 10>> all) {
  for (auto& t : all) {
    auto least = t;
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(t.begin(), t.begin() + 3, t.begin() + 9);
      least = std::min(least, t);
    }
    t = least;
  }
  std::sort(all.begin(), all.end());
  return all;
}

TEST(TerrainGlb, HasTheTrianglesInTheirPlacesAndGroups) {
  const PlacedGround placed = ground(20);
  for (const GlbCompression compression : {GlbCompression::kPlain, GlbCompression::kMeshopt}) {
    const test::ReadGlb glb = written(placed, compression);
    EXPECT_EQ(glb.is_compressed, compression == GlbCompression::kMeshopt);
    EXPECT_EQ(in_order(triangles_of(glb)), in_order(triangles_of(placed)));
  }
}

TEST(TerrainGlb, PositionsAreTheSameBitsCompressed) {
  const PlacedGround placed = ground(30);
  const test::ReadGlb plain = written(placed, GlbCompression::kPlain);
  const test::ReadGlb compressed = written(placed, GlbCompression::kMeshopt);
  EXPECT_EQ(plain.positions, compressed.positions);
  EXPECT_EQ(plain.features, compressed.features);
  EXPECT_EQ(plain.translation, compressed.translation);
  for (std::size_t i = 0; i < plain.normals.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(plain.normals[i][k], compressed.normals[i][k], 0.015);
}

TEST(TerrainGlb, GroupsAreRangesOfTriangles) {
  const test::ReadGlb glb = written(ground(12), GlbCompression::kMeshopt);
  ASSERT_EQ(glb.group, (std::vector<std::uint32_t>{100, 101, 102}));
  std::uint32_t next = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    EXPECT_EQ(glb.first_triangle[row], next);
    for (std::uint32_t t = next; t < next + glb.triangles[row]; ++t)
      for (std::size_t corner = 0; corner < 3; ++corner)
        ASSERT_EQ(glb.features[glb.corners[3 * t + corner]], static_cast<float>(row));
    next += glb.triangles[row];
  }
  EXPECT_LT(next, glb.corners.size() / 3) << "and some of no group";
}

TEST(TerrainGlb, NormalsPointUpwardsAndAreOfLengthOne) {
  const test::ReadGlb glb = written(ground(12), GlbCompression::kPlain);
  for (const auto& n : glb.normals) {
    EXPECT_GT(n[2], 0.3F);
    EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
  }
}

TEST(TerrainGlb, CompressedTakesAtMostTwelveBytesATriangle) {
  const PlacedGround placed = ground(100);
  const TerrainMesh mesh =
      tile_ground(placed.tin, placed.ecef, placed.frame, nullptr, 0, kFinestStepM);
  const std::size_t bytes = terrain_glb(mesh, GlbCompression::kMeshopt).size();
  EXPECT_LT(static_cast<double>(bytes) / static_cast<double>(placed.tin.triangles.size()), 12);
}

}  // namespace
}  // namespace scarp
