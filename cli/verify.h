#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/culling/culling_method.h"
#include "core/occlusion/groups.h"
#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/progress.h"
#include "ingest/crs/geo_frame.h"

namespace scarp {

/// What the judge says about a culling method, in triangles, summed over the eyes.
struct VerifyCounts {
  std::string method;
  double eye_height_m = 0;
  std::uint64_t eyes = 0;
  std::uint64_t triangles = 0;         ///< judged, for each eye
  std::uint64_t hidden = 0;            ///< truly
  std::uint64_t in_hidden_groups = 0;  ///< in groups that are truly hidden as a whole
  std::uint64_t culled = 0;            ///< by the method
  std::uint64_t falsely_culled = 0;    ///< by the method, and visible
  double bytes_per_triangle = 0;       ///< of the method's regions
};

struct VerifyPlan {
  int eyes = 8;  ///< random places over known ground, the same at each height
  std::vector<double> heights_m = {2, 50, 300, 1000};
  std::uint64_t seed = 1;
  std::uint32_t group_stride = 1;  ///< every so many-th group and orphan is judged
};

/// A place over known ground, evenly distributed over the plan.
MapPoint random_ground(const TinIndex& index, const GeoFrame::Placer& placer, SplitMix64& random);

/// Adds what a method makes of one eye, whose sight of some triangles the judge has found. All
/// triangles of a group are judged, or none.
void count_eye(const Groups& groups, std::span<const TriangleIndex> triangles,
               std::span<const TriangleSight> sight, const CullingAnswer& answer,
               VerifyCounts& counts);

/// Judges what methods cull of a surface. Counts by method, then by height.
/// Cost: a few microseconds for each eye and triangle judged.
std::vector<VerifyCounts> verify_culling(const TinIndex& index, const Groups& groups,
                                         const GeoFrame& frame,
                                         const std::vector<std::unique_ptr<CullingMethod>>& methods,
                                         const VerifyPlan& plan, const Progress& progress);

/// Adds counts of the same methods and heights; takes them where there are none yet.
void add(std::vector<VerifyCounts>& all, const std::vector<VerifyCounts>& more);

/// The plan for build's report: few eyes, and so few groups that it costs next to nothing.
VerifyPlan sampled_plan(std::size_t triangles);

/// Sizes of groups, as reports tell them.
struct GroupFigures {
  std::uint64_t orphans = 0;  ///< triangles
  std::uint32_t least = 0, median = 0, most = 0;
};
GroupFigures figures_of(const Groups& groups);

/// The counts as JSON, with culled / in_hidden_groups as "share" and culled / hidden as
/// "of_hidden", null where nothing is hidden.
nlohmann::json to_json(const std::vector<VerifyCounts>& counts);

}  // namespace scarp
