#include <gtest/gtest.h>

#include "core/occlusion/virtual_occluders.h"
#include "core/terrain/occluder.h"
#include "tests/judge/listed_mesh.h"
#include "tests/support/dem_list.h"

namespace scarp {
namespace {

/// Measured ground: lakes as flat as a plate, gorges, a lava field of one-metre cells.
TEST(VirtualOccluderProof, LieNowhereAboveMeasuredGround) {
  int meshes = 0;
  for (const test::ListedDem& listed : test::kListedDems) {
    if (!test::is_asked_for(listed, "ashby-gap,crater-lake-west,mt-st-helens,czech-village"))
      continue;
    const auto tin = test::mesh_of(listed, 5000);
    if (!tin) continue;
    ++meshes;
    const VirtualOccluders occluders = find_virtual_occluders(*tin, {});
    EXPECT_EQ(check_tin(occluders.mesh.tin), std::nullopt) << listed.name;
    EXPECT_EQ(check_under(occluders.mesh.tin, *tin), std::nullopt) << listed.name;
    EXPECT_LT(4 * occluders.mesh.tin.triangles.size(), 3 * tin->triangles.size()) << listed.name;
    const TinIndex ground(*tin);
    for (const UprightOccluder& section : occluders.sections)
      ASSERT_TRUE(is_under_ground(ground, section.top())) << listed.name;
    EXPECT_GT(occluders.sections.size(), 50U) << listed.name;
  }
  if (meshes == 0) GTEST_SKIP() << "left out, shared data not found";
}

}  // namespace
}  // namespace scarp
