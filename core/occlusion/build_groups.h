#pragma once

#include "core/occlusion/crystals.h"

namespace scarp {

/// What became of the triangles, for reports.
struct GroupingReport {
  std::uint32_t passes = 0;   ///< of seeding that were used
  std::uint32_t orphans = 0;  ///< triangles that are always drawn
};

/// Crystals and the tree above them, from a surface and its horizons.
/// @param report  may be null
/// Requires, cost, source: see grow_crystals and build_group_tree.
Groups build_groups(const Tin& tin, const HorizonTable& horizon, const CrystalOptions& options,
                    const Progress& progress = {}, GroupingReport* report = nullptr);

}  // namespace scarp
