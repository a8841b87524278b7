#pragma once

#include <memory>

#include "core/occlusion/certified/certify_groups.h"
#include "core/occlusion/squares.h"
#include "core/sight/tin_index.h"
#include "tests/support/terrain.h"
#include "tiles/culling/culling_file.h"

namespace scarp::test {

/// A surface with certified groups in one tile, and its culling file.
struct CullingScene {
  Tin tin;
  Groups groups;
  std::unique_ptr<TinIndex> index;
  CullingSource source;
  std::vector<std::byte> file;
};

inline std::unique_ptr<CullingScene> culling_scene(Tin tin, std::uint32_t group_triangles,
                                                   std::int32_t fans, std::int32_t sectors,
                                                   std::optional<Flattening> frame = {}) {
  auto scene = std::make_unique<CullingScene>();
  scene->tin = std::move(tin);
  LeafGroups leaves = group_by_squares(scene->tin, group_triangles);
  HidingOptions options;
  options.fans = fans;
  options.sectors = sectors;
  Groups& groups = scene->groups;
  groups.certified = certify_groups(scene->tin, leaves.group_of_triangle, leaves.count, options);
  groups.leaf_count = leaves.count;
  groups.group_of_triangle = std::move(leaves.group_of_triangle);
  scene->index = std::make_unique<TinIndex>(scene->tin);
  scene->source.frame = std::move(frame);
  scene->source.tiles = {{{0, 0, 0},
                          true,
                          bounds_of(scene->tin.vertices),
                          groups.leaf_count,
                          scene->tin.triangles.size()}};
  scene->source.groups = &groups;
  scene->source.ground = scene->index.get();
  scene->file = culling_file(scene->source);
  return scene;
}

/// Steep hills with holes, 36 x 36 samples 10 m apart.
inline std::unique_ptr<CullingScene> hills_scene(std::uint64_t seed,
                                                 std::optional<Flattening> frame = {},
                                                 double cell_m = 10) {
  return culling_scene(
      triangulated(random_hills(36, 36, cell_m, seed, 15 * cell_m, 0.01, 0.04), seed), 12, 48, 48,
      std::move(frame));
}

}  // namespace scarp::test
