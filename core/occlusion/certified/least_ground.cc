#include "core/occlusion/certified/least_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scarp {
namespace {

constexpr float kEmpty = std::numeric_limits<float>::infinity();

}  // namespace

LeastGround::LeastGround(const Tin& tin) {
  const Bounds bounds = bounds_of(tin.vertices);
  low_x_m_ = bounds.low.x_m, low_y_m_ = bounds.low.y_m;
  high_x_m_ = bounds.high.x_m, high_y_m_ = bounds.high.y_m;
  lowest_m_ = bounds.low.z_m, highest_m_ = bounds.high.z_m;
  const double width_m = bounds.high.x_m - low_x_m_, depth_m = bounds.high.y_m - low_y_m_;
  cell_m_ = std::max(std::sqrt(width_m * depth_m / static_cast<double>(tin.vertices.size())),
                     std::max(width_m, depth_m) / 0x1p14);
  Level level{static_cast<std::int32_t>(width_m / cell_m_) + 1,
              static_cast<std::int32_t>(depth_m / cell_m_) + 1,
              {}};
  level.least_m.assign(
      static_cast<std::size_t>(level.columns) * static_cast<std::size_t>(level.rows), kEmpty);
  for (const Position& p : tin.vertices) {
    const auto column = static_cast<std::size_t>((p.x_m - low_x_m_) / cell_m_);
    const auto row = static_cast<std::size_t>((p.y_m - low_y_m_) / cell_m_);
    float& least_m = level.least_m[row * static_cast<std::size_t>(level.columns) + column];
    least_m = std::min(least_m, static_cast<float>(p.z_m));
  }
  levels_.push_back(std::move(level));
  while (levels_.back().columns > 1 || levels_.back().rows > 1) {
    const Level& below = levels_.back();
    Level above{(below.columns + 1) / 2, (below.rows + 1) / 2, {}};
    above.least_m.assign(
        static_cast<std::size_t>(above.columns) * static_cast<std::size_t>(above.rows), kEmpty);
    for (std::int32_t row = 0; row < below.rows; ++row)
      for (std::int32_t column = 0; column < below.columns; ++column) {
        float& least_m =
            above.least_m[static_cast<std::size_t>(row / 2 * above.columns + column / 2)];
        least_m = std::min(
            least_m,
            below.least_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(below.columns) +
                          static_cast<std::size_t>(column)]);
      }
    levels_.push_back(std::move(above));
  }
}

double LeastGround::around(double x_m, double y_m, double size_m) const {
  const double column = (x_m - low_x_m_) / cell_m_, row = (y_m - low_y_m_) / cell_m_;
  const Level& finest = levels_.front();
  if (!(column >= 0 && row >= 0 && column < finest.columns && row < finest.rows)) return lowest_m_;
  const auto first = static_cast<std::size_t>(std::max(0, std::ilogb(size_m / cell_m_)));
  for (std::size_t i = first; i < levels_.size(); ++i) {
    const Level& level = levels_[i];
    const auto at = static_cast<std::size_t>(static_cast<std::int32_t>(row) >> i) *
                        static_cast<std::size_t>(level.columns) +
                    static_cast<std::size_t>(static_cast<std::int32_t>(column) >> i);
    if (level.least_m[at] != kEmpty) return static_cast<double>(level.least_m[at]);
  }
  return lowest_m_;
}

}  // namespace scarp
