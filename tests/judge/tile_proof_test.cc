// Groups of tiles are certified against a view of the scene: full detail near by, lowered coarse
// levels beyond. No region hides what is visible over the whole finest surface.

#include <gtest/gtest.h>

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "core/sight/triangle_sight.h"
#include "tests/ingest/mesh/grids.h"
#include "tests/judge/dem_window.h"
#include "tests/judge/tiled_scene.h"
#include "tests/support/boundary_search.h"
#include "tests/support/shared_data.h"
#include "tests/support/terrain.h"

namespace scarp {
namespace {

using test::TiledOptions;
using test::TiledScene;

struct Counts {
  std::uint64_t judged = 0;
  std::uint64_t false_culls = 0;
  std::uint64_t hidden_triangles = 0;  // by the judge
  std::uint64_t culled_triangles = 0;
};

/// Judges every group that is culled from an eye.
void look_from(const TiledScene& scene, const TinIndex& index, const Position& eye,
               Counts& counts) {
  const std::vector<TriangleSight> sight = judge_all(index, eye);
  for (const TriangleSight s : sight) counts.hidden_triangles += s == TriangleSight::kHidden;
  for (const test::TileOfScene& tile : scene.tiles) {
    for (GroupIndex g = 0; g < tile.groups; ++g) {
      if (!hides_group(tile.regions, g, eye)) continue;
      ++counts.judged;
      counts.culled_triangles += tile.members[g].size();
      bool is_seen = false;
      for (const TriangleIndex t : tile.members[g])
        is_seen = is_seen || sight[t] == TriangleSight::kVisible;
      counts.false_culls += is_seen;
      if (is_seen) {
        ADD_FAILURE() << "group " << g << " of tile " << name_of(tile.id)
                      << " is culled and visible from " << eye.x_m << " " << eye.y_m << " "
                      << eye.z_m;
      }
    }
  }
}

/// Eyes over random places, over the edges of tiles, and outside.
Counts prove(const TiledScene& scene, std::uint64_t seed, int eyes) {
  const TinIndex index(scene.whole);
  const Bounds bounds = bounds_of(scene.whole.vertices);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Counts counts;
  std::vector<Position> on_edges;
  for (const auto& [id, mesh] : scene.meshes)
    if (id.level == scene.scheme.finest_level())
      for (std::size_t t = 0; t < mesh.tin.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i)
          if (mesh.tin.neighbours[t][i] == kNone)
            on_edges.push_back(mesh.tin.vertices[mesh.tin.triangles[t][(i + 1) % 3]]);
  for (int i = 0; i < eyes; ++i) {
    Position eye;
    if (i % 3 == 0) {
      eye = on_edges[random() % on_edges.size()];
      eye.x_m += round_to_lattice(unit());
    } else {
      const double wider = i % 3 == 1 ? 0 : 0.3;
      eye.x_m = bounds.low.x_m - wider * (bounds.high.x_m - bounds.low.x_m) +
                (1 + 2 * wider) * unit() * (bounds.high.x_m - bounds.low.x_m);
      eye.y_m = bounds.low.y_m - wider * (bounds.high.y_m - bounds.low.y_m) +
                (1 + 2 * wider) * unit() * (bounds.high.y_m - bounds.low.y_m);
    }
    eye = round_to_lattice(eye);
    const double relief_m = bounds.high.z_m - bounds.low.z_m + 1;
    const double ground_m = index.ground_height_m(eye.x_m, eye.y_m).value_or(bounds.low.z_m);
    const double above_m[] = {2, 0.05 * relief_m, 0.3 * unit() * relief_m, unit() * relief_m};
    eye.z_m = round_to_lattice(ground_m + above_m[random() % 4]);
    look_from(scene, index, eye, counts);
    if (testing::Test::HasFailure()) break;
  }
  return counts;
}

/// Cameras just inside the boundaries of regions.
std::uint64_t prove_boundaries(const TiledScene& scene, const test::BoundarySearch& search) {
  const TinIndex index(scene.whole);
  std::uint64_t judged = 0;
  for (const test::TileOfScene& tile : scene.tiles) {
    const test::BoundaryFinding found =
        test::search_boundaries(index, tile.regions, tile.members, search);
    judged += found.judged;
    EXPECT_EQ(found.false_culls, 0U)
        << "the first: group " << found.group << " of tile " << name_of(tile.id)
        << " is culled and visible from " << found.eye.x_m << " " << found.eye.y_m << " "
        << found.eye.z_m;
  }
  return judged;
}

TiledOptions small_tiles() {
  TiledOptions options;
  options.tile_samples = 8;
  options.max_error_m = 2;
  options.group_triangles = 16;
  options.hiding.fans = 48;
  options.hiding.sectors = 32;
  return options;
}

/// Scenes that a test looks at; scripts/prove asks for more.
std::uint64_t scenes_asked_for(std::uint64_t usual) {
  const char* asked = std::getenv("SCARP_PROVE_TILES");
  return asked ? std::strtoull(asked, nullptr, 10) : usual;
}

/// Terrains of the kinds where methods fail, by number.
SampleGrid hard_terrain(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto columns = static_cast<std::int32_t>(28 + random() % 16);
  const auto rows = static_cast<std::int32_t>(28 + random() % 16);
  switch (seed % 6) {
    case 0:
      return test::random_hills(columns, rows, 10, seed, 150, 0.01);
    case 1:
      return test::random_hills(columns, rows, 10, seed, 80, 15);  // terraces
    case 2:
      return test::random_hills(columns, rows, 10, seed, 150, 0.1, 0.2);  // voids
    case 3:                                                               // spikes and pits
      return test::grid_of(columns, rows, 10, [&](int, int) {
        return unit() < 0.05 ? 200 * unit() : unit() < 0.03 ? -100 : 5 * unit();
      });
    case 4:  // walls next to edges of tiles
      return test::grid_of(columns, rows, 10, [&](int c, int r) {
        return c % 8 == 1 || r % 16 == 7 ? 60.0 + unit() : 3 * unit();
      });
    default:  // grid lines that bend
      return test::bent_grid(columns, rows, 0.01, 60, [&](std::int32_t c, std::int32_t r) {
        return 900 * std::sin(0.3 * c) * std::cos(0.2 * r) + 60 * unit();
      });
  }
}

/// Places of a surface drawn at random against the finest one.
struct Compared {
  double above_m = -HUGE_VAL, below_m = -HUGE_VAL;
  int over_void = 0;
};

Compared compare_places(const Tin& tin, const TinIndex& finest, std::uint64_t seed) {
  const TinIndex index(tin);
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Compared compared;
  for (int i = 0; i < 2000; ++i) {
    const auto& [a, b, c] = tin.triangles[random() % tin.triangles.size()];
    const Position &p = tin.vertices[a], &q = tin.vertices[b], &r = tin.vertices[c];
    double s = i % 4 == 0 ? 0 : unit(), t = unit();  // some on edges
    if (s + t > 1) s = 1 - s, t = 1 - t;
    const double x_m = round_to_lattice(p.x_m + s * (q.x_m - p.x_m) + t * (r.x_m - p.x_m));
    const double y_m = round_to_lattice(p.y_m + s * (q.y_m - p.y_m) + t * (r.y_m - p.y_m));
    const auto z_m = index.ground_height_m(x_m, y_m);
    if (!z_m) continue;  // rounded out of the surface
    const auto ground_m = finest.ground_height_m(x_m, y_m);
    if (!ground_m) {
      ++compared.over_void;
      continue;
    }
    compared.above_m = std::max(compared.above_m, *z_m - *ground_m);
    compared.below_m = std::max(compared.below_m, *ground_m - *z_m);
  }
  return compared;
}

TEST(TileProof, OccludersLieNowhereAboveTheFinestSurfaceAndMeshesWithinTheirGaps) {
  TiledOptions options = small_tiles();
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE("terrain " + std::to_string(seed));
    options.tile_samples = seed % 2 == 0 ? 8 : 4;
    const TiledScene scene = test::tiled_ground(hard_terrain(seed), options);
    const TinIndex finest(scene.whole);
    EXPECT_GT(scene.occluders.size(), 3U);
    std::size_t kept = 0, all = 0;
    for (const auto& [id, mesh] : scene.meshes)
      if (id.level < scene.scheme.finest_level()) all += mesh.tin.triangles.size();
    for (const auto& [id, occluder] : scene.occluders) {
      kept += occluder.tin.triangles.size();
      EXPECT_EQ(check_tin(occluder.tin), std::nullopt);
      EXPECT_TRUE(
          std::is_sorted(occluder.sample_of_vertex.begin(), occluder.sample_of_vertex.end()));
      const Compared compared = compare_places(occluder.tin, finest, seed);
      EXPECT_LE(compared.above_m, 0) << name_of(id);
      EXPECT_EQ(compared.over_void, 0) << name_of(id);
      EXPECT_LE(measure_gap(occluder.tin, scene.whole).above_m, kGapRoundingM) << name_of(id);
    }
    // What is left out lies along borders of the ground that bend.
    EXPECT_GE(double(kept), (seed % 6 == 5 ? 0.85 : 1) * double(all));
    for (const auto& [id, gap] : scene.gaps) {
      const Compared compared = compare_places(scene.meshes.at(id).tin, finest, seed);
      EXPECT_LE(compared.above_m, gap.above_m) << name_of(id);
      EXPECT_LE(compared.below_m, gap.below_m) << name_of(id);
    }
  }
}

TEST(TileProof, NothingThatATileCullsIsVisible) {
  Counts all;
  for (std::uint64_t seed = 0; seed < scenes_asked_for(6); ++seed) {
    SCOPED_TRACE("terrain " + std::to_string(seed));
    const TiledScene scene = test::tiled_scene(hard_terrain(seed), small_tiles());
    if (scene.tiles.empty()) continue;
    EXPECT_EQ(check_tin(scene.whole), std::nullopt);
    const Counts counts = prove(scene, seed, 40);
    all.judged += counts.judged;
    all.hidden_triangles += counts.hidden_triangles;
    all.culled_triangles += counts.culled_triangles;
    if (testing::Test::HasFailure()) break;
  }
  std::printf("%" PRIu64 " culled groups judged; %.3f of hidden triangles culled\n", all.judged,
              double(all.culled_triangles) / double(all.hidden_triangles));
  EXPECT_GT(all.judged, 1000U);
}

TEST(TileProof, NothingIsVisibleFromJustInsideTheBoundariesOfATilesRegions) {
  for (std::uint64_t seed = 0; seed < scenes_asked_for(6); ++seed) {
    SCOPED_TRACE("terrain " + std::to_string(seed));
    const TiledScene scene = test::tiled_scene(hard_terrain(seed), small_tiles());
    if (scene.tiles.empty()) continue;
    test::BoundarySearch search;
    search.seed = seed + 1;
    search.starts = 2;
    search.steps = 6;
    EXPECT_GT(prove_boundaries(scene, search), 50U);
    if (testing::Test::HasFailure()) break;
  }
}

/// The same eyes over the ground of any scene of one raster.
Counts look_from_above(const TiledScene& scene, double above_m, int eyes) {
  const TinIndex index(scene.whole);
  const Bounds bounds = bounds_of(scene.whole.vertices);
  std::mt19937_64 random(11);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Counts counts;
  for (int i = 0; i < eyes;) {
    const double x_m = bounds.low.x_m + unit() * (bounds.high.x_m - bounds.low.x_m);
    const double y_m = bounds.low.y_m + unit() * (bounds.high.y_m - bounds.low.y_m);
    Position eye = round_to_lattice(Position{x_m, y_m, 0});
    const auto ground_m = index.ground_height_m(eye.x_m, eye.y_m);
    if (!ground_m) continue;
    eye.z_m = round_to_lattice(*ground_m + above_m);
    look_from(scene, index, eye, counts);
    ++i;
  }
  return counts;
}

TEST(TileProof, RealGroundInTilesIsCulledNearlyAsInOne) {
  SCARP_SHARED_OR_SKIP(path, "projected/bigtujunga_srtm30m_utm11.tif");
  const bool is_full = std::getenv("SCARP_PROVE_TILES") != nullptr;
  const std::int32_t samples = is_full ? 385 : 97;
  const SampleGrid raster = test::dem_window(path, 200, 200, samples, samples, 30);
  ASSERT_EQ(raster.columns, samples);
  TiledOptions options = small_tiles();
  options.max_error_m = 5;
  options.tile_samples = is_full ? 128 : 32;
  options.group_triangles = is_full ? 128 : 32;
  if (is_full) options.hiding = {.fans = 128};
  const TiledScene tiles = test::tiled_scene(raster, options);
  options.all_detail = true;
  const TiledScene all_detail = test::tiled_scene(raster, options);
  options.tile_samples = 1024;
  const TiledScene one = test::tiled_scene(raster, options);
  ASSERT_EQ(one.tiles.size(), 1U);
  EXPECT_EQ(check_tin(tiles.whole), std::nullopt);
  std::printf("%zu triangles in %zu tiles, %zu in one\n", tiles.whole.triangles.size(),
              tiles.tiles.size(), one.whole.triangles.size());
  for (const double above_m : {2.0, 50.0, 300.0}) {
    const Counts in_tiles = look_from_above(tiles, above_m, is_full ? 24 : 8);
    const Counts in_detail = look_from_above(all_detail, above_m, is_full ? 24 : 8);
    const Counts in_one = look_from_above(one, above_m, is_full ? 24 : 8);
    const auto share = [](const Counts& counts) {
      return double(counts.culled_triangles) / double(counts.hidden_triangles);
    };
    std::printf(
        "%4g m up: %.3f of hidden triangles culled in tiles, %.3f in tiles that see all detail, "
        "%.3f in one\n",
        above_m, share(in_tiles), share(in_detail), share(in_one));
    EXPECT_GT(share(in_tiles), 0.9 * share(in_detail));
    // Groups of a tile are grown for eyes within it: from high above, less lies behind its own
    // ridges than behind those of all the ground.
    EXPECT_GT(share(in_tiles), 0.7 * share(in_one));
  }
}

}  // namespace
}  // namespace scarp
