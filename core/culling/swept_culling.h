#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "core/culling/certified_culling.h"
#include "core/culling/group_batches.h"
#include "core/culling/rising_horizon.h"

namespace scarp {

/// Culling by certified regions, and then by what they leave: its groups are swept from near to far
/// under a horizon that rises with them, so that the ground in view hides what is behind it. No
/// picture is drawn. A camera that looks all around, or steeply, gets the answer of the regions.
///
/// Side: what is left out is hidden, or beside the picture (RisingHorizon).
/// Keeps references to regions and batches. No allocation at run time but that of the answer, once
/// a few frames have passed. Cost: that of CertifiedCulling, and about 0.1 microseconds a triangle
/// of the groups that it leaves in view.
class SweptCulling : public CullingMethod {
 public:
  SweptCulling(const CertifiedRegions& regions, const GroupBatches& batches);

  std::string_view name() const override { return "swept"; }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;

  /// The same into memory of the caller, which is as long as there are groups.
  /// @return how many are visible
  std::size_t visible_into(const Camera& camera, std::span<GroupIndex> visible);

 private:
  bool shows(GroupIndex group);

  CertifiedCulling certified_;
  const GroupBatches& batches_;
  RisingHorizon horizon_;
  bool is_swept_ = false;  // whether the horizon is of the last camera
  std::vector<std::pair<double, std::uint32_t>> order_;  // of the groups left, by nearest point
  std::vector<std::uint8_t> is_shown_;                   // [groups left]
  std::vector<AheadPoint> places_;                       // of a group's vertices
};

}  // namespace scarp
