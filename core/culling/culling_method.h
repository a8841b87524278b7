#pragma once

#include <cstdint>
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
};

}  // namespace scarp
