#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "cli/commands.h"
#include "cli/fly/contenders.h"
#include "cli/fly/flight.h"
#include "cli/fly/flight_page.h"
#include "cli/fly/flight_path.h"
#include "cli/fly/frame_picture.h"
#include "cli/fly/level_flight.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/progress_bar.h"
#include "core/error/error.h"
#include "tiles/layers/png_image.h"
#include "tiles/store/part_folder.h"

namespace scarp {
namespace {

constexpr char kPageName[] = "flight.html";
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
          ? find_path(flown(scene), route_of(options.route), options.frames, options.seed)
          : read_path(options.path_file);
  const FlownGround ground = flown(scene);
  const Prepared prepared(ground, options.methods);
  std::vector<Contender> contenders = contenders_of(ground, prepared, options.methods);
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
