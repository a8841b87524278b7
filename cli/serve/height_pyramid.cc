#include "cli/serve/height_pyramid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr float kVoidHeight = std::numeric_limits<float>::quiet_NaN();

HeightPyramid::Level finest(const ViewSource& source) {
  const GroundGrid& grid = source.samples();
  const Dem& dem = source.dem();
  const bool has_geoid = !dem.frame->description().geoid_file.empty();
  HeightPyramid::Level level{grid.columns(), grid.rows(), {}};
  level.heights_m.resize(static_cast<std::size_t>(grid.columns()) *
                         static_cast<std::size_t>(grid.rows()));
  parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
    const auto row = static_cast<std::int32_t>(r);
    std::optional<GeoFrame::Placer> placer;
    if (has_geoid) placer.emplace(*dem.frame);
    float* out = &level.heights_m[r * static_cast<std::size_t>(grid.columns())];
    for (std::int32_t c = 0; c < grid.columns(); ++c)
      out[c] =
          !grid.is_known(c, row)
              ? kVoidHeight
              : static_cast<float>(grid.height_m(c, row) -
                                   (placer ? placer->undulation_m(dem.x_of(c), dem.y_of(row)) : 0));
  });
  return level;
}

HeightPyramid::Level halved(const HeightPyramid::Level& fine) {
  HeightPyramid::Level level{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
  level.heights_m.resize(static_cast<std::size_t>(level.columns) *
                         static_cast<std::size_t>(level.rows));
  parallel_for(static_cast<std::size_t>(level.rows), [&](std::size_t r) {
    const auto row = static_cast<std::int32_t>(r);
    for (std::int32_t c = 0; c < level.columns; ++c) {
      float sum_m = 0;
      int known = 0;
      for (const std::int32_t down : {0, 1}) {
        for (const std::int32_t right : {0, 1}) {
          const float height_m = fine.at(2 * c + right, 2 * row + down);
          if (std::isnan(height_m)) continue;
          sum_m += height_m;
          ++known;
        }
      }
      level.heights_m[r * static_cast<std::size_t>(level.columns) + static_cast<std::size_t>(c)] =
          known > 0 ? sum_m / static_cast<float>(known) : kVoidHeight;
    }
  });
  return level;
}

}  // namespace

float HeightPyramid::Level::at(std::int32_t column, std::int32_t row) const {
  if (column < 0 || row < 0 || column >= columns || row >= rows) return kVoidHeight;
  return heights_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
}

HeightPyramid::HeightPyramid(const ViewSource& source) {
  levels_.push_back(finest(source));
  bool any = false;
  for (const float height_m : levels_[0].heights_m) {
    if (std::isnan(height_m)) continue;
    lowest_m_ = any ? std::min(lowest_m_, height_m) : height_m;
    highest_m_ = any ? std::max(highest_m_, height_m) : height_m;
    any = true;
  }
  while (levels_.back().columns > 2 || levels_.back().rows > 2)
    levels_.push_back(halved(levels_.back()));
}

}  // namespace scarp
