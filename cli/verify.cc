#include "cli/verify.h"

#include <fmt/format.h>

#include <algorithm>
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

std::vector<TriangleIndex> sampled_triangles(const Groups& groups, std::uint32_t stride) {
  std::vector<TriangleIndex> triangles;
  for (TriangleIndex t = 0; t < groups.group_of_triangle.size(); ++t) {
    const GroupIndex group = groups.group_of_triangle[t];
    if ((group == kNone ? t : group) % stride == 0) triangles.push_back(t);
  }
  return triangles;
}

double ratio(std::uint64_t part, std::uint64_t whole) {
  return static_cast<double>(part) / static_cast<double>(std::max<std::uint64_t>(1, whole));
}

void print_table(const std::vector<VerifyCounts>& all) {
  fmt::print("{:<10} {:>7} {:>5} {:>10} {:>17} {:>10} {:>17} {:>10} {:>15}\n", "method", "eye, m",
             "eyes", "hidden, %", "hidden groups, %", "culled, %", "of hidden groups", "of hidden",
             "falsely culled");
  for (const VerifyCounts& c : all)
    fmt::print(
        "{:<10} {:>7g} {:>5} {:>10.1f} {:>17.1f} {:>10.1f} {:>17.3f} {:>10.3f} {:>7} ({:.2f} %)\n",
        c.method, c.eye_height_m, c.eyes, 100 * ratio(c.hidden, c.triangles),
        100 * ratio(c.in_hidden_groups, c.triangles), 100 * ratio(c.culled, c.triangles),
        ratio(c.culled, c.in_hidden_groups), ratio(c.culled, c.hidden), c.falsely_culled,
        100 * ratio(c.falsely_culled, c.triangles - c.hidden));
  fmt::print(
      "Percentages are of all triangles; falsely culled, of the visible ones. Of hidden groups: of "
      "the triangles in groups that are hidden as a whole, the most that groups can cull.\n");
}

}  // namespace

MapPoint random_ground(const TinIndex& index, const GeoFrame::Placer& placer, SplitMix64& random) {
  const Bounds bounds = bounds_of(index.tin().vertices);
  for (;;) {
    Position p = round_to_lattice(
        Position{bounds.low.x_m + random.unit() * (bounds.high.x_m - bounds.low.x_m),
                 bounds.low.y_m + random.unit() * (bounds.high.y_m - bounds.low.y_m), 0});
    const auto ground_m = index.ground_height_m(p.x_m, p.y_m);
    if (!ground_m) continue;
    p.z_m = *ground_m;
    return placer.unplace(p);
  }
}

void count_eye(const Groups& groups, std::span<const TriangleIndex> triangles,
               std::span<const TriangleSight> sight, const CullingAnswer& answer,
               VerifyCounts& counts) {
  const std::vector<std::uint8_t> culled = culled_triangles(groups, answer);
  std::vector<std::uint8_t> group_seen(groups.leaf_count, 0);
  const auto& group_of = groups.group_of_triangle;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (sight[i] != TriangleSight::kHidden && group_of[triangles[i]] != kNone)
      group_seen[group_of[triangles[i]]] = 1;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const TriangleIndex t = triangles[i];
    const bool hidden = sight[i] == TriangleSight::kHidden;
    ++counts.triangles;
    counts.hidden += hidden;
    counts.in_hidden_groups += group_of[t] != kNone && !group_seen[group_of[t]];
    counts.culled += culled[t];
    counts.falsely_culled += culled[t] && !hidden;
  }
  ++counts.eyes;
}

std::vector<VerifyCounts> verify_culling(const TinIndex& index, const Groups& groups,
                                         const GeoFrame& frame,
                                         const std::vector<std::unique_ptr<CullingMethod>>& methods,
                                         const VerifyPlan& plan, const Progress& progress) {
  const GeoFrame::Placer placer(frame);
  const std::size_t heights = plan.heights_m.size();
  const std::vector<TriangleIndex> triangles = sampled_triangles(groups, plan.group_stride);
  std::vector<VerifyCounts> all(methods.size() * heights);  // by method, then height
  double done = 0;
  for (std::size_t h = 0; h < heights; ++h) {
    for (std::size_t m = 0; m < methods.size(); ++m) {
      VerifyCounts& counts = all[m * heights + h];
      counts.method = methods[m]->name();
      counts.eye_height_m = plan.heights_m[h];
      counts.bytes_per_triangle =
          ratio(region_bytes(groups, counts.method), groups.group_of_triangle.size());
    }
    SplitMix64 random(plan.seed);  // the same places at every height
    for (int i = 0; i < plan.eyes; ++i) {
      MapPoint at = random_ground(index, placer, random);
      at.height_m += plan.heights_m[h];
      const Position eye = placer.place(at);
      const std::vector<TriangleSight> sight = judge_each(index, eye, triangles);
      for (std::size_t m = 0; m < methods.size(); ++m)
        count_eye(groups, triangles, sight, methods[m]->visible({eye, {}}), all[m * heights + h]);
      if (progress)
        progress(++done / static_cast<double>(plan.eyes) / static_cast<double>(heights));
    }
  }
  return all;
}

void add(std::vector<VerifyCounts>& all, const std::vector<VerifyCounts>& more) {
  if (all.empty()) {
    all = more;
    return;
  }
  for (std::size_t i = 0; i < std::min(all.size(), more.size()); ++i) {
    VerifyCounts& to = all[i];
    to.eyes += more[i].eyes;
    to.triangles += more[i].triangles;
    to.hidden += more[i].hidden;
    to.in_hidden_groups += more[i].in_hidden_groups;
    to.culled += more[i].culled;
    to.falsely_culled += more[i].falsely_culled;
  }
}

VerifyPlan sampled_plan(std::size_t triangles) {
  constexpr std::size_t kMostJudged = 60'000;  // some tenths of a second on one core
  VerifyPlan plan;
  plan.eyes = 3;
  plan.heights_m = {2, 300};
  const std::size_t looks = triangles * static_cast<std::size_t>(plan.eyes) * plan.heights_m.size();
  plan.group_stride = static_cast<std::uint32_t>(1 + looks / kMostJudged);
  return plan;
}

GroupFigures figures_of(const Groups& groups) {
  GroupFigures figures;
  for (const GroupIndex group : groups.group_of_triangle) figures.orphans += group == kNone;
  std::vector<std::uint32_t> sizes;
  for (GroupIndex g = 0; g < groups.leaf_count; ++g) sizes.push_back(groups.nodes[g].triangles);
  if (sizes.empty()) return figures;
  std::sort(sizes.begin(), sizes.end());
  figures.least = sizes.front(), figures.median = sizes[sizes.size() / 2];
  figures.most = sizes.back();
  return figures;
}

nlohmann::json to_json(const std::vector<VerifyCounts>& counts) {
  const auto share = [](std::uint64_t part, std::uint64_t whole) {
    return whole > 0 ? nlohmann::json(ratio(part, whole)) : nlohmann::json();
  };
  nlohmann::json result = nlohmann::json::array();
  for (const VerifyCounts& c : counts)
    result.push_back({{"method", c.method},
                      {"eye_height_m", c.eye_height_m},
                      {"eyes", c.eyes},
                      {"triangles", c.triangles},
                      {"hidden", c.hidden},
                      {"in_hidden_groups", c.in_hidden_groups},
                      {"culled", c.culled},
                      {"falsely_culled", c.falsely_culled},
                      {"share", share(c.culled, c.in_hidden_groups)},
                      {"of_hidden", share(c.culled, c.hidden)},
                      {"bytes_per_triangle", c.bytes_per_triangle}});
  return result;
}

int run_verify(const VerifyOptions& options) {
  for (const double height_m : options.heights_m)
    if (!(std::abs(height_m) <= 1e7))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--heights {}: metres above ground were expected", height_m));
  const LoadedScene scene(options.scene, {options.common.memory_budget_bytes});
  const auto methods = culling_methods(scene.groups, has_horizons(scene.scene));
  ProgressBar bar(!options.common.json);
  const VerifyPlan plan{options.eyes, options.heights_m, options.seed, 1};
  const std::vector<VerifyCounts> all =
      verify_culling(scene.index, scene.groups, scene.frame, methods, plan, bar.stage("verify"));
  bar.clear();
  const GroupFigures figures = figures_of(scene.groups);
  if (options.common.json) {
    nlohmann::json result = to_json(all);
    for (nlohmann::json& row : result) {
      row["groups"] = scene.groups.leaf_count;
      row["median_group"] = figures.median;
      row["orphans"] = figures.orphans;
    }
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  print_table(all);
  fmt::print("{} groups, the median of {} triangles; {} orphans ({:.2f} %)",
             scene.groups.leaf_count, figures.median, figures.orphans,
             100 * ratio(figures.orphans, scene.tin.triangles.size()));
  for (const auto& method : methods)
    fmt::print(
        "; {} takes {:.1f} bytes a triangle", method->name(),
        ratio(region_bytes(scene.groups, std::string(method->name())), scene.tin.triangles.size()));
  fmt::print("\n");
  return 0;
}

}  // namespace scarp
