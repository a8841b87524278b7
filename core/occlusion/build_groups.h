#pragma once

#include "core/horizon/sectors.h"
#include "core/occlusion/crystals.h"
#include "core/occlusion/groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/threads/progress.h"

namespace scarp {

/// What became of the triangles, for reports.
struct GroupingReport {
  std::uint32_t passes = 0;   ///< of seeding that were used
  std::uint32_t orphans = 0;  ///< triangles that are always drawn
};

/// Groups that are hidden together and the tree above them, from a surface and its horizons.
/// @param report  may be null
/// Requires, cost, source: see grow_hidden_together and build_group_tree.
Groups build_groups(const Tin& tin, const HorizonTable& horizon,
                    const HiddenTogetherOptions& options, const Progress& progress = {},
                    GroupingReport* report = nullptr);

/// The same with crystals grown breadth-first, as published.
/// Requires, cost, source: see grow_crystals and build_group_tree.
Groups build_groups(const Tin& tin, const HorizonTable& horizon, const CrystalOptions& options,
                    const Progress& progress = {}, GroupingReport* report = nullptr);

}  // namespace scarp
