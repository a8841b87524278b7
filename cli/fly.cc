#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "cli/commands.h"
#include "cli/fly/flight.h"
#include "cli/fly/flight_page.h"
#include "cli/fly/flight_path.h"
#include "cli/fly/frame_picture.h"
#include "cli/fly/level_flight.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "cli/scene_culling.h"
#include "cli/stopwatch.h"
#include "core/culling/box_tree.h"
#include "core/culling/cell_culling.h"
#include "core/culling/certified_hiding.h"
#include "core/culling/image_culling.h"
#include "core/culling/joint_hiding.h"
#include "core/culling/mask_culling.h"
#include "core/culling/object_tiles.h"
#include "core/culling/occluder_hiding.h"
#include "core/culling/query_culling.h"
#include "core/culling/swept_culling.h"
#include "core/error/error.h"
#include "core/occlusion/virtual_occluders.h"
#include "tiles/layers/png_image.h"
#include "tiles/store/part_folder.h"

namespace scarp {
namespace {

/// Everything in the picture: what a scene without culling draws.
class EverythingInView : public CullingMethod {
 public:
  explicit EverythingInView(std::uint32_t groups) {
    for (GroupIndex g = 0; g < groups; ++g) all_.visible_groups.push_back(g);
  }
  std::string_view name() const override { return "frustum"; }
  CullingAnswer visible(const Camera&) override { return all_; }
  bool set_present(std::span<const std::uint8_t> is_present) override {
    all_.visible_groups.clear();
    for (GroupIndex g = 0; g < is_present.size(); ++g)
      if (is_present[g]) all_.visible_groups.push_back(g);
    return true;
  }

 private:
  CullingAnswer all_;
};

constexpr char kPageName[] = "flight.html";
constexpr float kSmallGapOpacity = 0.7F;

/// Of the triangles in view that hom draws as occluders.
constexpr double kEstimateShare = 0.25;

/// What methods are made from; some of them share it.
struct Prepared {
  GroupBatches batches;
  BoxTree tree;
  /// What queries ask for, where one of them flies: groups, large ones in tiles, and their levels.
  ObjectTiles tiles;
  std::optional<GroupBatches> tile_batches;
  std::optional<CoarseBatches> coarse;
  double tiles_s = 0, coarse_s = 0;  ///< to cut, and then to make the levels

  Prepared(const LoadedScene& scene, bool with_tiles, bool with_coarse)
      : batches(scene.tin, scene.groups), tree(batches) {
    const ProcessorStopwatch watch;
    if (with_tiles || with_coarse) {
      tiles = cut_into_tiles(scene.tin, scene.groups);
      tile_batches.emplace(scene.tin, tiles.tiles);
    }
    tiles_s = watch.seconds();
    if (with_coarse) coarse.emplace(*tile_batches, query_shares());
    coarse_s = watch.seconds();
  }

  static std::vector<double> query_shares() {
    return {std::begin(kQueryShares), std::end(kQueryShares)};
  }
};

bool is_wanted(const std::vector<std::string>& wanted, const std::string& method) {
  return wanted.empty() || std::find(wanted.begin(), wanted.end(), method) != wanted.end();
}

/// Cells of view, the smallest an eighth as wide as the mean group is.
std::vector<CellSpace> cells_of_view(const LoadedScene& scene) {
  const Bounds ground = bounds_of(scene.tin.vertices);
  const double area_m2 = (ground.high.x_m - ground.low.x_m) * (ground.high.y_m - ground.low.y_m);
  return walk_and_flight(scene.tin, std::sqrt(area_m2 / std::max(1U, scene.groups.leaf_count)) / 8);
}

/// Virtual occluders, where a method that asks for them flies.
struct SectionsOfScene {
  std::vector<UprightOccluder> sections;
  double prepare_s = 0;

  SectionsOfScene(const Tin& tin, bool are_wanted) {
    if (!are_wanted) return;
    const ProcessorStopwatch watch;
    sections = find_virtual_occluders(tin, {}).sections;
    prepare_s = watch.seconds();
  }

  std::uint64_t bytes() const {
    std::uint64_t bytes = 0;
    for (const UprightOccluder& section : sections) bytes += section.bytes();
    return bytes;
  }
};

std::vector<Contender> contenders_of(const LoadedScene& scene, const Prepared& prepared,
                                     const std::vector<std::string>& wanted) {
  const GroupBatches& batches = prepared.batches;
  std::vector<Contender> all;
  const auto add = [&](const std::string& label, bool is_conservative, double prepare_s,
                       std::uint64_t bytes, auto make) {
    if (is_wanted(wanted, label)) all.push_back({label, is_conservative, prepare_s, bytes, make()});
  };
  add("frustum", true, 0, 0,
      [&] { return std::make_unique<EverythingInView>(scene.groups.leaf_count); });
  for (const char* method : {"thesis", "certified"}) {
    const bool is_certified = std::string(method) == "certified";
    if (is_certified ? scene.groups.has_certified() : has_horizons(scene.scene))
      add(method, is_certified, NAN, region_bytes(scene.groups, method),
          [&] { return culling_method(scene, method); });
  }
  if (scene.groups.has_certified() && is_wanted(wanted, "swept")) {
    auto swept = std::make_unique<SweptCulling>(scene.groups.certified, batches);
    const std::size_t bytes = region_bytes(scene.groups, "certified") + swept->bytes();
    add("swept", true, NAN, bytes, [&] { return std::move(swept); });
  }
  add("hzb", true, 0, 0, [&] { return std::make_unique<HzbCulling>(scene.tin, batches); });
  add("mask", false, 0, 0,
      [&] { return std::make_unique<MaskCulling>(scene.tin, batches, prepared.tree); });
  const SectionsOfScene sections(scene.tin,
                                 is_wanted(wanted, "cells") || is_wanted(wanted, "law-tan"));
  const auto by_occluders = [&] {
    return std::make_unique<OccluderHiding>(prepared.tree, batches, scene.tin, sections.sections);
  };
  const auto cells = [&](const char* label, std::unique_ptr<NodeHiding> hiding) {
    return std::make_unique<CellCulling>(label, std::move(hiding), cells_of_view(scene));
  };
  if (scene.groups.has_certified())
    add("cells", true, sections.prepare_s, sections.bytes(), [&] {
      auto by_regions = std::make_unique<CertifiedHiding>(prepared.tree, scene.groups.certified);
      return cells("cells", std::make_unique<JointHiding>(std::move(by_regions), by_occluders()));
    });
  add("law-tan", true, sections.prepare_s, sections.bytes(),
      [&] { return cells("law-tan", by_occluders()); });
  MaskOptions plain;
  plain.drawing = MaskDrawing::kByCentres;
  add("mask-plain", false, 0, 0,
      [&] { return std::make_unique<MaskCulling>(scene.tin, batches, prepared.tree, plain); });
  ImageCullingOptions hom;
  const auto add_hom = [&](const char* label, DepthTest depth) {
    add(label, false, 0, 0, [&] { return std::make_unique<HomCulling>(batches, depth, hom); });
  };
  hom.occluder_share = kEstimateShare;
  add_hom("hom", DepthTest::kEstimate);
  hom.occluder_share = 1;
  add_hom("hybrid", DepthTest::kPyramid);
  hom.opacity = kSmallGapOpacity;
  add_hom("hom-0.7", DepthTest::kPyramid);
  add("volume-scan", false, 0, 0, [&] { return std::make_unique<VolumeScanCulling>(batches); });
  const auto in_tiles = [&](std::unique_ptr<CullingMethod> method) {
    return std::make_unique<TiledCulling>(prepared.tiles, std::move(method));
  };
  if (prepared.coarse)
    for (const QueryUse use : {QueryUse::kSameFrame, QueryUse::kNextFrame})
      add(use == QueryUse::kSameFrame ? "lod-query" : "multi-frame", false, prepared.coarse_s,
          prepared.coarse->bytes(), [&] {
            return in_tiles(
                std::make_unique<QueryCulling>(*prepared.tile_batches, *prepared.coarse, use));
          });
  if (prepared.tile_batches)
    add("stop-and-wait", false, prepared.tiles_s, 0,
        [&] { return in_tiles(std::make_unique<StopAndWaitCulling>(*prepared.tile_batches)); });
  for (const std::string& name : wanted)
    if (std::none_of(all.begin(), all.end(), [&](const Contender& c) { return c.label == name; }))
      throw Error(ErrorCode::kInput,
                  fmt::format("--methods {}: the scene '{}' was built without it; build with "
                              "--horizon both, or leave it out",
                              name, scene.scene.path()));
  return all;
}

/// Where the scene changes, methods that prepared for it cannot follow.
void keep_those_that_follow(const LoadedScene& scene, std::vector<Contender>& contenders,
                            const std::vector<std::string>& wanted) {
  const std::vector<std::uint8_t> all(scene.groups.leaf_count, 1);
  std::erase_if(contenders, [&](const Contender& contender) {
    if (contender.method->set_present(all)) return false;
    if (!wanted.empty())
      throw Error(ErrorCode::kInput,
                  fmt::format("--methods {}: was prepared for the scene as it is; leave it out, or "
                              "--changes",
                              contender.label));
    return true;
  });
}

Route route_of(const std::string& name) {
  if (name == "street") return Route::kStreet;
  if (name == "walk") return Route::kWalk;
  if (name == "drive") return Route::kDrive;
  return name == "helicopter" ? Route::kHelicopter : Route::kAirliner;
}

/// The frames that are kept as pictures: evenly spread.
bool is_pictured(std::size_t frame, std::size_t frames, int pictures) {
  const auto at = [&](std::size_t f) { return f * static_cast<std::size_t>(pictures) / frames; };
  return pictures > 0 && (frame == 0 || at(frame) != at(frame - 1));
}

/// What levels made of a method's answers, means of a frame.
void add_levels(const LevelFlight& levels, std::size_t contender, std::size_t frames,
                nlohmann::json& method) {
  const LevelSum& sum = levels.sums()[contender];
  const auto mean = [&](double of_all) { return of_all / static_cast<double>(frames); };
  if (levels.plan().refine_px > 0)
    method["refined"] = {{"most_px", levels.plan().refine_px},
                         {"without_culling", mean(static_cast<double>(levels.refined_whole()))},
                         {"by_groups", mean(static_cast<double>(sum.refined))},
                         {"drawn", mean(static_cast<double>(sum.over_outline))},
                         {"ms", mean(sum.refine_ms)},
                         {"other_px", sum.other_px}};
  if (levels.plan().budget > 0)
    method["budget"] = {{"triangles", levels.plan().budget},
                        {"drawn", mean(static_cast<double>(sum.in_budget))},
                        {"level_px", sum.level_px}};
}

nlohmann::json json_of(const Flight& flight, const std::vector<Contender>& contenders,
                       const LevelFlight& levels) {
  nlohmann::json methods = nlohmann::json::array();
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    const FlightSum sum = sum_of(flight, c);
    methods.push_back({{"method", contenders[c].label},
                       {"claims_no_wrong_pixel", contenders[c].is_conservative},
                       {"drawn", sum.drawn},
                       {"in_view", sum.in_view},
                       {"visible", sum.visible},
                       {"in_visible_groups", sum.in_visible_groups},
                       {"find_ms", sum.find_ms},
                       {"draw_ms", sum.draw_ms},
                       {"wrong_px", sum.wrong_px},
                       {"judged_wrong_px", sum.judged_wrong_px},
                       {"missed_groups", sum.missed_groups},
                       {"movers", sum.movers},
                       {"missed_movers", sum.missed_movers},
                       {"bytes", contenders[c].bytes}});
    add_levels(levels, c, flight.truth.size(), methods.back());
  }
  std::uint64_t movers = 0, visible_movers = 0;
  for (const FrameTruth& truth : flight.truth) {
    movers += truth.movers;
    visible_movers += truth.visible_movers;
  }
  return {{"frames", flight.truth.size()},
          {"movers_in_view", movers},
          {"movers_visible", visible_movers},
          {"methods", methods}};
}

void print_table(const Flight& flight, const std::vector<Contender>& contenders) {
  fmt::print("{:<13} {:>9} {:>8} {:>17} {:>9} {:>9} {:>12} {:>7} {:>13}\n", "method", "drawn",
             "of view", "of visible groups", "find, ms", "draw, ms", "wrong pixels", "judged",
             "groups missed");
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    const FlightSum sum = sum_of(flight, c);
    const auto total = [](const auto& by_scale) {
      return std::accumulate(by_scale.begin(), by_scale.end(), std::uint64_t{0});
    };
    fmt::print("{:<13} {:>9.0f} {:>6.1f} % {:>16.2f}x {:>9.3f} {:>9.2f} {:>12} {:>7} {:>13}\n",
               contenders[c].label, sum.drawn, 100 * sum.drawn / std::max(1.0, sum.in_view),
               sum.drawn / std::max(1.0, sum.in_visible_groups), sum.find_ms, sum.draw_ms,
               total(sum.wrong_px), total(sum.judged_wrong_px), sum.missed_groups);
  }
  fmt::print(
      "Drawn: triangles a frame, also as a share of those in view and as a multiple of those in "
      "groups that are seen. Milliseconds are medians of processor time, of all threads. Wrong "
      "pixels: of all frames and sizes; judged: of those, what an "
      "exact ray confirms.\n");
}

void print_levels(const LevelFlight& levels, const std::vector<Contender>& contenders,
                  std::size_t frames) {
  const LevelPlan& plan = levels.plan();
  const auto count = static_cast<double>(frames);
  if (plan.refine_px > 0) {
    const auto whole = static_cast<double>(levels.refined_whole());
    fmt::print(
        "\nRefined to {} px: {:.0f} triangles a frame without culling\n{:<13} {:>9} {:>9} "
        "{:>9} {:>11} {:>12}\n",
        plan.refine_px, whole / count, "method", "by groups", "drawn", "of whole", "refine, ms",
        "other pixels");
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      const LevelSum& sum = levels.sums()[c];
      const auto drawn = static_cast<double>(sum.over_outline);
      fmt::print("{:<13} {:>9.0f} {:>9.0f} {:>7.1f} % {:>11.2f} {:>12}\n", contenders[c].label,
                 static_cast<double>(sum.refined) / count, drawn / count,
                 100 * drawn / std::max(1.0, whole), sum.refine_ms / count, sum.other_px);
    }
  }
  if (plan.budget == 0) return;
  fmt::print("\nWithin {} triangles a frame: pixels by level\n{:<13} {:>9} {:>8} {:>8} {:>8}\n",
             plan.budget, "method", "drawn", "finest", "second", "third");
  for (std::size_t c = 0; c < contenders.size(); ++c) {
    const LevelSum& sum = levels.sums()[c];
    const auto all = static_cast<double>(
        std::accumulate(sum.level_px.begin(), sum.level_px.end(), std::uint64_t{0}));
    fmt::print("{:<13} {:>9.0f}", contenders[c].label, static_cast<double>(sum.in_budget) / count);
    for (const std::uint64_t px : sum.level_px)
      fmt::print(" {:>6.1f} %", 100 * static_cast<double>(px) / std::max(1.0, all));
    fmt::print("\n");
  }
}

}  // namespace

int run_fly(const FlyOptions& options) {
  const LoadedScene scene(options.scene, {options.common.memory_budget_bytes});
  PartFolder folder(options.output, kPageName, existing(options.common));
  const std::vector<Waypoint> path =
      options.path_file.empty()
          ? find_path(scene, route_of(options.route), options.frames, options.seed)
          : read_path(options.path_file);
  const Prepared prepared(
      scene, is_wanted(options.methods, "stop-and-wait"),
      is_wanted(options.methods, "lod-query") || is_wanted(options.methods, "multi-frame"));
  std::vector<Contender> contenders = contenders_of(scene, prepared, options.methods);
  if (options.changes > 0) keep_those_that_follow(scene, contenders, options.methods);

  Lens lens;
  lens.width_px = options.width_px;
  lens.height_px = std::max(1, options.width_px * 9 / 16);
  lens.vertical_field_of_view_deg = options.field_of_view_deg;
  const GeoFrame::Placer placer(scene.frame);
  FlightPlan plan;
  for (const Waypoint& waypoint : path) plan.shots.push_back(shot_at(placer, waypoint, lens));
  plan.movers = make_movers(scene, options.movers, options.route == "street", options.seed);
  plan.changes = options.changes;
  plan.seed = options.seed;

  std::optional<CoarseBatches> coarse;
  if (options.budget > 0) coarse.emplace(prepared.batches, Prepared::query_shares());
  LevelFlight levels(scene.tin, scene.groups, prepared.batches, coarse ? &*coarse : nullptr,
                     {options.refine_px, options.budget}, contenders.size());
  plan.see_groups = [&](std::size_t frame, std::size_t contender,
                        std::span<const GroupIndex> groups) {
    levels.see(plan.shots[frame], contender, groups);
  };

  std::vector<std::pair<std::string, std::string>> pictures;
  ProgressBar bar(!options.common.json);
  const Flight flight = fly(
      scene.index, prepared.batches, plan, contenders,
      [&](std::size_t frame, std::size_t contender, const Target& whole, const Target& drawn) {
        if (!is_pictured(frame, path.size(), options.pictures)) return;
        const Picture picture = frame_picture(scene.tin, scene.groups, whole, drawn);
        const std::string name = fmt::format("frame-{}-{}.png", frame, contenders[contender].label);
        write_png(folder.path_for(name), picture.width_px, picture.height_px, picture.rgb,
                  Existing::kRefuse);
        pictures.emplace_back(
            name, fmt::format("Frame {}, {}: groups by colour, wrong pixels in red", frame,
                              contenders[contender].label));
      },
      bar.stage("fly"));
  bar.clear();
  const std::string way = options.path_file.empty()
                              ? fmt::format("{}, seed {}", options.route, options.seed)
                              : std::filesystem::path(options.path_file).filename().string();
  folder.write("path.csv", to_csv(path));
  folder.write("frames.csv", flight_csv(flight, contenders));
  folder.write(kPageName,
               flight_page(flight, contenders,
                           fmt::format("{} over {}: {} frames of {} x {} pixels", way,
                                       std::filesystem::path(options.scene).filename().string(),
                                       path.size(), lens.width_px, lens.height_px),
                           pictures));
  folder.commit();
  if (options.common.json) {
    fmt::print("{}\n", json_of(flight, contenders, levels).dump(2));
  } else {
    print_table(flight, contenders);
    print_levels(levels, contenders, flight.truth.size());
  }
  return 0;
}

}  // namespace scarp
