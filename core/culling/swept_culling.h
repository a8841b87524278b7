#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include "core/culling/certified_culling.h"
#include "core/culling/group_batches.h"
#include "core/culling/rising_horizon.h"

namespace scarp {

/// Culling under a horizon that rises with the ground in view, and by certified regions. Groups
/// come in blocks, from near to far: blocks in view that are not yet under the horizon are looked
/// up in the regions, and what these leave is swept, so that the ground in view hides what is
/// behind it. No picture is drawn. A camera that looks all around, or steeply, gets the answer of
/// the regions.
///
/// Side: what is left out is hidden, or beside the picture (RisingHorizon).
/// Keeps references to regions and batches. No allocation at run time but that of the answer, once
/// a few frames have passed. Cost: about 20 nanoseconds a block, 8 a group in view that is not yet
/// under the horizon, and 15 a triangle of the groups that regions leave. Memory: 36 bytes a
/// triangle.
class SweptCulling : public CullingMethod {
 public:
  SweptCulling(const CertifiedRegions& regions, const GroupBatches& batches);

  std::string_view name() const override { return "swept"; }
  CullingAnswer visible(const Camera& camera) override;
  bool may_show(const Bounds& box) override;

  /// What it keeps besides the regions and the batches.
  std::size_t bytes() const {
    return triangles_.bytes() + groups_.size() * sizeof(GroupIndex) +
           blocks_.size() * sizeof(Block);
  }

  /// The same into memory of the caller, which is as long as there are groups.
  /// @return how many are visible
  std::size_t visible_into(const Camera& camera, std::span<GroupIndex> visible);

 private:
  /// Groups side by side.
  struct Block {
    Bounds box;
    std::uint32_t first, count;  // of groups_
  };
  using NearBlock = std::pair<double, std::uint32_t>;  // nearest point, metres ahead
  struct NearGroup {
    double nearest_m;  // ahead
    GroupIndex group;
    bool raises;  // the horizon

    friend bool operator<(const NearGroup& a, const NearGroup& b) {
      return std::pair(a.nearest_m, a.group) < std::pair(b.nearest_m, b.group);
    }
  };

  void look_up(const Camera& camera, std::span<const NearBlock> blocks);

  CertifiedCulling certified_;
  const GroupBatches& batches_;
  HorizonTriangles triangles_;
  std::vector<Block> blocks_;
  std::vector<GroupIndex> groups_;  // by block
  RisingHorizon horizon_;
  bool is_swept_ = false;                 // whether the horizon is of the last camera
  std::vector<NearBlock> near_;           // in view, by nearest point
  std::vector<GroupIndex> asked_, left_;  // of some blocks, and not hidden by regions
  std::vector<NearGroup> order_;          // of those, by nearest point
  std::vector<GroupIndex> visible_;       // [groups]
};

}  // namespace scarp
