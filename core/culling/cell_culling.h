#pragma once

#include <vector>

#include "core/culling/culling_method.h"
#include "core/occlusion/certified/certified_regions.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Method cells: space is an octree of view cells, each with the set of groups that are hidden from
/// all of it, kept at the highest cell for which it is true; the sets from the root to the leaf
/// that holds the eye together are what it does not see. Law and Tan 1999, with certified regions
/// in place of their virtual occluders.
///
/// A cell is divided when an eye first comes into it, and kept: a flight prepares what it needs.
/// Side: as certified. Requires an eye within the space, or it sees everything. Keeps a reference;
/// one thread at a time. Cost of a new cell: one test for each group that its parent leaves open.
class CellCulling : public CullingMethod {
 public:
  /// @param space  where eyes may be
  /// @param least_m  cells are not divided below this width
  CellCulling(const CertifiedRegions& regions, const Bounds& space, double least_m);

  std::string_view name() const override { return "cells"; }
  CullingAnswer visible(const Camera& camera) override;

  std::size_t cells() const { return cells_.size(); }
  /// Memory of the sets.
  std::uint64_t bytes() const;

 private:
  struct Cell {
    Bounds box;
    std::vector<GroupIndex> hidden;  // from all of it, and not from all of its parent
    std::vector<GroupIndex> open;    // neither from it nor from those above
    std::uint32_t first_child;       // of eight, or kNone
  };

  Cell cell_of(const Bounds& box, const std::vector<GroupIndex>& open) const;
  void divide(std::uint32_t cell);

  const CertifiedRegions& regions_;
  double least_m_;
  std::vector<Cell> cells_;
};

}  // namespace scarp
