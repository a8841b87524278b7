#pragma once

#include "core/occlusion/certified/certified_regions.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Whether a region hides its group from every camera in an upright box.
///
/// Side: never true where hides_group is false for a camera in the box; it may be false where all
/// are hidden, since rings and sectors are taken whole. Cost: O(sectors * rings) that the box
/// meets.
bool hides_group_from(const CertifiedRegions& regions, std::uint32_t group, const Bounds& box);

}  // namespace scarp
