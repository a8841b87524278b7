#include "core/viewshed/part_sweep.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "core/threads/parallel_for.h"
#include "core/viewshed/least_height.h"
#include "core/viewshed/sweep_ground.h"
#include "core/viewshed/sweep_run.h"

namespace scarp {
namespace {

constexpr std::size_t kWedges = 4;
constexpr auto kParts = static_cast<std::size_t>(SweepPart::kPartsInWedge);

bool is_empty(const SampleWindow& window) {
  return window.last_column < window.first_column || window.last_row < window.first_row;
}

/// Calls body(row, its samples of a raster that lie in the window), on all threads.
template <typename Value, typename Body>
void for_window_rows(const GroundGrid& grid, const SampleWindow& window, std::span<Value> raster,
                     const Body& body) {
  const auto width = static_cast<std::size_t>(window.last_column - window.first_column + 1);
  parallel_for(static_cast<std::size_t>(window.last_row - window.first_row + 1),
               [&](std::size_t r) {
                 const std::size_t row = static_cast<std::size_t>(window.first_row) + r;
                 body(static_cast<std::int32_t>(row),
                      raster.subspan(row * static_cast<std::size_t>(grid.columns()) +
                                         static_cast<std::size_t>(window.first_column),
                                     width));
               });
}

/// What the sweep leaves as it is: hidden, and unknown where void.
void fill_hidden(const SweepGround& ground, std::span<Seen> result) {
  const GroundGrid& grid = ground.blocks;
  const SampleWindow& window = ground.window;
  for_window_rows(grid, window, result, [&](std::int32_t row, std::span<Seen> values) {
    // Without tops to tell by, every known sample is written.
    std::fill(values.begin(), values.end(), ground.tops ? Seen::kHidden : Seen::kUnknown);
    if (!ground.tops) return;
    for (std::int32_t column = window.first_column; column <= window.last_column;) {
      const std::int32_t tile = column / GroundTops::kSide;
      const std::int32_t end = std::min(window.last_column + 1, (tile + 1) * GroundTops::kSide);
      if (ground.tops->of_tile(tile, row / GroundTops::kSide) == GroundTops::kUnknown)
        for (; column < end; ++column)
          if (!grid.is_known(column, row))
            values[static_cast<std::size_t>(column - window.first_column)] = Seen::kUnknown;
      column = end;
    }
  });
}

/// All parts on all threads.
SweepCounts sweep_parts(const SweepGround& ground, const SweepOutput& output) {
  std::array<SweepCounts, kWedges * kParts> counts;
  parallel_for(counts.size(), [&](std::size_t i) {
    const SweepPart part{static_cast<SweepPart::Wedge>(i % kWedges),
                         static_cast<std::int32_t>(i / kWedges)};
    counts[i] = SweepRun(ground, part, output).run();
  });
  SweepCounts sum;
  for (const SweepCounts& of_part : counts) sum.add(of_part);
  return sum;
}

/// The known sample of the window that lies under the eye, which belongs to no part.
struct Under {
  std::int32_t column = 0, row = 0;
  std::size_t index = 0;
};
std::optional<Under> sample_under(const SweepGround& ground) {
  const GroundGrid& grid = ground.blocks;
  const PlanFrame& frame = ground.sight.frame();
  const auto near = [](double at, std::int32_t count) {
    return static_cast<std::int32_t>(std::lround(std::clamp(at, 0.0, count - 1.0)));
  };
  Under under{near(frame.eye_column, grid.columns()), near(frame.eye_row, grid.rows())};
  const Position p = grid.at(under.column, under.row);
  if (frame.across(p.x_m, p.y_m) != 0 || frame.down(p.x_m, p.y_m) != 0 ||
      !ground.window.contains(under.column, under.row) || !grid.is_known(under.column, under.row))
    return {};
  under.index = static_cast<std::size_t>(under.row) * static_cast<std::size_t>(grid.columns()) +
                static_cast<std::size_t>(under.column);
  return under;
}

}  // namespace

SweepCounts sweep_viewshed(const SweptGround& swept, const Position& eye, double target_height_m,
                           const SampleWindow& window, std::span<Seen> result) {
  assert(result.size() == static_cast<std::size_t>(swept.blocks.columns()) *
                              static_cast<std::size_t>(swept.blocks.rows()));
  if (is_empty(window)) return {};
  const GridSight sight(swept.blocks, eye);
  const SweepGround ground(sight, swept, target_height_m, window, false);
  fill_hidden(ground, result);
  SweepCounts counts = sweep_parts(ground, {result, {}});
  if (const auto under = sample_under(ground)) {
    result[under->index] = sight.judge(
        swept.stands.raised(under->column, under->row, target_height_m), under->column, under->row);
    ++counts.targets;
    ++counts.traced_whole;
  }
  return counts;
}

SweepCounts sweep_heights(const SweptGround& swept, const Position& eye, const SampleWindow& window,
                          std::span<float> least_m) {
  assert(least_m.size() == static_cast<std::size_t>(swept.blocks.columns()) *
                               static_cast<std::size_t>(swept.blocks.rows()));
  if (is_empty(window)) return {};
  const GridSight sight(swept.blocks, eye);
  SweptGround without_tops(swept.blocks, swept.stands);
  without_tops.deciding = swept.deciding;
  const SweepGround ground(sight, without_tops, 0, window, true);
  for_window_rows(swept.blocks, window, least_m, [](std::int32_t, std::span<float> values) {
    std::fill(values.begin(), values.end(), std::numeric_limits<float>::quiet_NaN());
  });
  SweepCounts counts = sweep_parts(ground, {{}, least_m});
  if (const auto under = sample_under(ground)) {
    least_m[under->index] = least_height_m(sight, swept.stands, under->column, under->row);
    ++counts.targets;
  }
  return counts;
}

SweepCounts lower_heights(const SweptGround& swept, const Position& eye, const SampleWindow& window,
                          const HeightLimit& limit, std::span<float> least_m) {
  assert(least_m.size() == static_cast<std::size_t>(swept.blocks.columns()) *
                               static_cast<std::size_t>(swept.blocks.rows()));
  assert(swept.least_tops);
  if (is_empty(window)) return {};
  const GridSight sight(swept.blocks, eye);
  const SweepGround ground(sight, swept, 0, window, true);
  SweepCounts counts = sweep_parts(ground, {{}, least_m, swept.least_tops, &limit});
  if (const auto under = sample_under(ground)) {
    float& to = least_m[under->index];
    const float found_m = least_height_m(sight, swept.stands, under->column, under->row);
    if (std::isfinite(found_m)) {
      to = std::fmin(to, limit ? limit(under->column, under->row, found_m) : found_m);
      swept.least_tops->touch(under->column, under->row);
    }
    ++counts.targets;
  }
  swept.least_tops->renew(swept.stands, least_m);
  return counts;
}

}  // namespace scarp
