#include "core/occlusion/certified/tile_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "core/terrain/coarse_samples.h"
#include "core/threads/parallel_for.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

HidingOptions few_fans() {
  HidingOptions options;
  options.fans = 32;
  options.sectors = 32;
  return options;
}

/// All triangles of the cells of a tile, and the samples of the raster that their corners are.
Occluder triangles_of(const SampleGrid& raster, const TileScheme& scheme, const TileId& id) {
  const TileWindow window = scheme.window(id);
  const SampleGrid level = coarsened(raster, window.stride);
  SampleGrid part = level;
  for (std::int32_t r = 0; r < level.rows; ++r)
    for (std::int32_t c = 0; c < level.columns; ++c)
      if (c * window.stride < window.first_column || c * window.stride > window.last_column() ||
          r * window.stride < window.first_row || r * window.stride > window.last_row())
        part.known[part.index(c, r)] = 0;
  Occluder tile{test::triangulated(part), {}};
  std::map<std::pair<double, double>, std::int64_t> sample_at;
  for (std::size_t i = 0; i < raster.positions.size(); ++i)
    sample_at[{raster.positions[i].x_m, raster.positions[i].y_m}] = static_cast<std::int64_t>(i);
  for (const Position& p : tile.tin.vertices)
    tile.sample_of_vertex.push_back(sample_at.at({p.x_m, p.y_m}));
  return tile;
}

bool same(const CertifiedRegions& a, const CertifiedRegions& b) {
  if (!(a.layout == b.layout) || a.steps != b.steps || a.groups.size() != b.groups.size())
    return false;
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    const CertifiedGroup &p = a.groups[g], &q = b.groups[g];
    if (p.centre_x_m != q.centre_x_m || p.centre_y_m != q.centre_y_m || p.height_m != q.height_m ||
        p.radius_m != q.radius_m || p.low_slope != q.low_slope || p.slope_step != q.slope_step)
      return false;
  }
  return true;
}

TEST(TileView, OneTileIsCertifiedAsWithoutTiles) {
  const SampleGrid raster = test::random_hills(20, 17, 10, 3, 90, 0.01, 0.1);
  const TileScheme scheme(20, 17, 32);
  const Tin tin = test::triangulated(raster);
  const SeenTile own{{0, 0, 0}, &tin, {}};
  const TileView view = view_of_tile(scheme, {&own, 1});
  EXPECT_EQ(view.tin.vertices, tin.vertices);
  EXPECT_EQ(view.tin.triangles, tin.triangles);
  EXPECT_EQ(view.tin.neighbours, tin.neighbours);
  EXPECT_EQ(view.own_triangles, tin.triangles.size());
  const LeafGroups groups = group_by_squares(tin, 16);
  const CertifiedRegions in_tile =
      certify_tile(view, groups.group_of_triangle, groups.count, few_fans());
  EXPECT_TRUE(
      same(in_tile, certify_groups(tin, groups.group_of_triangle, groups.count, few_fans())));
  EXPECT_TRUE(
      certify_tile(view, std::vector<GroupIndex>(tin.triangles.size(), kNone), 0).groups.empty());
}

struct Scene {
  SampleGrid raster = test::random_hills(50, 39, 10, 5, 120, 0.01, 0.05);
  TileScheme scheme{50, 39, 8};
  std::map<TileId, Occluder> tiles;

  std::vector<SeenTile> seen_from(const TileId& id) {
    std::vector<SeenTile> seen;
    for (const TileId& other : scheme.seen_from(id)) {
      auto at = tiles.find(other);
      if (at == tiles.end()) at = tiles.emplace(other, triangles_of(raster, scheme, other)).first;
      if (at->second.tin.triangles.empty()) continue;
      seen.push_back({other, &at->second.tin, at->second.sample_of_vertex});
    }
    return seen;
  }
};

TEST(TileView, HoldsTheTileFirstAndNothingTwice) {
  Scene scene;
  for (const TileId& id : scene.scheme.tiles(scene.scheme.finest_level())) {
    SCOPED_TRACE(name_of(id));
    const std::vector<SeenTile> seen = scene.seen_from(id);
    if (seen.empty() || !(seen.front().id == id)) continue;  // wholly void
    const TileView view = view_of_tile(scene.scheme, seen);
    const Tin& own = *seen.front().tin;
    ASSERT_EQ(view.own_triangles, own.triangles.size());
    EXPECT_TRUE(std::equal(own.triangles.begin(), own.triangles.end(), view.tin.triangles.begin()));
    EXPECT_TRUE(std::equal(own.vertices.begin(), own.vertices.end(), view.tin.vertices.begin()));
    // Each level is sound by itself; here coarse cells do not straddle what finer tiles hold, so
    // no place is seen twice but for strips at the border of the raster.
    double seen_m2 = 0, ground_m2 = 0;
    for (const auto& [a, b, c] : view.tin.triangles) {
      const Position &p = view.tin.vertices[a], &q = view.tin.vertices[b],
                     &r = view.tin.vertices[c];
      seen_m2 += ((q.x_m - p.x_m) * (r.y_m - p.y_m) - (q.y_m - p.y_m) * (r.x_m - p.x_m)) / 2;
    }
    for (std::int32_t r = 0; r + 1 < scene.raster.rows; ++r)
      for (std::int32_t c = 0; c + 1 < scene.raster.columns; ++c)
        ground_m2 += scene.raster.is_ground_cell(c, r) ? 100 : 0;
    EXPECT_LE(seen_m2, ground_m2);
    EXPECT_GT(seen_m2, 0.5 * ground_m2);
  }
}

TEST(TileView, RegionsAreTheSameForAnyNumberOfThreads) {
  Scene scene;
  const TileId id{scene.scheme.finest_level(), 2, 2};
  const std::vector<SeenTile> seen = scene.seen_from(id);
  ASSERT_TRUE(seen.front().id == id);
  const TileView view = view_of_tile(scene.scheme, seen);
  // Large groups, for which a scene of one tile would have finer rings.
  const LeafGroups groups = group_by_squares(*seen.front().tin, 128);
  const auto certified = [&] {
    return certify_tile(view, groups.group_of_triangle, groups.count, few_fans());
  };
  set_thread_count(1);
  const CertifiedRegions one = certified();
  set_thread_count(3);
  const CertifiedRegions three = certified();
  set_thread_count(0);
  EXPECT_TRUE(same(one, three));
  EXPECT_EQ(one.layout.ring_bits, 2);
  EXPECT_EQ(check_certified(one), std::nullopt);
}

}  // namespace
}  // namespace scarp
