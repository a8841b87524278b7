#pragma once

#include <string>

#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"
#include "core/terrain/tin.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// What is flown over: a surface in groups, in memory.
struct FlownGround {
  const Tin& tin;
  const TinIndex& index;  ///< of it
  const Groups& groups;   ///< with certified regions or without
  const GeoFrame& frame;
  bool has_horizons = false;  ///< groups have regions of horizons too
  std::string name;           ///< for messages
};

struct LoadedScene;
/// A scene as it was read; must outlive the answer.
FlownGround flown(const LoadedScene& scene);

}  // namespace scarp
