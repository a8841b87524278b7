#include "cli/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/loaded_scene.h"
#include "cli/progress_bar.h"
#include "cli/scene_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"
#include "core/occlusion/splitmix64.h"
#include "core/sight/triangle_sight.h"

namespace scarp {
namespace {

/// A place over known ground, evenly distributed over the plan.
MapPoint random_ground(const LoadedScene& scene, const GeoFrame::Placer& placer,
                       SplitMix64& random) {
  const Bounds bounds = bounds_of(scene.tin.vertices);
  for (;;) {
    Position p = round_to_lattice(
        Position{bounds.low.x_m + random.unit() * (bounds.high.x_m - bounds.low.x_m),
                 bounds.low.y_m + random.unit() * (bounds.high.y_m - bounds.low.y_m), 0});
    const auto ground_m = scene.index.ground_height_m(p.x_m, p.y_m);
    if (!ground_m) continue;
    p.z_m = *ground_m;
    return placer.unplace(p);
  }
}

/// Adds what a method makes of one eye, whose sight the judge has found.
void count_eye(const Groups& groups, const std::vector<TriangleSight>& sight,
               const CullingAnswer& answer, VerifyCounts& counts) {
  const std::vector<std::uint8_t> culled = culled_triangles(groups, answer);
  std::vector<std::uint8_t> group_seen(groups.leaf_count, 0);
  const auto& group_of = groups.group_of_triangle;
  for (std::size_t t = 0; t < sight.size(); ++t)
    if (sight[t] != TriangleSight::kHidden && group_of[t] != kNone) group_seen[group_of[t]] = 1;
  for (std::size_t t = 0; t < sight.size(); ++t) {
    const bool hidden = sight[t] == TriangleSight::kHidden;
    ++counts.triangles;
    counts.hidden += hidden;
    counts.in_hidden_groups += group_of[t] != kNone && !group_seen[group_of[t]];
    counts.culled += culled[t];
    counts.falsely_culled += culled[t] && !hidden;
  }
  ++counts.eyes;
}

}  // namespace

std::vector<VerifyCounts> verify_scene(const LoadedScene& scene, int eyes,
                                       const std::vector<double>& heights_m, std::uint64_t seed,
                                       const Progress& progress) {
  const GeoFrame::Placer placer(scene.frame);
  const std::vector<std::unique_ptr<CullingMethod>> methods = culling_methods(scene);
  std::vector<VerifyCounts> all(methods.size() * heights_m.size());  // by method, then height
  double done = 0;
  for (std::size_t h = 0; h < heights_m.size(); ++h) {
    for (std::size_t m = 0; m < methods.size(); ++m) {
      all[m * heights_m.size() + h].method = methods[m]->name();
      all[m * heights_m.size() + h].eye_height_m = heights_m[h];
    }
    SplitMix64 random(seed);  // the same places at every height
    for (int i = 0; i < eyes; ++i) {
      MapPoint at = random_ground(scene, placer, random);
      at.height_m += heights_m[h];
      const Position eye = placer.place(at);
      const std::vector<TriangleSight> sight = judge_all(scene.index, eye);
      for (std::size_t m = 0; m < methods.size(); ++m)
        count_eye(scene.groups, sight, methods[m]->visible({eye, {}}),
                  all[m * heights_m.size() + h]);
      if (progress)
        progress(++done / static_cast<double>(eyes) / static_cast<double>(heights_m.size()));
    }
  }
  return all;
}

int run_verify(const VerifyOptions& options) {
  for (const double height_m : options.heights_m)
    if (!(std::abs(height_m) <= 1e7))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--heights {}: metres above ground were expected", height_m));
  const LoadedScene scene(options.scene);
  ProgressBar bar(!options.common.json);
  const std::vector<VerifyCounts> all =
      verify_scene(scene, options.eyes, options.heights_m, options.seed, bar.stage("verify"));
  bar.clear();
  if (options.common.json) {
    nlohmann::json result = nlohmann::json::array();
    for (const VerifyCounts& c : all)
      result.push_back({{"method", c.method},
                        {"eye_height_m", c.eye_height_m},
                        {"eyes", c.eyes},
                        {"triangles", c.triangles},
                        {"hidden", c.hidden},
                        {"in_hidden_groups", c.in_hidden_groups},
                        {"culled", c.culled},
                        {"falsely_culled", c.falsely_culled}});
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{:<10} {:>8} {:>6} {:>10} {:>16} {:>9} {:>15}\n", "method", "eye, m", "eyes",
             "hidden, %", "hidden groups, %", "culled, %", "falsely culled");
  for (const VerifyCounts& c : all) {
    const double percent = 100.0 / static_cast<double>(std::max<std::uint64_t>(1, c.triangles));
    fmt::print("{:<10} {:>8g} {:>6} {:>10.1f} {:>16.1f} {:>9.1f} {:>7} ({:.2f} %)\n", c.method,
               c.eye_height_m, c.eyes, percent * static_cast<double>(c.hidden),
               percent * static_cast<double>(c.in_hidden_groups),
               percent * static_cast<double>(c.culled), c.falsely_culled,
               100.0 * static_cast<double>(c.falsely_culled) /
                   static_cast<double>(std::max<std::uint64_t>(1, c.triangles - c.hidden)));
  }
  fmt::print("Percentages are of all triangles; falsely culled, of the visible ones.\n");
  return 0;
}

}  // namespace scarp
