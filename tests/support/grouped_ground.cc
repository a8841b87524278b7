#include "tests/support/grouped_ground.h"

#include <utility>

#include "core/occlusion/squares.h"
#include "tests/support/terrain.h"

namespace scarp::test {

GroupedGround grouped_by_squares(Tin tin, std::uint32_t group_triangles) {
  GroupedGround ground{std::move(tin), {}};
  const LeafGroups leaves = group_by_squares(ground.tin, group_triangles);
  ground.groups.group_of_triangle = leaves.group_of_triangle;
  ground.groups.leaf_count = leaves.count;
  return ground;
}

GroupedGround grouped_hills(std::uint32_t seed) {
  return grouped_by_squares(triangulated(random_hills(40, 40, 10, seed, 120, 0.01), seed), 24);
}

Target picture_of(const GroupBatches& batches, std::span<const GroupIndex> groups, const Shot& shot,
                  int scale) {
  GroupBatches::Drawing drawing;
  for (const GroupIndex g : groups) batches.add_to(g, drawing);
  batches.add_to(batches.groups(), drawing);
  Target target = empty_target(shot.width_px * scale, shot.height_px * scale);
  rasterise(target,
            project_all(look_at(shot.view, target.width_px, target.height_px), drawing.vertices),
            drawing.triangles, drawing.objects);
  return target;
}

}  // namespace scarp::test
