#include "core/viewshed/bin_history.h"

#include "core/viewshed/line_kernels.h"

namespace scarp {

void BinHistory::begin_slab(std::int32_t first, std::int32_t step, std::int32_t lines,
                            std::int32_t bins) {
  const auto count = static_cast<std::size_t>(lines), width = static_cast<std::size_t>(bins);
  const std::size_t blocks = (count + kLinesInBlock - 1) / kLinesInBlock;
  if (ages_.empty() || ages_.back().bins != bins ||
      ages_.back().end_slab - ages_.back().first_slab == kSlabsInAge)
    ages_.push_back({bins, slabs_.size(), slabs_.size(), std::vector<float>(width, kNoGround)});
  slabs_.push_back({first, step, count, std::vector<float>((1 + blocks) * width, kNoGround),
                    std::make_unique_for_overwrite<float[]>(count * width)});
  ages_.back().end_slab = slabs_.size();
}

float* BinHistory::line(std::int32_t place) {
  return &slabs_.back().values[static_cast<std::size_t>(place) *
                               static_cast<std::size_t>(ages_.back().bins)];
}

void BinHistory::end_line(std::int32_t place, std::int32_t first_bin, std::int32_t end_bin) {
  Slab& slab = slabs_.back();
  const auto width = static_cast<std::size_t>(ages_.back().bins);
  const auto first = static_cast<std::size_t>(first_bin);
  const auto count = static_cast<std::size_t>(end_bin - first_bin);
  const float* up = line(place) + first_bin;
  const std::size_t block = static_cast<std::size_t>(place) / kLinesInBlock;
  take_maximum(count, up, &slab.reach[(1 + block) * width + first]);
  take_maximum(count, up, &slab.reach[first]);
  take_maximum(count, up, &ages_.back().reach[first]);
}

}  // namespace scarp
