#pragma once

#include <vector>

#include "core/culling/culling_method.h"
#include "core/occlusion/certified/certified_regions.h"

namespace scarp {

/// Culling by certified regions: every group is tested, by the view and then by one look-up.
///
/// Side: what is left out is hidden, whole triangles and not only vertices. The view leaves out
/// groups whose circle lies wholly beside it, rounded outwards. Keeps a reference to the regions,
/// which must outlive it and hold what check_certified checks. Thread-safe.
/// Cost: O(groups), one look-up for each in view: about 3 nanoseconds a group beside the view and 8
/// in it. Allocation: the answer.
class CertifiedCulling : public CullingMethod {
 public:
  explicit CertifiedCulling(const CertifiedRegions& regions);

  std::string_view name() const override { return "certified"; }
  CullingAnswer visible(const Camera& camera) override;

  /// The same into memory of the caller, which is as long as there are groups.
  /// @return how many are visible
  std::size_t visible_into(const Camera& camera, std::span<GroupIndex> visible) const;

  /// Of some groups only. The view is computed again with every call.
  /// @param visible  as long as groups
  std::size_t visible_among(const Camera& camera, std::span<const GroupIndex> groups,
                            std::span<GroupIndex> visible) const;

 private:
  std::size_t find_visible(const Camera& camera, const GroupIndex* among, std::size_t count,
                           std::span<GroupIndex> visible) const;

  const CertifiedRegions& regions_;
};

}  // namespace scarp
