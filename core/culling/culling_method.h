#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/culling/camera.h"
#include "core/occlusion/groups.h"

namespace scarp {

/// The groups that may be seen: leaves, ascending. Orphans are always drawn and not listed.
struct CullingAnswer {
  std::vector<GroupIndex> visible_groups;
  std::uint64_t nodes_tested = 0;
};

/// A way to find the visible groups of a scene that it was made for. Methods may remember earlier
/// cameras, so that one object serves one walk, from one thread at a time.
class CullingMethod {
 public:
  virtual ~CullingMethod() = default;

  /// The name that users type.
  virtual std::string_view name() const = 0;

  virtual CullingAnswer visible(const Camera& camera) = 0;

  /// Whether something in a box, that moves and belongs to no group, may be seen by the camera that
  /// visible() was last asked for. Side: as the method's. Unless overridden everything may.
  virtual bool may_show(const Bounds&) { return true; }

  /// Tells which groups are there from now on: some were taken away or have come back.
  /// @param is_present  [groups]
  /// @return whether the method follows; those that prepared for a scene as it was do not, and are
  ///   not to be asked any more
  virtual bool set_present(std::span<const std::uint8_t> /*is_present*/) { return false; }
};

}  // namespace scarp
