// What refinement with culling draws of a flight, beside what any culling would have to draw, for
// docs/refinement.md.
//   refinement_table SCENE ROUTE FRAMES

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>

#include "cli/fly/flight_path.h"
#include "cli/loaded_scene.h"
#include "cli/stage_clock.h"
#include "core/culling/cell_culling.h"
#include "core/culling/certified_culling.h"
#include "core/culling/certified_hiding.h"
#include "core/culling/joint_hiding.h"
#include "core/culling/occluder_hiding.h"
#include "core/culling/selective_refinement.h"
#include "core/occlusion/virtual_occluders.h"
#include "core/raster/rasterise.h"

namespace scarp {
namespace {

constexpr std::uint64_t kSeed = 1;
/// Pixels that the refined surface may be off.
constexpr double kMostPx = 1;
constexpr Lens kLens{640, 360, 45};
/// Levels of the cells that are made on the way.
constexpr int kCellLevels = 11;
/// A triangle is truly visible where it has a pixel in a picture so many times as large.
constexpr int kFineScale = 4;
/// Depths that differ by less belong to one place.
constexpr float kDepthShare = 0.01F;

using Drawing = SelectiveRefinement::Drawing;
using Groups_ = std::optional<std::vector<GroupIndex>>;

Target picture_of(const Tin& tin, const Drawing& drawing, const Shot& shot, int scale) {
  Target target = empty_target(shot.width_px * scale, shot.height_px * scale);
  rasterise(target,
            project_all(look_at(shot.view, target.width_px, target.height_px), tin.vertices),
            drawing.triangles, drawing.objects);
  return target;
}

std::size_t shown_in(const Target& picture) {
  std::vector<std::uint32_t> shown(picture.object);
  std::sort(shown.begin(), shown.end());
  shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
  return shown.size() - (!shown.empty() && shown.back() == kNone);
}

/// The groups with a pixel in a picture of all triangles.
std::vector<GroupIndex> groups_seen(const LoadedScene& scene, const Shot& shot) {
  Drawing all;
  all.triangles = scene.tin.triangles;
  std::vector<GroupIndex> seen;
  for (const std::uint32_t object : picture_of(scene.tin, all, shot, 2).object)
    if (object != kNone && scene.groups.group_of_triangle[object] != kNone)
      seen.push_back(scene.groups.group_of_triangle[object]);
  std::sort(seen.begin(), seen.end());
  seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
  return seen;
}

struct Sum {
  double triangles = 0, shown = 0, over_outline = 0, find_ms = 0, refine_ms = 0, outline_ms = 0;
  std::uint64_t other_numbers = 0, other_places = 0, changed_by_outline = 0;
};

double ms_of(const std::function<void()>& work) {
  const std::clock_t begun = std::clock();
  work();
  return 1000.0 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
}

void print_table(const std::string& path, Route route, int count) {
  const LoadedScene scene(path, {machine_memory_bytes()});
  const Tin& tin = scene.tin;
  const GroupBatches batches(tin, scene.groups);
  const BoxTree tree(batches);
  const SelectiveRefinement refinement(tin, scene.groups);
  const Bounds ground = bounds_of(tin.vertices);
  const double least_m = (ground.high.x_m - ground.low.x_m) / std::exp2(kCellLevels - 1);
  CellCulling cells("cells",
                    std::make_unique<JointHiding>(
                        std::make_unique<CertifiedHiding>(tree, scene.groups.certified),
                        std::make_unique<OccluderHiding>(tree, batches, tin,
                                                         find_virtual_occluders(tin, {}).sections)),
                    {walk_and_flight(tin, least_m).front()});
  CertifiedCulling certified(scene.groups.certified);
  const std::pair<const char*, std::function<Groups_(const Shot&)>> methods[] = {
      {"without culling", [&](const Shot&) { return Groups_(); }},
      {"certified regions",
       [&](const Shot& shot) { return certified.visible(camera_of(shot)).visible_groups; }},
      {"cells", [&](const Shot& shot) { return cells.visible(camera_of(shot)).visible_groups; }},
      {"cells and regions",
       [&](const Shot& shot) {
         const auto by_cells = cells.visible(camera_of(shot)).visible_groups;
         const auto by_regions = certified.visible(camera_of(shot)).visible_groups;
         std::vector<GroupIndex> both;
         std::set_intersection(by_cells.begin(), by_cells.end(), by_regions.begin(),
                               by_regions.end(), std::back_inserter(both));
         return Groups_(both);
       }},
      {"groups that are seen", [&](const Shot& shot) { return Groups_(groups_seen(scene, shot)); }},
  };
  const GeoFrame::Placer placer(scene.frame);
  std::vector<Sum> sums(std::size(methods));
  const auto way = find_path(scene, route, count, kSeed);
  for (const Waypoint& waypoint : way) {
    const Shot shot = shot_at(placer, waypoint, kLens);
    Target whole;
    for (std::size_t m = 0; m < std::size(methods); ++m) {
      Sum& sum = sums[m];
      Groups_ visible;
      sum.find_ms += ms_of([&] { visible = methods[m].second(shot); });
      Drawing drawing;
      sum.refine_ms += ms_of([&] {
        drawing = refinement.draw(
            shot, kMostPx,
            visible ? std::optional(std::span<const GroupIndex>(*visible)) : std::nullopt);
      });
      sum.triangles += static_cast<double>(drawing.triangles.size());
      const Target before = picture_of(tin, drawing, shot, kFineScale);
      sum.shown += static_cast<double>(shown_in(before));
      sum.outline_ms += ms_of([&] { refinement.leave_out_hidden(shot, drawing); });
      sum.over_outline += static_cast<double>(drawing.triangles.size());
      const Target picture = picture_of(tin, drawing, shot, kFineScale);
      if (m == 0) whole = before;
      for (std::size_t i = 0; i < whole.depth.size(); ++i) {
        const float a = whole.depth[i], b = picture.depth[i];
        sum.other_numbers += whole.object[i] != picture.object[i];
        sum.other_places += std::abs(a - b) > kDepthShare * std::max(a, b);
        sum.changed_by_outline += before.object[i] != picture.object[i];
      }
    }
  }
  const double frames = static_cast<double>(way.size());
  const double all = sums[0].triangles;
  fmt::print("{} triangles, {} groups, {} frames, {} px\n", tin.triangles.size(),
             scene.groups.leaf_count, way.size(), kMostPx);
  for (std::size_t m = 0; m < std::size(methods); ++m) {
    const Sum& sum = sums[m];
    fmt::print(
        "{:<20} {:>7.0f} {:>6.1f} %; over outline {:>6.0f} {:>6.1f} %; shown {:>6.0f} {:>5.1f} %; "
        "ms {:.2f} {:.2f} {:.3f}; numbers {} places {} by outline {}\n",
        methods[m].first, sum.triangles / frames, 100 * sum.triangles / all,
        sum.over_outline / frames, 100 * sum.over_outline / all, sum.shown / frames,
        100 * sum.shown / all, sum.find_ms / frames, sum.refine_ms / frames,
        sum.outline_ms / frames, sum.other_numbers, sum.other_places, sum.changed_by_outline);
  }
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  scarp::print_table(argv[1],
                     std::string(argv[2]) == "walk" ? scarp::Route::kWalk : scarp::Route::kDrive,
                     std::atoi(argv[3]));
  return 0;
}
