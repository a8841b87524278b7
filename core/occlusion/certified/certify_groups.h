#pragma once

#include <cstdint>
#include <span>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"
#include "core/occlusion/certified/least_ground.h"
#include "core/threads/progress.h"

namespace scarp {

/// Bounds in the form that is kept: in each sector, rings are shared out to up to eight steps, so
/// many in each that least is lost of the room that cameras can be in around the group; slopes are
/// rounded down.
CertifiedRegions compress_bounds(const HidingBounds& bounds, const LeastGround& ground);

/// Regions of groups of a surface. Requires what bound_hiding does.
CertifiedRegions certify_groups(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                                std::uint32_t groups, const HidingOptions& options = {},
                                const Progress& progress = {});

}  // namespace scarp
