// Repeats the experiment of Law and Tan 1999 for docs/lawtan.md.
//   lawtan_table towers COUNT WIDTH_M HEIGHT_M     round buildings over such ground, as CSV
//   lawtan_table walk SCENE ROUTE LEVELS FRAMES [CSV]  a row of each table: occluders, cells, a
//   drive lawtan_table correction SCENE                  how often edge error correction hides what
//   is seen lawtan_table views SCENE FRAME SVG             the refined surface from above, without
//   and with
//                                                  culling

#include <fmt/core.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <numbers>
#include <set>
#include <string>

#include "cli/fly/flight_path.h"
#include "cli/loaded_scene.h"
#include "cli/stage_clock.h"
#include "cli/svg.h"
#include "core/culling/cell_culling.h"
#include "core/culling/certified_culling.h"
#include "core/culling/certified_hiding.h"
#include "core/culling/joint_hiding.h"
#include "core/culling/occluder_hiding.h"
#include "core/culling/selective_refinement.h"
#include "core/occlusion/edge_correction.h"
#include "core/occlusion/splitmix64.h"
#include "core/occlusion/virtual_occluders.h"
#include "core/raster/rasterise.h"
#include "core/sight/triangle_sight.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr int kTowerCorners = 32;
/// Pixels that the refined surface may be off.
constexpr double kMostPx = 1;
constexpr double kViewMostPx = 3;
constexpr Lens kLens{640, 360, 45};
/// Cells that are made when the drive comes into them, not before.
constexpr int kFineLevels = 11;
/// Depths that differ by less belong to one place.
constexpr float kDepthShare = 0.01F;

/// Of the processor, on all threads: what else runs on the machine does not count.
double seconds_of(const std::function<void()>& work) {
  const std::clock_t begun = std::clock();
  work();
  return static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
}

void print_towers(int count, double width_m, double height_m) {
  SplitMix64 random(kSeed);
  const auto unit = [&] { return static_cast<double>(random.below(1U << 24)) / (1U << 24); };
  fmt::print("WKT,height\n");
  for (int i = 0; i < count; ++i) {
    const double radius_m = width_m * (0.006 + 0.012 * unit());
    const double x_m = width_m * (0.05 + 0.9 * unit()), y_m = height_m * (0.05 + 0.9 * unit());
    const double roof_m = radius_m * (0.5 + unit());
    fmt::print("\"POLYGON((");
    for (int k = 0; k <= kTowerCorners; ++k) {
      const double turn_rad = 2 * std::numbers::pi * (k % kTowerCorners) / kTowerCorners;
      fmt::print("{}{:.2f} {:.2f}", k > 0 ? "," : "", x_m + radius_m * std::cos(turn_rad),
                 y_m + radius_m * std::sin(turn_rad));
    }
    fmt::print("))\",{:.1f}\n", roof_m);
  }
}

/// A scene and what is found in it before the walk.
struct Walk {
  LoadedScene scene;
  GroupBatches batches;
  BoxTree tree;
  std::vector<Shot> shots;

  Walk(const std::string& path, Route route, int frames)
      : scene(path, {machine_memory_bytes()}), batches(scene.tin, scene.groups), tree(batches) {
    const GeoFrame::Placer placer(scene.frame);
    for (const Waypoint& waypoint : find_path(flown(scene), route, frames, kSeed))
      shots.push_back(shot_at(placer, waypoint, kLens));
  }

  /// @param levels  of cells, the root's is the first
  std::vector<CellSpace> ground_cells(int levels) const {
    const Bounds ground = bounds_of(scene.tin.vertices);
    const double width_m = ground.high.x_m - ground.low.x_m;
    return {walk_and_flight(scene.tin, width_m / std::exp2(levels - 1)).front()};
  }

  std::unique_ptr<NodeHiding> both() const {
    return std::make_unique<JointHiding>(
        std::make_unique<CertifiedHiding>(tree, scene.groups.certified),
        std::make_unique<OccluderHiding>(tree, batches, scene.tin,
                                         find_virtual_occluders(scene.tin, {}).sections));
  }
};

struct Frames {
  std::vector<double> triangles, frame_ms;  // [frames]
  std::uint64_t nodes = 0;
  std::uint64_t differing_px = 0, holes_px = 0;

  static double sum(const std::vector<double>& of) {
    double sum = 0;
    for (const double value : of) sum += value;
    return sum;
  }
};

Target draw(const Tin& tin, const SelectiveRefinement::Drawing& drawing, const Shot& shot) {
  Target target = empty_target(shot.width_px, shot.height_px);
  rasterise(target, project_all(look_at(shot.view, shot.width_px, shot.height_px), tin.vertices),
            drawing.triangles, drawing.objects);
  return target;
}

/// Groups with a pixel in a picture of all triangles, four times as fine.
CullingAnswer groups_seen(const Walk& walk, const Shot& shot) {
  const Tin& tin = walk.scene.tin;
  Target target = empty_target(2 * shot.width_px, 2 * shot.height_px);
  rasterise(target,
            project_all(look_at(shot.view, target.width_px, target.height_px), tin.vertices),
            tin.triangles);
  std::vector<std::uint8_t> is_seen(walk.batches.groups(), 0);
  for (const std::uint32_t object : target.object)
    if (object != kNone && walk.scene.groups.group_of_triangle[object] != kNone)
      is_seen[walk.scene.groups.group_of_triangle[object]] = 1;
  CullingAnswer answer;
  for (GroupIndex g = 0; g < is_seen.size(); ++g)
    if (is_seen[g]) answer.visible_groups.push_back(g);
  return answer;
}

/// What may be seen of a frame, and how many nodes were looked at.
using Find = std::function<CullingAnswer(std::size_t frame)>;

/// @param find  none: without culling
Frames walk(const Walk& walk, const SelectiveRefinement& refinement, const Find& find,
            const std::function<void(std::size_t, const Target&)>& see) {
  Frames frames;
  for (std::size_t f = 0; f < walk.shots.size(); ++f) {
    Target picture;
    frames.frame_ms.push_back(1000 * seconds_of([&] {
                                const Shot& shot = walk.shots[f];
                                std::optional<std::span<const GroupIndex>> visible;
                                CullingAnswer answer;
                                if (find) {
                                  answer = find(f);
                                  visible = answer.visible_groups;
                                  frames.nodes += answer.nodes_tested;
                                }
                                const auto drawing = refinement.draw(shot, kMostPx, visible);
                                frames.triangles.push_back(
                                    static_cast<double>(drawing.triangles.size()));
                                picture = draw(walk.scene.tin, drawing, shot);
                              }));
    see(f, picture);
  }
  return frames;
}

/// Pixels of a culled picture that show another place than those of the whole one, and of those
/// the ones that show nothing.
void compare(const Target& whole, const Target& culled, Frames& frames) {
  for (std::size_t i = 0; i < whole.depth.size(); ++i) {
    const float a = whole.depth[i], b = culled.depth[i];
    if (std::abs(a - b) <= kDepthShare * std::max(a, b)) continue;
    ++frames.differing_px;
    frames.holes_px += b == 0;
  }
}

void print_frames(const char* name, const Frames& frames, const Frames& whole) {
  const double count = static_cast<double>(frames.triangles.size());
  fmt::print("  {:<28} {:>8.0f} triangles a frame ({:>5.1f} %) {:>7.2f} s ({:>4.0f} % faster)",
             name, Frames::sum(frames.triangles) / count,
             100 * Frames::sum(frames.triangles) / Frames::sum(whole.triangles),
             Frames::sum(frames.frame_ms) / 1000,
             100 - 100 * Frames::sum(frames.frame_ms) / Frames::sum(whole.frame_ms));
  fmt::print(
      ", {:.1f} nodes a frame, {:.4f} % of pixels differ, {} are holes\n",
      static_cast<double>(frames.nodes) / count,
      100 * static_cast<double>(frames.differing_px) / count / kLens.width_px / kLens.height_px,
      frames.holes_px);
}

void print_walk(const std::string& path, Route route, int levels, int count,
                const std::string& csv) {
  const Walk scene(path, route, count);
  const Tin& tin = scene.scene.tin;
  VirtualOccluders occluders;
  const double simplify_s = seconds_of([&] { occluders = find_virtual_occluders(tin, {}); });
  const auto broken = check_under(occluders.mesh.tin, tin);
  fmt::print(
      "  {} triangles, {} groups; {} triangles of virtual occluders, {} sections, {:.1f} s; {}\n",
      tin.triangles.size(), scene.scene.groups.leaf_count, occluders.mesh.tin.triangles.size(),
      occluders.sections.size(), simplify_s, broken ? *broken : "nowhere above the ground");

  std::optional<SelectiveRefinement> refinement;
  const double levels_s = seconds_of([&] { refinement.emplace(tin, scene.scene.groups); });
  const auto cells_of = [&](const char* name, std::unique_ptr<NodeHiding> hiding) {
    std::unique_ptr<CellCulling> cells;
    const double prepare_s = seconds_of([&] {
      cells = std::make_unique<CellCulling>(name, std::move(hiding), scene.ground_cells(levels));
      cells->trees()[0].divide_all();
    });
    fmt::print("  {}: {} cells of {} levels, {:.1f} s, {:.0f} kB\n", name, cells->trees()[0].size(),
               levels, prepare_s, static_cast<double>(cells->bytes()) / 1000);
    return cells;
  };
  const auto law_tan = cells_of(
      "virtual occluders",
      std::make_unique<OccluderHiding>(scene.tree, scene.batches, tin, occluders.sections));
  std::unique_ptr<CellCulling> certified;
  if (scene.scene.groups.has_certified())
    certified = cells_of("certified regions", std::make_unique<CertifiedHiding>(
                                                  scene.tree, scene.scene.groups.certified));

  fmt::print("  levels of detail {:.1f} s; {} frames, {} px\n", levels_s, scene.shots.size(),
             kMostPx);
  std::vector<Target> pictures;
  const Frames whole = walk(scene, *refinement, {}, [&](std::size_t, const Target& picture) {
    pictures.push_back(picture);
    pictures.back().object.clear();
  });
  print_frames("without culling", whole, whole);
  const auto with = [&](const char* name, const Find& find) {
    Frames differing;
    Frames frames = walk(scene, *refinement, find, [&](std::size_t f, const Target& picture) {
      compare(pictures[f], picture, differing);
    });
    frames.differing_px = differing.differing_px;
    frames.holes_px = differing.holes_px;
    print_frames(name, frames, whole);
    return frames;
  };
  const auto by = [&](CullingMethod& method) {
    return [&](std::size_t f) { return method.visible(camera_of(scene.shots[f])); };
  };
  const Frames by_occluders = with("cells, virtual occluders", by(*law_tan));
  std::optional<Frames> by_certified;
  if (certified) {
    by_certified = with("cells, certified regions", by(*certified));
    CellCulling fine("both", scene.both(), scene.ground_cells(kFineLevels));
    with("both, fine cells on the way", by(fine));
    fmt::print("    {} of these cells, {:.0f} kB\n", fine.trees()[0].size(),
               static_cast<double>(fine.bytes()) / 1000);
    CertifiedCulling each(scene.scene.groups.certified);
    with("certified regions themselves", by(each));
  }
  std::vector<CullingAnswer> seen;
  for (const Shot& shot : scene.shots) seen.push_back(groups_seen(scene, shot));
  with("groups that are seen", [&](std::size_t f) { return seen[f]; });
  if (csv.empty()) return;
  std::ofstream file(csv);
  file << "frame,triangles,triangles_law_tan,triangles_certified,ms,ms_law_tan,ms_certified\n";
  for (std::size_t f = 0; f < whole.triangles.size(); ++f)
    file << fmt::format("{},{:.0f},{:.0f},{:.0f},{:.3f},{:.3f},{:.3f}\n", f, whole.triangles[f],
                        by_occluders.triangles[f], by_certified ? by_certified->triangles[f] : NAN,
                        whole.frame_ms[f], by_occluders.frame_ms[f],
                        by_certified ? by_certified->frame_ms[f] : NAN);
}

/// A line a method, over the frames, of columns `first` on.
std::string curves(const std::vector<std::vector<double>>& rows, std::size_t first, double top_px,
                   const char* title) {
  constexpr double kLeftPx = 60, kWidePx = 760, kHighPx = 180;
  constexpr const char* kColours[] = {kSoftColour, "#c8102e", "#0b6fb8"};
  double most = 0;
  for (const auto& row : rows)
    for (std::size_t i = 0; i < 3; ++i) most = std::max(most, row[first + i]);
  std::string out = svg_text(kLeftPx, top_px - 8, "start", kInkColour, 13, title);
  const double step = round_step(most, 4);
  for (double tick = 0; tick <= most; tick += step) {
    const double y_px = top_px + kHighPx * (1 - tick / most);
    out += fmt::format("<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n",
                       kLeftPx, kLeftPx + kWidePx, y_px, y_px, kFaintColour);
    out += svg_text(kLeftPx - 6, y_px + 4, "end", kSoftColour, 11, fmt::format("{:g}", tick));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    out += fmt::format("<polyline fill=\"none\" stroke=\"{}\" points=\"", kColours[i]);
    for (std::size_t f = 0; f < rows.size(); ++f)
      out += fmt::format(
          "{:.1f},{:.1f} ",
          kLeftPx + kWidePx * static_cast<double>(f) / static_cast<double>(rows.size() - 1),
          top_px + kHighPx * (1 - rows[f][first + i] / most));
    out += "\"/>\n";
  }
  return out;
}

void write_curves(const std::string& csv, const std::string& svg) {
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(file, line)) {
    std::vector<double>& row = rows.emplace_back();
    for (std::size_t at = 0; at < line.size(); at = line.find(',', at), at += at < line.size())
      row.push_back(std::strtod(line.c_str() + at, nullptr));
  }
  std::string out = svg_begin(840, 500);
  out += curves(rows, 1, 40, "Triangles a frame, refined to 1 px");
  out += curves(rows, 4, 265, "Time of a frame, processor ms");
  out += svg_text(60, 480, "start", kSoftColour, 13, "without culling");
  out += svg_text(200, 480, "start", "#c8102e", 13, "cells, virtual occluders");
  out += svg_text(400, 480, "start", "#0b6fb8", 13, "cells, certified regions");
  std::ofstream(svg) << out << "</svg>\n";
}

void print_correction(const std::string& path) {
  const Walk scene(path, Route::kDrive, 1);
  const Tin& tin = scene.scene.tin;
  CollapseOptions options;
  options.triangles_left = tin.triangles.size() / 10;
  const Tin coarse = simplified(tin, collapse_edges(tin, options));
  const auto corrected = correct_edges(coarse, scene.scene.index, 1000);
  const auto ours = find_virtual_occluders(tin, {});
  SplitMix64 random(kSeed);
  std::uint64_t claims = 0, wrong = 0, ours_hidden = 0, ours_wrong = 0;
  for (int i = 0; i < 20; ++i) {
    Position eye = tin.vertices[random.below(tin.vertices.size())];
    eye.z_m += i % 2 == 0 ? 2 : 300;
    for (GroupIndex g = 0; g < scene.batches.groups(); ++g) {
      const Bounds& box = scene.batches.box(g);
      bool is_hidden = false, is_ours = false;
      for (const CorrectedTriangle& triangle : corrected)
        if (!is_hidden) is_hidden = claims_to_hide(triangle, eye, box);
      for (const UprightOccluder& section : ours.sections)
        if (!is_ours) is_ours = section.judge({eye, eye}, box) == FullOcclusion::kHidden;
      bool is_seen = false;
      if (is_hidden || is_ours)
        for (const TriangleSight sight :
             judge_each(scene.scene.index, eye, scene.batches.triangles(g)))
          is_seen |= sight == TriangleSight::kVisible;
      claims += is_hidden;
      wrong += is_hidden && is_seen;
      ours_hidden += is_ours;
      ours_wrong += is_ours && is_seen;
    }
  }
  fmt::print(
      "  edge error correction: {} groups hidden, {} of them seen; one-sided sections: {} "
      "hidden, {} seen\n",
      claims, wrong, ours_hidden, ours_wrong);
}

void write_views(const std::string& path, std::size_t frame, const std::string& svg) {
  const Walk scene(path, Route::kDrive, static_cast<int>(frame) + 1);
  const Tin& tin = scene.scene.tin;
  const SelectiveRefinement refinement(tin, scene.scene.groups);
  CellCulling cells("both", scene.both(), scene.ground_cells(kFineLevels));
  const Shot& shot = scene.shots.back();
  const CullingAnswer answer = cells.visible(camera_of(shot));
  const Bounds ground = bounds_of(tin.vertices);
  const double wide_px = 460, scale = wide_px / (ground.high.x_m - ground.low.x_m);
  const double high_px = scale * (ground.high.y_m - ground.low.y_m);
  std::string out = svg_begin(2 * wide_px + 40, high_px + 50);
  for (const int side : {0, 1}) {
    std::optional<std::span<const GroupIndex>> visible;
    if (side == 1) visible = answer.visible_groups;
    const auto drawing = refinement.draw(shot, kViewMostPx, visible);
    fmt::print("  {} culling: {} triangles in the picture, {} in all\n",
               side == 0 ? "without" : "with", drawing.triangles.size(), drawing.active.size());
    const double left_px = 10 + side * (wide_px + 20);
    const auto x_px = [&](const Position& p) { return left_px + scale * (p.x_m - ground.low.x_m); };
    const auto y_px = [&](const Position& p) { return 40 + scale * (ground.high.y_m - p.y_m); };
    out += svg_text(
        left_px, 25, "start", kInkColour, 14,
        fmt::format("{}: {} triangles in the picture",
                    side == 0 ? "Without culling" : "With culling", drawing.triangles.size()));
    out += fmt::format("<path fill=\"none\" stroke=\"{}\" stroke-width=\"0.4\" d=\"", kSoftColour);
    std::set<std::array<VertexIndex, 2>> edges;
    for (const TriangleIndex t : drawing.active) {
      const auto& corners = refinement.history().triangles[t];
      for (std::size_t i = 0; i < 3; ++i)
        edges.insert({std::min(corners[i], corners[(i + 1) % 3]),
                      std::max(corners[i], corners[(i + 1) % 3])});
    }
    for (const auto& [a, b] : edges)
      out += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", x_px(tin.vertices[a]),
                         y_px(tin.vertices[a]), x_px(tin.vertices[b]), y_px(tin.vertices[b]));
    out += "\"/>\n";
    const double half_rad =
        std::atan(std::tan(kLens.vertical_field_of_view_deg * std::numbers::pi / 360) *
                  kLens.width_px / kLens.height_px);
    const double to_rad = std::atan2(shot.view.target.y_m - shot.view.eye.y_m,
                                     shot.view.target.x_m - shot.view.eye.x_m);
    for (const double turn_rad : {-half_rad, half_rad}) {
      Position end = shot.view.eye;
      const double reach_m = 0.3 * (ground.high.x_m - ground.low.x_m);
      end.x_m += reach_m * std::cos(to_rad + turn_rad);
      end.y_m += reach_m * std::sin(to_rad + turn_rad);
      out += fmt::format(
          "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#c8102e\" "
          "stroke-width=\"1.5\"/>\n",
          x_px(shot.view.eye), y_px(shot.view.eye), x_px(end), y_px(end));
    }
  }
  std::ofstream(svg) << out << "</svg>\n";
}

}  // namespace
}  // namespace scarp

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  // Waiting for work takes processor time too: one thread, so that only work is measured.
  scarp::set_thread_count(1);
  if (what == "towers" && argc == 5)
    scarp::print_towers(std::atoi(argv[2]), std::atof(argv[3]), std::atof(argv[4]));
  else if (what == "walk" && (argc == 6 || argc == 7))
    scarp::print_walk(argv[2],
                      std::string(argv[3]) == "walk" ? scarp::Route::kWalk : scarp::Route::kDrive,
                      std::atoi(argv[4]), std::atoi(argv[5]), argc == 7 ? argv[6] : "");
  else if (what == "correction" && argc == 3)
    scarp::print_correction(argv[2]);
  else if (what == "curves" && argc == 4)
    scarp::write_curves(argv[2], argv[3]);
  else if (what == "views" && argc == 5)
    scarp::write_views(argv[2], static_cast<std::size_t>(std::atoi(argv[3])), argv[4]);
  else
    return 2;
  return 0;
}
