#include "core/viewshed/bin_history.h"

#include "core/viewshed/line_kernels.h"

namespace scarp {

float* BinHistory::begin_line(std::int32_t line, std::int32_t bins) {
  const auto width = static_cast<std::size_t>(bins);
  if (groups_.empty() || groups_.back().bins != bins ||
      groups_.back().lines == kLinesInBlock * kBlocksInGroup) {
    groups_.push_back(
        {bins, numbers_.size(), 0,
         std::make_unique_for_overwrite<float[]>(kLinesInBlock * kBlocksInGroup * width),
         reach_.size()});
    reach_.resize(reach_.size() + (1 + kBlocksInGroup) * width, kNoGround);
  }
  Group& group = groups_.back();
  numbers_.push_back(line);
  return &group.values[group.lines++ * width];
}

void BinHistory::end_line() {
  const Group& group = groups_.back();
  const auto width = static_cast<std::size_t>(group.bins);
  const float* line = &group.values[(group.lines - 1) * width];
  const std::size_t block = (group.lines - 1) / kLinesInBlock;
  take_maximum(width, line, &reach_[group.reach]);
  take_maximum(width, line, &reach_[group.reach + (1 + block) * width]);
}

}  // namespace scarp
