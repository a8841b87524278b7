#include "core/viewshed/sweep_ground.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

double unevenness(const std::vector<double>& places) {
  double most = 0;
  const double step = (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  for (std::size_t i = 0; i < places.size(); ++i)
    most = std::max(most, std::abs(places.front() + step * static_cast<double>(i) - places[i]));
  return most;
}

/// Around the samples of a window and those beside them.
double steepest_step_m(const GroundGrid& grid, const SampleWindow& window) {
  constexpr std::int32_t kBeside = 2;
  const std::int32_t first_row = std::max(0, window.first_row - kBeside);
  const std::int32_t last_row = std::min(grid.rows() - 1, window.last_row + kBeside);
  const std::int32_t first_column = std::max(0, window.first_column - kBeside);
  const std::int32_t last_column = std::min(grid.columns() - 1, window.last_column + kBeside);
  std::vector<std::int64_t> of_row(static_cast<std::size_t>(last_row - first_row + 1));
  parallel_for(of_row.size(), [&](std::size_t r) {
    const auto row = first_row + static_cast<std::int32_t>(r);
    const std::int32_t* here = grid.row_steps(row);
    const std::int32_t* below = row + 1 < grid.rows() ? grid.row_steps(row + 1) : here;
    std::int64_t most = 0;
    for (std::int32_t c = first_column; c <= last_column; ++c) {
      if (here[c] == GroundGrid::kVoid) continue;
      for (const std::int32_t next : {c + 1 < grid.columns() ? here[c + 1] : here[c], below[c]})
        if (next != GroundGrid::kVoid)
          most = std::max(most, std::abs(static_cast<std::int64_t>(next) - here[c]));
    }
    of_row[r] = most;
  });
  return static_cast<double>(*std::max_element(of_row.begin(), of_row.end())) * kLatticeStepM;
}

/// No value of a biquadratic in its block, and up to a sample beyond, is greater.
double most_of(const BlockPlacement::Biquadratic& k) {
  constexpr double kBeyondBlock = 2;  // of the squares, and ample
  double sum = 0;
  for (const double coefficient : k) sum += std::abs(coefficient);
  return kBeyondBlock * sum;
}

}  // namespace

SweepGround::SweepGround(const GridSight& of_sight, const SweptGround& ground, double height_m,
                         const SampleWindow& targets, bool for_heights)
    : sight(of_sight),
      blocks(ground.blocks),
      stands(ground.stands),
      apart(&ground.blocks != &ground.stands),
      deciding(ground.deciding),
      target_height_m(height_m),
      window(targets) {
  const PlanFrame& frame = sight.frame();
  if (const auto* separable = std::get_if<SeparablePlacement>(&blocks.placement())) {
    for (const double x : separable->x_of_column_m)
      across_of_column.push_back(frame.across(x, frame.eye_y_m));
    for (const double y : separable->y_of_row_m)
      down_of_row.push_back(frame.down(frame.eye_x_m, y));
    uneven_samples = std::max(unevenness(across_of_column), unevenness(down_of_row));
  }
  measure_targets(frame);
  // A single eye's heights are wanted of every sample.
  if (for_heights && !ground.least_tops) return;
  // On a ground of their own targets may stand aside of the samples by what is not known here.
  if (apart && std::holds_alternative<BlockPlacement>(blocks.placement())) return;
  constexpr double kMostAside = 4;
  if (most_aside_samples > kMostAside) return;
  least_tops = ground.least_tops;
  tops = ground.tops;
  if (!tops) tops = &own_tops_.emplace(blocks, stands);
}

void SweepGround::measure_targets(const PlanFrame& frame) {
  const auto* bent = std::get_if<BlockPlacement>(&blocks.placement());
  most_raise_m = (bent ? kMostLift : 1) * std::abs(target_height_m) + 2 * kLatticeStepM;
  if (!bent || (target_height_m == 0 && !apart)) return;
  steepest_m = steepest_step_m(blocks, window);
  double most_tilt_x = 0, most_tilt_y = 0;
  for (const BlockPlacement::Block& block : bent->blocks) {
    most_tilt_x = std::max(most_tilt_x, most_of(block[BlockPlacement::kTiltX]));
    most_tilt_y = std::max(most_tilt_y, most_of(block[BlockPlacement::kTiltY]));
  }
  const double x_m = most_tilt_x * most_raise_m, y_m = most_tilt_y * most_raise_m;
  most_aside_samples = std::max(x_m * std::abs(frame.across_x) + y_m * std::abs(frame.across_y),
                                x_m * std::abs(frame.down_x) + y_m * std::abs(frame.down_y));
}

}  // namespace scarp
