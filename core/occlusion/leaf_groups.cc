#include "core/occlusion/leaf_groups.h"

#include <cassert>
#include <utility>

namespace scarp {

void count_collision(Collisions& collisions, GroupIndex a, GroupIndex b) {
  assert(a != b);
  ++collisions[a][b];
  ++collisions[b][a];
}

void fuse_collisions(Collisions& collisions, GroupIndex a, GroupIndex b, GroupIndex into) {
  assert(a != b && (into == a || into == b || collisions[into].empty()));
  std::map<GroupIndex, std::uint64_t> fused = std::move(collisions[a]);
  for (const auto& [other, times] : collisions[b]) fused[other] += times;
  fused.erase(a);
  fused.erase(b);
  collisions[a].clear();
  collisions[b].clear();
  for (const auto& [other, times] : fused) {
    collisions[other].erase(a);
    collisions[other].erase(b);
    collisions[other][into] = times;
  }
  collisions[into] = std::move(fused);
}

void drop_collisions(Collisions& collisions, GroupIndex group) {
  for (const auto& [other, times] : collisions[group]) collisions[other].erase(group);
  collisions[group].clear();
}

}  // namespace scarp
