#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/culling/group_batches.h"
#include "core/culling/horizon_kernels.h"

namespace scarp {

/// The triangles of a scene's groups, laid out to be swept under a RisingHorizon: their corners'
/// coordinates side by side, exact, in steps of the lattice from an origin of the group's own.
/// Immutable. 36 bytes a triangle.
class HorizonTriangles {
 public:
  struct Group {
    Position origin;
    /// [count / kLaidOut][9][kLaidOut]: x, y, z of one corner after the other; null where a group
    /// is wider than steps can say (2^31 of them, 524 km).
    const std::int32_t* steps = nullptr;
    /// A multiple of kLaidOut: the last triangle is repeated.
    std::size_t count = 0;
  };

  explicit HorizonTriangles(const GroupBatches& batches);

  Group of(GroupIndex group) const {
    const Place& place = places_[group];
    return {place.origin, place.is_wide ? nullptr : steps_.data() + 9 * place.first, place.count};
  }
  /// How many triangles of a group are looked at before the others.
  static constexpr std::size_t kProbed = 2 * kLaidOut;

  /// Asks for a group's triangles, or those looked at first, while others are: they are mostly out
  /// of every cache.
  void prefetch(GroupIndex group, bool all) const {
    Group of_group = of(group);
    if (!all) of_group.count = std::min(of_group.count, kProbed);
    constexpr std::size_t kLine = 64 / sizeof(std::int32_t);
    for (std::size_t i = 0; i < 9 * of_group.count; i += kLine)
      __builtin_prefetch(of_group.steps + i);
  }
  std::size_t bytes() const {
    return steps_.size() * sizeof(std::int32_t) + places_.size() * sizeof(Place);
  }

 private:
  struct Place {
    Position origin;
    std::size_t first;    // triangle
    std::uint32_t count;  // repeated ones too
    bool is_wide;
  };

  std::vector<Place> places_;  // [groups]
  std::vector<std::int32_t> steps_;
};

}  // namespace scarp
