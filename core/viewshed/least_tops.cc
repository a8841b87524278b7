#include "core/viewshed/least_tops.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/threads/parallel_for.h"
#include "core/viewshed/ground_tops.h"

namespace scarp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double top_of_tile_m(const GroundGrid& stands, std::span<const float> least_m, std::int32_t across,
                     std::int32_t down) {
  const double lift = std::holds_alternative<BlockPlacement>(stands.placement()) ? kMostLift : 1;
  const std::int32_t first_column = across * GroundTops::kSide;
  const std::int32_t end_column = std::min(stands.columns(), first_column + GroundTops::kSide);
  const std::int32_t first_row = down * GroundTops::kSide;
  const std::int32_t end_row = std::min(stands.rows(), first_row + GroundTops::kSide);
  double top_m = -kInfinity;
  for (std::int32_t row = first_row; row < end_row; ++row) {
    const std::int32_t* steps = stands.row_steps(row);
    const float* least =
        &least_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(stands.columns())];
    for (std::int32_t column = first_column; column < end_column; ++column) {
      if (steps[column] == GroundGrid::kVoid) continue;
      if (std::isnan(least[column])) return kInfinity;
      top_m = std::max(top_m,
                       steps[column] * kLatticeStepM + lift * static_cast<double>(least[column]));
    }
  }
  return top_m;
}

}  // namespace

LeastTops::LeastTops(const GroundGrid& stands)
    : across_((stands.columns() + GroundTops::kSide - 1) / GroundTops::kSide),
      down_((stands.rows() + GroundTops::kSide - 1) / GroundTops::kSide),
      tops_m_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_), kInfinity),
      touched_(tops_m_.size()) {}

void LeastTops::touch(std::int32_t column, std::int32_t row) {
  std::atomic<bool>& touched = touched_[index(column / GroundTops::kSide, row / GroundTops::kSide)];
  if (!touched.load(std::memory_order_relaxed)) touched.store(true, std::memory_order_relaxed);
}

void LeastTops::renew(const GroundGrid& stands, std::span<const float> least_m) {
  parallel_for(static_cast<std::size_t>(down_), [&](std::size_t down) {
    for (std::int32_t across = 0; across < across_; ++across) {
      const std::size_t tile = index(across, static_cast<std::int32_t>(down));
      if (!touched_[tile].load(std::memory_order_relaxed)) continue;
      touched_[tile].store(false, std::memory_order_relaxed);
      tops_m_[tile] = top_of_tile_m(stands, least_m, across, static_cast<std::int32_t>(down));
    }
  });
}

}  // namespace scarp
