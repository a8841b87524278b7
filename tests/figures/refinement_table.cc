// What refinement with culling draws of a flight, beside what any culling would have to draw, for
// docs/refinement.md.
//   refinement_table flight SCENE ROUTE FRAMES
//   refinement_table views SCENE FRAME PNG    that frame of the drive refined without and with
//                                             culling, from behind and above its eye

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
#include "tiles/layers/png_image.h"

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
using Visible = std::optional<std::vector<GroupIndex>>;

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
  std::uint64_t other_numbers = 0, other_places = 0;  // pixels of all frames
};

double ms_of(const std::function<void()>& work) {
  const std::clock_t begun = std::clock();
  work();
  return 1000.0 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
}

/// A scene, and certified regions and virtual occluders asked for cells of it.
struct Laboratory {
  LoadedScene scene;
  GroupBatches batches;
  BoxTree tree;
  SelectiveRefinement refinement;
  std::vector<Shot> shots;
  CellCulling cells;

  Laboratory(const std::string& path, Route route, int frames)
      : scene(path, {machine_memory_bytes()}),
        batches(scene.tin, scene.groups),
        tree(batches),
        refinement(scene.tin, scene.groups),
        cells("cells", hiding(), {walk_and_flight(scene.tin, least_m()).front()}) {
    const GeoFrame::Placer placer(scene.frame);
    for (const Waypoint& waypoint : find_path(flown(scene), route, frames, kSeed))
      shots.push_back(shot_at(placer, waypoint, kLens));
  }

  double width_m() const {
    const Bounds ground = bounds_of(scene.tin.vertices);
    return ground.high.x_m - ground.low.x_m;
  }

 private:
  double least_m() const { return width_m() / std::exp2(kCellLevels - 1); }
  std::unique_ptr<NodeHiding> hiding() const {
    return std::make_unique<JointHiding>(
        std::make_unique<CertifiedHiding>(tree, scene.groups.certified),
        std::make_unique<OccluderHiding>(tree, batches, scene.tin,
                                         find_virtual_occluders(scene.tin, {}).sections));
  }
};

void print_table(const std::string& path, Route route, int count) {
  Laboratory lab(path, route, count);
  const LoadedScene& scene = lab.scene;
  const Tin& tin = scene.tin;
  const SelectiveRefinement& refinement = lab.refinement;
  CellCulling& cells = lab.cells;
  CertifiedCulling certified(scene.groups.certified);
  const std::pair<const char*, std::function<Visible(const Shot&)>> methods[] = {
      {"without culling", [&](const Shot&) { return Visible(); }},
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
         return Visible(both);
       }},
      {"groups that are seen", [&](const Shot& shot) { return Visible(groups_seen(scene, shot)); }},
  };
  std::vector<Sum> sums(std::size(methods));
  for (const Shot& shot : lab.shots) {
    Target whole;
    for (std::size_t m = 0; m < std::size(methods); ++m) {
      Sum& sum = sums[m];
      Visible visible;
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
      }
    }
  }
  const double frames = static_cast<double>(lab.shots.size());
  const double all = sums[0].triangles;
  fmt::print("{} triangles in {} groups, {} frames refined to {} px\n\n", tin.triangles.size(),
             scene.groups.leaf_count, lab.shots.size(), kMostPx);
  double widest_m = 0;
  for (GroupIndex g = 0; g < lab.batches.groups(); ++g) {
    const Bounds& box = lab.batches.box(g);
    widest_m = std::max({widest_m, box.high.x_m - box.low.x_m, box.high.y_m - box.low.y_m});
  }
  fmt::print("The widest group has {:.1f} % of the scene's width. ",
             100 * widest_m / lab.width_m());
  fmt::print("Triangles a frame without culling: {:.0f}; with a pixel: {:.0f}, {:.1f} %\n\n",
             all / frames, sums[0].shown / frames, 100 * sums[0].shown / all);
  fmt::print(
      "| | by groups | of the whole | and by the outline | of the whole | find, refine, outline, "
      "ms "
      "| other numbers | other places |\n|---|---|---|---|---|---|---|---|\n");
  for (std::size_t m = 0; m < std::size(methods); ++m) {
    const Sum& sum = sums[m];
    fmt::print(
        "| {} | {:.0f} | {:.1f} % | {:.0f} | {:.1f} % | {:.2f}, {:.2f}, {:.2f} | {} | {} |\n",
        methods[m].first, sum.triangles / frames, 100 * sum.triangles / all,
        sum.over_outline / frames, 100 * sum.over_outline / all, sum.find_ms / frames,
        sum.refine_ms / frames, sum.outline_ms / frames, sum.other_numbers, sum.other_places);
  }
}

constexpr int kPanelPx = 640;
/// Pixels that the surface in the pictures may be off.
constexpr double kViewMostPx = 3;

/// Behind and above an eye, looking to where it does.
Shot from_behind(const Shot& shot, double back_m) {
  Shot behind = shot;
  behind.width_px = behind.height_px = kPanelPx;
  Position to = {shot.view.target.x_m - shot.view.eye.x_m, shot.view.target.y_m - shot.view.eye.y_m,
                 0};
  const double length_m = std::hypot(to.x_m, to.y_m);
  to = {to.x_m / length_m, to.y_m / length_m, 0};
  behind.view.eye.x_m -= back_m * to.x_m;
  behind.view.eye.y_m -= back_m * to.y_m;
  behind.view.eye.z_m += 0.9 * back_m;
  behind.view.target = shot.view.eye;
  behind.view.target.x_m += 0.6 * back_m * to.x_m;
  behind.view.target.y_m += 0.6 * back_m * to.y_m;
  behind.view.near_m = 1;
  return behind;
}

/// The active surface with its edges; what is drawn from the eye in colour.
void paint(const Tin& tin, const CollapseHistory& history, const Drawing& drawing, const Shot& from,
           int left_px, std::vector<std::uint8_t>& rgb) {
  Drawing active;
  for (const TriangleIndex t : drawing.active) active.triangles.push_back(history.triangles[t]);
  active.objects = drawing.active;
  const Target picture = picture_of(tin, active, from, 1);
  std::vector<std::uint8_t> is_drawn(history.triangles.size(), 0);
  for (const std::uint32_t t : drawing.objects) is_drawn[t] = 1;
  for (int y = 0; y < kPanelPx; ++y)
    for (int x = 0; x < kPanelPx; ++x) {
      const std::uint32_t t = picture.object[picture.index(x, y)];
      if (t == kNone) continue;
      const auto differs = [&](int to_x, int to_y) {
        return to_x < kPanelPx && to_y < kPanelPx && picture.object[picture.index(to_x, to_y)] != t;
      };
      const auto& [i, j, k] = history.triangles[t];
      const Position &a = tin.vertices[i], &b = tin.vertices[j], &c = tin.vertices[k];
      const double ux = b.x_m - a.x_m, uy = b.y_m - a.y_m, uz = b.z_m - a.z_m;
      const double vx = c.x_m - a.x_m, vy = c.y_m - a.y_m, vz = c.z_m - a.z_m;
      const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
      // The sun stands in the north-west.
      double light = length > 0 ? 0.55 + 0.45 * (-nx * 0.5 + ny * 0.5 + nz * 0.7) / length : 0.5;
      if (differs(x + 1, y) || differs(x, y + 1)) light *= 0.55;
      constexpr double kGrey[] = {205, 208, 200}, kColour[] = {236, 140, 80};
      for (std::size_t channel = 0; channel < 3; ++channel)
        rgb[(static_cast<std::size_t>(y) * (2 * kPanelPx) + static_cast<std::size_t>(left_px + x)) *
                3 +
            channel] =
            static_cast<std::uint8_t>(
                std::clamp(light * (is_drawn[t] ? kColour : kGrey)[channel], 0.0, 255.0));
    }
}

void write_views(const std::string& path, int frame, const std::string& png) {
  Laboratory lab(path, Route::kDrive, frame + 1);
  const Shot& shot = lab.shots.back();
  const Shot from = from_behind(shot, 0.15 * lab.width_m());
  const auto groups = lab.cells.visible(camera_of(shot)).visible_groups;
  std::vector<std::uint8_t> rgb(std::size_t{2} * kPanelPx * kPanelPx * 3, 255);
  for (const bool with : {false, true}) {
    auto drawing = lab.refinement.draw(
        shot, kViewMostPx,
        with ? std::optional(std::span<const GroupIndex>(groups)) : std::nullopt);
    if (with) lab.refinement.leave_out_hidden(shot, drawing);
    fmt::print("  {} culling: {} triangles drawn, {} in the whole surface\n",
               with ? "with" : "without", drawing.triangles.size(), drawing.active.size());
    paint(lab.scene.tin, lab.refinement.history(), drawing, from, with ? kPanelPx : 0, rgb);
  }
  write_png(png, 2 * kPanelPx, kPanelPx, rgb, Existing::kReplace);
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  const std::string what = argc == 5 ? argv[1] : "";
  if (what == "flight")
    scarp::print_table(argv[2],
                       std::string(argv[3]) == "walk" ? scarp::Route::kWalk : scarp::Route::kDrive,
                       std::atoi(argv[4]));
  else if (what == "views")
    scarp::write_views(argv[2], std::atoi(argv[3]), argv[4]);
  else
    return 2;
  return 0;
}
