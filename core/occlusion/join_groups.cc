#include "core/occlusion/join_groups.h"

#include <algorithm>
#include <cassert>

namespace scarp {
namespace {

/// Appends the leaves or the inner nodes of a tile, with their regions.
/// @param renumber  from the tile's nodes to those of all
template <class Renumber>
void append_nodes(const Groups& tile, GroupIndex first, GroupIndex end, const Renumber& renumber,
                  Groups& all) {
  const auto sectors = static_cast<std::size_t>(tile.regions.layout.count);
  for (GroupIndex n = first; n < end; ++n) {
    GroupNode node = tile.nodes[n];
    for (GroupIndex* link : {&node.parent, &node.children[0], &node.children[1]})
      if (*link != kNone) *link = renumber(*link);
    all.nodes.push_back(node);
    for (std::size_t s = n * sectors; s < (n + 1) * sectors; ++s) {
      all.regions.points.insert(all.regions.points.end(),
                                tile.regions.points.begin() + tile.regions.first[s],
                                tile.regions.points.begin() + tile.regions.first[s + 1]);
      all.regions.first.push_back(static_cast<std::uint32_t>(all.regions.points.size()));
      all.regions.end_slope.push_back(tile.regions.end_slope[s]);
    }
  }
}

void append_certified(const Groups& tile, Groups& all) {
  CertifiedRegions& to = all.certified;
  assert(to.groups.empty() || (to.layout.sectors == tile.certified.layout.sectors &&
                               to.layout.ring_bits == tile.certified.layout.ring_bits));
  to.layout = tile.certified.layout;
  to.groups.insert(to.groups.end(), tile.certified.groups.begin(), tile.certified.groups.end());
  to.steps.insert(to.steps.end(), tile.certified.steps.begin(), tile.certified.steps.end());
}

}  // namespace

Groups join_groups(std::span<const Groups> tiles) {
  Groups all;
  for (const Groups& tile : tiles) all.leaf_count += tile.leaf_count;
  const bool certified = std::all_of(tiles.begin(), tiles.end(), [](const Groups& tile) {
    return tile.leaf_count == 0 || tile.has_certified();
  });
  all.regions.first.push_back(0);
  for (const bool leaves : {true, false}) {
    GroupIndex leaf_offset = 0, inner_offset = all.leaf_count;
    for (const Groups& tile : tiles) {
      const auto nodes = static_cast<GroupIndex>(tile.nodes.size());
      const auto renumber = [&](GroupIndex n) {
        return n < tile.leaf_count ? leaf_offset + n : inner_offset + n - tile.leaf_count;
      };
      if (leaves) {
        for (const GroupIndex group : tile.group_of_triangle)
          all.group_of_triangle.push_back(group == kNone ? kNone : renumber(group));
        if (tile.leaf_count > 0) all.regions.layout = tile.regions.layout;
        if (certified && tile.leaf_count > 0) append_certified(tile, all);
      }
      append_nodes(tile, leaves ? 0 : tile.leaf_count, leaves ? tile.leaf_count : nodes, renumber,
                   all);
      leaf_offset += tile.leaf_count;
      inner_offset += nodes - tile.leaf_count;
    }
  }
  return all;
}

}  // namespace scarp
