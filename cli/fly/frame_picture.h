#pragma once

#include "core/occlusion/groups.h"
#include "core/raster/preview.h"
#include "core/raster/rasterise.h"

namespace scarp {

/// A frame as a method draws it, groups by colour and lit by slope, with the pixels that differ
/// from the whole one in red, each with its neighbours so that one alone can be found.
Picture frame_picture(const Tin& tin, const Groups& groups, const Target& whole,
                      const Target& drawn);

}  // namespace scarp
