#include "core/viewshed/ground_tops.h"

#include <algorithm>
#include <cassert>

#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Takes a row of heights into the highest so far.
SCARP_FOR_EACH_TARGET
void take_row(std::size_t count, const std::int32_t* __restrict steps,
              std::int32_t* __restrict highest) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t step = steps[i] == GroundGrid::kVoid ? GroundTops::kUnknown : steps[i];
    highest[i] = highest[i] < step ? step : highest[i];
  }
}

}  // namespace

GroundTops::GroundTops(const GroundGrid& grid, const GroundGrid& other)
    : across_((grid.columns() + kSide - 1) / kSide),
      down_((grid.rows() + kSide - 1) / kSide),
      tops_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_)) {
  assert(grid.columns() == other.columns() && grid.rows() == other.rows());
  const auto columns = static_cast<std::size_t>(grid.columns());
  parallel_for(static_cast<std::size_t>(down_), [&](std::size_t tile_row) {
    const std::int32_t begin = static_cast<std::int32_t>(tile_row) * kSide;
    std::vector<std::int32_t> highest(columns, GroundGrid::kVoid);
    for (std::int32_t row = std::max(0, begin - 1); row <= std::min(grid.rows() - 1, begin + kSide);
         ++row) {
      take_row(columns, grid.row_steps(row), highest.data());
      if (&other != &grid) take_row(columns, other.row_steps(row), highest.data());
    }
    for (std::int32_t tile = 0; tile < across_; ++tile) {
      const std::int32_t first = std::max(0, tile * kSide - 1);
      const std::int32_t last = std::min(grid.columns() - 1, (tile + 1) * kSide);
      tops_[tile_row * static_cast<std::size_t>(across_) + static_cast<std::size_t>(tile)] =
          *std::max_element(highest.begin() + first, highest.begin() + last + 1);
    }
  });
}

}  // namespace scarp
