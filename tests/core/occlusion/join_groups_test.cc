#include "core/occlusion/join_groups.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

/// Two leaves and the node above them over three triangles; what is in it tells tiles apart.
Groups tile_groups(double mark, bool certified) {
  Groups groups;
  groups.group_of_triangle = {1, kNone, 0};
  groups.leaf_count = 2;
  groups.nodes = {{2, {kNone, kNone}, 1, mark, 0, 1},
                  {2, {kNone, kNone}, 1, mark, 1, 1},
                  {kNone, {0, 1}, 2, mark, 2, 3}};
  groups.regions.layout = {1, 1};
  groups.regions.first = {0, 1, 1, 3};
  groups.regions.points = {{mark, 1}, {mark, 2}, {mark + 1, 3}};
  groups.regions.end_slope = {mark, 0, -mark};
  if (certified) {
    groups.certified.layout = {8, 2};
    groups.certified.groups.resize(2);
    groups.certified.groups[0].centre_x_m = mark;
    groups.certified.steps.resize(16);
    groups.certified.steps[8][0] = static_cast<std::uint16_t>(mark);
  }
  return groups;
}

TEST(JoinGroups, LeavesComeFirstAndEveryLinkFollows) {
  const Groups tiles[] = {tile_groups(10, true), {}, tile_groups(20, true)};
  const Groups all = join_groups(tiles);
  EXPECT_EQ(all.leaf_count, 4U);
  EXPECT_EQ(all.group_of_triangle, (std::vector<GroupIndex>{1, kNone, 0, 3, kNone, 2}));
  ASSERT_EQ(all.nodes.size(), 6U);
  const double marks[] = {10, 10, 20, 20, 10, 20};
  for (std::size_t n = 0; n < 6; ++n) EXPECT_EQ(all.nodes[n].centre_x_m, marks[n]);
  for (const GroupIndex n : {0U, 1U}) EXPECT_EQ(all.nodes[n].parent, 4U);
  for (const GroupIndex n : {2U, 3U}) EXPECT_EQ(all.nodes[n].parent, 5U);
  EXPECT_EQ(all.nodes[5].children, (std::array<GroupIndex, 2>{2, 3}));
  EXPECT_EQ(all.nodes[5].parent, kNone);
}

TEST(JoinGroups, RegionsGoWithTheirNodes) {
  const Groups tiles[] = {tile_groups(10, true), tile_groups(20, true)};
  const Groups all = join_groups(tiles);
  EXPECT_EQ(all.regions.at(2, 0).count, 1U);
  EXPECT_EQ(all.regions.at(2, 0).points[0].u_m, 20);
  EXPECT_EQ(all.regions.at(3, 0).count, 0U);
  EXPECT_EQ(all.regions.at(5, 0).count, 2U);
  EXPECT_EQ(all.regions.at(5, 0).points[1].u_m, 21);
  EXPECT_EQ(all.regions.at(5, 0).end_slope, -20);
  ASSERT_TRUE(all.has_certified());
  EXPECT_EQ(all.certified.groups[2].centre_x_m, 20);
  EXPECT_EQ(all.certified.at(3, 0)[0], 20);
}

TEST(JoinGroups, WithoutCertifiedRegionsInOneThereAreNoneInAll) {
  const Groups tiles[] = {tile_groups(10, true), tile_groups(20, false)};
  EXPECT_FALSE(join_groups(tiles).has_certified());
}

}  // namespace
}  // namespace scarp
