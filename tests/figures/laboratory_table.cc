// Repeats the tables and curves of two papers on a scene, as Markdown:
//   laboratory_table wang SCENE ROUTE [FRAMES]         Wang, Agarwal and Har-Peled 2001
//   laboratory_table grundhoefer SCENE ROUTE [FRAMES]  Grundhöfer et al. 2006
// and says what certified regions draw beyond what is seen (laboratory_table left SCENE ROUTE
// [FRAMES [SEEDS]]). Times are processor time.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "cli/fly/flight.h"
#include "cli/fly/flight_page.h"
#include "cli/loaded_scene.h"
#include "cli/stage_clock.h"
#include "cli/stopwatch.h"
#include "core/culling/box_tree.h"
#include "core/culling/certified_culling.h"
#include "core/culling/image_culling.h"
#include "core/culling/mask_culling.h"
#include "core/culling/query_culling.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"

namespace {

using namespace scarp;

/// The least distance of occluders, metres: across a street.
constexpr double kLeastDistanceM = 40;

/// Draws every group, whatever the view: the paper's "hardware only" and its frustum culling.
class Everything : public CullingMethod {
 public:
  explicit Everything(std::uint32_t groups) {
    for (GroupIndex g = 0; g < groups; ++g) all_.visible_groups.push_back(g);
  }
  std::string_view name() const override { return "frustum"; }
  CullingAnswer visible(const Camera&) override { return all_; }

 private:
  CullingAnswer all_;
};

struct Laboratory {
  LoadedScene scene;
  GroupBatches batches;
  BoxTree tree;
  FlightPlan plan;

  Laboratory(const std::string& path, Route route, int frames, std::uint64_t seed = 1)
      : scene(path, {machine_memory_bytes()}), batches(scene.tin, scene.groups), tree(batches) {
    const GeoFrame::Placer placer(scene.frame);
    for (const Waypoint& w : find_path(flown(scene), route, frames, seed))
      plan.shots.push_back(shot_at(placer, w, {}));
  }

  Flight fly_with(std::vector<Contender>& contenders) const {
    return fly(scene.index, batches, plan, contenders,
               [](std::size_t, std::size_t, const Target&, const Target&) {}, {});
  }
};

double mean_frames_a_second(const Flight& flight, std::size_t contender) {
  double ms = 0;
  for (const FrameCounts& c : flight.counts[contender]) ms += c.find_ms + c.draw_ms;
  return 1000 * static_cast<double>(flight.truth.size()) / ms;
}

/// Of the wrong pixels at scale 1.
struct Errors {
  std::size_t frames = 0;
  std::uint64_t sum = 0, most = 0;
};
Errors errors_of(const Flight& flight, std::size_t contender) {
  Errors errors;
  for (const FrameCounts& c : flight.counts[contender]) {
    errors.frames += c.wrong_px[0] > 0;
    errors.sum += c.wrong_px[0];
    errors.most = std::max(errors.most, c.wrong_px[0]);
  }
  return errors;
}

// ---- Wang, Agarwal and Har-Peled

double frames_a_second_of_all(const Laboratory& lab) {
  GroupBatches::Drawing all;
  for (GroupIndex g = 0; g <= lab.batches.groups(); ++g) lab.batches.add_to(g, all);
  const ProcessorStopwatch watch;
  int frames = 0;
  for (std::size_t i = 0; i < lab.plan.shots.size(); i += 8, ++frames) {
    const Shot& shot = lab.plan.shots[i];
    Target target = empty_target(shot.width_px, shot.height_px);
    rasterise(target, project_all(look_at(shot.view, shot.width_px, shot.height_px), all.vertices),
              all.triangles, all.objects);
  }
  return frames / watch.seconds();
}

void wang(const Laboratory& lab) {
  std::array<double, 5> step_ms{};
  int masks = 0;
  ProcessorStopwatch since;
  std::size_t running = step_ms.size();
  const std::array<int, 8> margins = {1, 2, 4, 6, 8, 12, 20, 32};
  constexpr std::size_t kPaperMargin = 3;  // in margins: 6 pixels
  std::vector<Contender> contenders;
  contenders.push_back({"frustum", true, 0, 0, std::make_unique<Everything>(lab.batches.groups())});
  for (std::size_t m = 0; m < margins.size(); ++m) {
    MaskOptions options;
    options.margin_px = margins[m];
    options.width_px = lab.plan.shots[0].width_px;
    options.least_distance_m = kLeastDistanceM;
    options.drawing = MaskDrawing::kByCentres;
    if (m == kPaperMargin)
      options.on_step = [&](MaskStep step) {
        if (running < step_ms.size()) step_ms[running] += since.ms();
        running = static_cast<std::size_t>(step);
        masks += step == MaskStep::kDone;
        since = ProcessorStopwatch();
      };
    contenders.push_back(
        {fmt::format("{}", margins[m]), false, 0, 0,
         std::make_unique<MaskCulling>(lab.scene.tin, lab.batches, lab.tree, options)});
  }
  const Flight flight = lab.fly_with(contenders);
  const std::size_t paper = 1 + kPaperMargin;
  const double triangles = static_cast<double>(lab.scene.tin.triangles.size());

  fmt::print("{:.0f} triangles in {} groups; {} frames\n\n", triangles, lab.batches.groups(),
             flight.truth.size());
  fmt::print("Figure 10: milliseconds of the steps of a mask, margin {} px, {} masks\n\n",
             margins[kPaperMargin], masks);
  fmt::print("| choose | draw | shrink | pyramid | mark |\n|---|---|---|---|---|\n");
  for (const double ms : step_ms) fmt::print("| {:.2f} ", ms / std::max(1, masks));
  fmt::print("|\n\nFigures 11 and 12: what the margin costs and gains\n\n");
  fmt::print(
      "| margin, px | triangles sent | frames a second | masks | frames with errors | wrong "
      "pixels a frame | most |\n|---|---|---|---|---|---|---|\n");
  for (std::size_t c = 1; c < contenders.size(); ++c) {
    const Errors errors = errors_of(flight, c);
    fmt::print("| {} | {:.0f} | {:.0f} | {} | {} of {} | {:.1f} | {} |\n", contenders[c].label,
               sum_of(flight, c).drawn, mean_frames_a_second(flight, c),
               static_cast<const MaskCulling&>(*contenders[c].method).critical_frames(),
               errors.frames, flight.truth.size(),
               static_cast<double>(errors.sum) / static_cast<double>(flight.truth.size()),
               errors.most);
  }
  double least_v = 1, greatest_v = 0, sum_v = 0, sum_o = 0;
  for (std::size_t i = 0; i < flight.truth.size(); ++i) {
    const double in_view = static_cast<double>(flight.truth[i].in_view);
    const double drawn = static_cast<double>(flight.counts[paper][i].drawn);
    const double v = 1 - drawn / in_view;
    least_v = std::min(least_v, v), greatest_v = std::max(greatest_v, v);
    sum_v += v, sum_o += 1 - drawn / triangles;
  }
  const double frames = static_cast<double>(flight.truth.size());
  fmt::print(
      "\nFigure 14: culled of all {:.1f} %, of those in view {:.1f} % ({:.1f} to {:.1f} %)\n",
      100 * sum_o / frames, 100 * sum_v / frames, 100 * least_v, 100 * greatest_v);
  fmt::print("\nTable 1: frames a second: everything {:.1f}, view frustum {:.1f}, mask {:.1f}\n",
             frames_a_second_of_all(lab), mean_frames_a_second(flight, 0),
             mean_frames_a_second(flight, paper));
}

// ---- Grundhöfer et al.

/// Shares of the picture's pixels by the level of what they show.
std::array<double, 3> pixels_by_level(const Target& picture, std::span<const GroupIndex> groups,
                                      std::span<const std::uint8_t> levels,
                                      std::span<const GroupIndex> group_of) {
  std::vector<std::uint8_t> level_of(group_of.size(), 0xff);
  std::vector<std::uint8_t> by_group(groups.empty() ? 1 : groups.back() + 1, 0xff);
  for (std::size_t i = 0; i < groups.size(); ++i) by_group[groups[i]] = levels[i];
  std::array<double, 3> shares{};
  double all = 0;
  for (const std::uint32_t object : picture.object) {
    if (object == kNone || group_of[object] == kNone || group_of[object] >= by_group.size())
      continue;
    const std::uint8_t level = by_group[group_of[object]];
    if (level >= shares.size()) continue;
    shares[level] += 1;
    all += 1;
  }
  for (double& share : shares) share /= std::max(1.0, all);
  return shares;
}

void grundhoefer(const Laboratory& lab) {
  const CoarseBatches coarse(lab.batches,
                             std::vector(std::begin(kQueryShares), std::end(kQueryShares)));
  std::vector<Contender> contenders;
  const auto add_query = [&](const std::string& label, QueryUse use, const QueryOptions& options) {
    contenders.push_back(
        {label, false, 0, 0, std::make_unique<QueryCulling>(lab.batches, coarse, use, options)});
  };
  contenders.push_back(
      {"no culling", true, 0, 0, std::make_unique<Everything>(lab.batches.groups())});
  QueryOptions options;
  options.width_px = 640;
  options.threshold_px = 30;
  add_query("lod-query", QueryUse::kSameFrame, options);
  add_query("multi-frame", QueryUse::kNextFrame, options);
  contenders.push_back(
      {"stop-and-wait", false, 0, 0, std::make_unique<StopAndWaitCulling>(lab.batches, options)});
  options.near_sizes = 1e9;
  add_query("finest levels", QueryUse::kSameFrame, options);
  options.near_sizes = QueryOptions{}.near_sizes;
  options.threshold_px = 20;
  add_query("threshold 20", QueryUse::kSameFrame, options);
  Target middle_picture;
  const std::size_t middle = lab.plan.shots.size() / 2;
  const Flight flight =
      fly(lab.scene.index, lab.batches, lab.plan, contenders,
          [&](std::size_t frame, std::size_t, const Target& whole, const Target&) {
            if (frame == middle) middle_picture = whole;
          },
          {});
  const std::size_t frames = flight.truth.size();
  fmt::print("{} triangles in {} groups; {} frames of 640 x 360\n\n",
             lab.scene.tin.triangles.size(), lab.batches.groups(), frames);

  fmt::print(
      "Figure 3: of the triangles in view, drawn by coarse and by the finest levels\n\n| view "
      "| coarse | finest |\n|---|---|---|\n");
  for (std::size_t v = 0; v < 4; ++v) {
    const std::size_t i = v * (frames - 1) / 3;
    const auto share = [&](std::size_t c) {
      return 100 * static_cast<double>(flight.counts[c][i].drawn) /
             static_cast<double>(flight.truth[i].in_view);
    };
    fmt::print("| {} | {:.1f} % | {:.1f} % |\n", v + 1, share(1), share(4));
  }

  const Shot& shot = lab.plan.shots[middle];
  const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
  std::vector<GroupIndex> in_view;
  for (GroupIndex g = 0; g < lab.batches.groups(); ++g)
    if (frustum.may_show(lab.batches.box(g))) in_view.push_back(g);
  QueryCulling query(lab.batches, coarse, QueryUse::kSameFrame);
  const std::vector<GroupIndex> seen = query.visible(camera_of(shot)).visible_groups;
  const std::uint64_t budget = flight.truth[middle].in_view / 3;
  fmt::print(
      "\nFigure 4: pixels by level with {} triangles a frame\n\n| | finest | second | third "
      "|\n|---|---|---|---|\n",
      budget);
  const std::pair<const char*, const std::vector<GroupIndex>*> draws[] = {
      {"without culling", &in_view}, {"lod-query", &seen}};
  for (const auto& [label, groups] : draws) {
    const auto levels = levels_within(lab.batches, coarse, shot.view.eye, *groups, 3, budget);
    const auto shares =
        pixels_by_level(middle_picture, *groups, levels, lab.scene.groups.group_of_triangle);
    fmt::print("| {} | {:.0f} % | {:.0f} % | {:.0f} % |\n", label, 100 * shares[0], 100 * shares[1],
               100 * shares[2]);
  }

  fmt::print(
      "\nFigures 5 to 9: threshold 30 pixels\n\n| | frames a second | triangles drawn | wrong "
      "pixels a frame | most | of the picture |\n|---|---|---|---|---|---|\n");
  const double pixels = 640.0 * 360;
  for (std::size_t c = 0; c < 4; ++c) {
    const Errors errors = errors_of(flight, c);
    const double mean = static_cast<double>(errors.sum) / static_cast<double>(frames);
    fmt::print("| {} | {:.0f} | {:.0f} | {:.1f} | {} | {:.4f} % |\n", contenders[c].label,
               mean_frames_a_second(flight, c), sum_of(flight, c).drawn, mean, errors.most,
               100 * mean / pixels);
  }
  fmt::print("\nFigure 10: threshold 20, the middle frame: {} wrong pixels, {:.4f} %\n",
             flight.counts[5][middle].wrong_px[0],
             100 * static_cast<double>(flight.counts[5][middle].wrong_px[0]) / pixels);
}

// ---- What is left

/// Triangles a frame in groups that certified regions draw, by why.
struct Left {
  double with_pixel = 0;   ///< show a pixel of the picture at twice its size
  double seen = 0;         ///< exactly seen, by a triangle that meets the picture, but by no pixel
  double seen_beside = 0;  ///< exactly seen, but beside the picture
  double around_camera = 0;  ///< the camera is within the group's circle, where regions say nothing
  double not_proved = 0;     ///< all others
};

Left left_of(const Laboratory& lab, const Shot& shot) {
  const CertifiedRegions& regions = lab.scene.groups.certified;
  const Frustum frustum(look_at(shot.view, shot.width_px, shot.height_px));
  std::vector<GroupIndex> drawn;
  GroupBatches::Drawing drawing;
  for (const GroupIndex g : CertifiedCulling(regions).visible(camera_of(shot)).visible_groups)
    if (frustum.may_show(lab.batches.box(g))) {
      drawn.push_back(g);
      lab.batches.add_to(g, drawing);
    }
  // Nothing that is seen is left out, so that this is the picture of everything.
  Target picture = empty_target(2 * shot.width_px, 2 * shot.height_px);
  rasterise(picture,
            project_all(look_at(shot.view, picture.width_px, picture.height_px), drawing.vertices),
            drawing.triangles, drawing.objects);
  std::vector<std::uint8_t> has_pixel(lab.batches.groups(), 0);
  for (const std::uint32_t object : picture.object)
    if (object != kNone && lab.scene.groups.group_of_triangle[object] != kNone)
      has_pixel[lab.scene.groups.group_of_triangle[object]] = 1;
  Left left;
  for (const GroupIndex g : drawn) {
    const auto triangles = lab.batches.triangles(g);
    const auto count = static_cast<double>(triangles.size());
    if (has_pixel[g]) {
      left.with_pixel += count;
      continue;
    }
    const auto sights = judge_each(lab.scene.index, shot.view.eye, triangles);
    bool is_seen = false, is_in_picture = false;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (sights[i] != TriangleSight::kVisible) continue;
      is_seen = true;
      std::array<Position, 3> corners;
      for (std::size_t c = 0; c < 3; ++c)
        corners[c] = lab.scene.tin.vertices[lab.scene.tin.triangles[triangles[i]][c]];
      is_in_picture |= frustum.may_show(bounds_of(corners));
    }
    const CertifiedGroup& group = regions.groups[g];
    const bool is_around = std::hypot(shot.view.eye.x_m - group.centre_x_m,
                                      shot.view.eye.y_m - group.centre_y_m) <= group.radius_m;
    (is_in_picture ? left.seen
     : is_seen     ? left.seen_beside
     : is_around   ? left.around_camera
                   : left.not_proved) += count;
  }
  return left;
}

void left(const std::string& path, Route route, int frames, int seeds) {
  fmt::print(
      "| seed | frames | with a pixel | seen by less | seen beside the picture | around the camera "
      "| not proved | times those with a pixel | times those seen |\n"
      "|---|---|---|---|---|---|---|---|---|\n");
  for (int seed = 1; seed <= seeds; ++seed) {
    const Laboratory lab(path, route, frames, static_cast<std::uint64_t>(seed));
    Left sum;
    for (const Shot& shot : lab.plan.shots) {
      const Left frame = left_of(lab, shot);
      sum.with_pixel += frame.with_pixel, sum.seen += frame.seen;
      sum.seen_beside += frame.seen_beside, sum.around_camera += frame.around_camera;
      sum.not_proved += frame.not_proved;
    }
    const double n = static_cast<double>(lab.plan.shots.size());
    const double seen = sum.with_pixel + sum.seen;
    const double all = seen + sum.seen_beside + sum.around_camera + sum.not_proved;
    fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.0f} | {:.2f} | {:.2f} |\n", seed,
               lab.plan.shots.size(), sum.with_pixel / n, sum.seen / n, sum.seen_beside / n,
               sum.around_camera / n, sum.not_proved / n, all / sum.with_pixel, all / seen);
  }
}

Route route_named(const std::string& name) {
  if (name == "street") return Route::kStreet;
  if (name == "drive") return Route::kDrive;
  if (name == "helicopter") return Route::kHelicopter;
  return name == "airliner" ? Route::kAirliner : Route::kWalk;
}

}  // namespace

int main(int count, char** arguments) {
  const std::string what = count > 1 ? arguments[1] : "";
  if (count < 4 || (what != "wang" && what != "grundhoefer" && what != "left")) {
    fmt::print(stderr,
               "usage: laboratory_table wang|grundhoefer|left SCENE ROUTE [FRAMES [SEEDS]]\n");
    return 2;
  }
  // Others may use the other processors: what is measured is what one thread takes.
  set_thread_count(1);
  const Route route = route_named(arguments[3]);
  const int frames = count > 4 ? std::max(2, std::atoi(arguments[4])) : 100;
  if (what == "left") {
    left(arguments[2], route, frames, count > 5 ? std::atoi(arguments[5]) : 1);
    return 0;
  }
  const Laboratory lab(arguments[2], route, frames);
  (what == "wang" ? wang : grundhoefer)(lab);
}
