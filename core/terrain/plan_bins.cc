#include "core/terrain/plan_bins.h"

#include <algorithm>
#include <cmath>

#include "core/terrain/tin.h"

namespace scarp {
namespace {

/// Bins are looked at this much beyond their borders, in bins: far more than rounding.
constexpr double kBeyond = 0x1p-20;

}  // namespace

PlanBins::PlanBins(std::span<const Position> positions, std::size_t things) {
  if (positions.empty()) return;
  const Bounds bounds = bounds_of(positions);
  low_x_m_ = bounds.low.x_m, low_y_m_ = bounds.low.y_m;
  const double width_m = bounds.high.x_m - low_x_m_, depth_m = bounds.high.y_m - low_y_m_;
  const double longest_m = std::max({width_m, depth_m, kLatticeStepM});
  bin_m_ = std::max(std::sqrt(2 * width_m * depth_m / static_cast<double>(things + 1)),
                    longest_m * 0x1p-13);
  columns_ = static_cast<std::int32_t>(width_m / bin_m_) + 1;
  rows_ = static_cast<std::int32_t>(depth_m / bin_m_) + 1;
}

PlanBins::Range PlanBins::rows_over(std::span<const Position> corners) const {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Position& p : corners) {
    low = std::min(low, (p.y_m - low_y_m_) / bin_m_);
    high = std::max(high, (p.y_m - low_y_m_) / bin_m_);
  }
  return {static_cast<std::int32_t>(std::max(0.0, std::floor(low - kBeyond))),
          static_cast<std::int32_t>(std::min(rows_ - 1.0, std::floor(high + kBeyond)))};
}

PlanBins::Range PlanBins::columns_over(std::span<const Position> corners, std::int32_t row) const {
  const double bottom = row - kBeyond, top = row + 1 + kBeyond;
  double low = HUGE_VAL, high = -HUGE_VAL;
  const auto take = [&](double column) {
    low = std::min(low, column);
    high = std::max(high, column);
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Position &p = corners[i], &q = corners[i + 1 == corners.size() ? 0 : i + 1];
    const double px = (p.x_m - low_x_m_) / bin_m_, py = (p.y_m - low_y_m_) / bin_m_;
    const double qx = (q.x_m - low_x_m_) / bin_m_, qy = (q.y_m - low_y_m_) / bin_m_;
    if (py >= bottom && py <= top) take(px);
    for (const double line : {bottom, top})
      if ((py < line) != (qy < line)) take(px + (line - py) / (qy - py) * (qx - px));
  }
  return {static_cast<std::int32_t>(std::max(0.0, std::floor(low - kBeyond))),
          static_cast<std::int32_t>(std::min(columns_ - 1.0, std::floor(high + kBeyond)))};
}

void PlanBins::find(std::span<const Position> corners, std::vector<std::uint32_t>& found) const {
  found.clear();
  visit_bins(corners, [&](std::size_t bin) {
    found.insert(found.end(), held_.begin() + static_cast<std::ptrdiff_t>(first_[bin]),
                 held_.begin() + static_cast<std::ptrdiff_t>(first_[bin + 1]));
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

}  // namespace scarp
