#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cli/compare/compared_job.h"
#include "core/occlusion/groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/sight/tin_index.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// A surface whose groups are prepared in several ways.
struct CulledGround {
  const Tin& tin;
  const TinIndex& index;  ///< of it
  const GeoFrame& frame;
  HiddenTogetherOptions growth;
  std::string build_command;  ///< that makes it, without settings of culling
};

struct GroupsQuestion {
  int eyes = 4;
  std::vector<double> heights_m = {2, 50, 300, 1000};
  std::uint64_t seed = 1;
  double limit_s = 300;  ///< settings that would not fit are left out
};

/// Begins a stage of a name.
using StageProgress = std::function<Progress(const std::string& stage)>;

/// What regions cull of groups that were grown once, by the published and the certified method,
/// against what preparing and keeping them costs. The exact judge counts.
/// @param prepared[out]  if wanted: the groups as scarp build --horizon both would leave them, as
/// far
///   as there was time for either kind of regions
ComparedJob compare_groups(const CulledGround& ground, const GroupsQuestion& question,
                           const StageProgress& stage, Groups* prepared = nullptr);

}  // namespace scarp
