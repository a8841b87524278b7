#include "core/occlusion/certified/certify_groups.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr std::size_t kSteps = std::tuple_size_v<SectorSteps>;

/// Bounds far above all ground say no more than those that reach this far above it.
constexpr double kHeadroomM = 2000;

/// Cameras outside the data count little, but they count.
constexpr double kOutsideWeight = 1e-6;

struct Axis {
  double x, y;
};

/// A run of rings that share one slope, and what is lost by that.
struct Run {
  std::int32_t first;
  double least;   // slope
  double wanted;  // sum over rings of what their own bounds are worth
  double cost;    // what of it the run's slope loses
};

/// What bounds are worth in one sector: how many cameras they can hide.
class Worth {
 public:
  Worth(const HidingBounds& bounds, const LeastGround& ground, GroupIndex group)
      : ground_(ground), circle_(bounds.circle[group]), height_m_(bounds.height_m[group]) {
    for (std::int32_t k = 0; k < kRings; ++k)
      start_m_[static_cast<std::size_t>(k)] =
          ring_start(bounds.layout, k) * kFirstRing * circle_.radius_m;
    start_m_[kRings] = start_m_[kRings - 1] * 1.1;
  }

  void turn_to(const Axis& direction) {
    for (std::size_t k = 0; k < kRings; ++k) {
      const double size_m = start_m_[k + 1] - start_m_[k];
      const double middle_m = (start_m_[k] + start_m_[k + 1]) / 2;
      const double x_m = circle_.x_m + direction.x * middle_m;
      const double y_m = circle_.y_m + direction.y * middle_m;
      floor_m_[k] = ground_.around(x_m, y_m, size_m);
      weight_[k] = (ground_.is_inside(x_m, y_m) ? 1 : kOutsideWeight) * middle_m * size_m /
                   (start_m_[0] * start_m_[0]);
    }
  }

  /// Slopes that matter in a ring: below, cameras would be under ground; above, there are none.
  double low_slope(std::size_t k) const {
    const double rise_m = floor_m_[k] - height_m_;
    return rise_m / start_m_[rise_m < 0 ? k : k + 1];
  }
  double high_slope(std::size_t k) const {
    return (ground_.highest_m() + kHeadroomM - height_m_) / start_m_[k];
  }

  double of(double slope, std::size_t k) const {
    const double middle_m = (start_m_[k] + start_m_[k + 1]) / 2;
    const double above_m = height_m_ + slope * middle_m - floor_m_[k];
    if (!(above_m > 0)) return 0;
    return weight_[k] * std::sqrt(std::min(above_m, kHeadroomM));
  }

 private:
  const LeastGround& ground_;
  const Circle circle_;
  const double height_m_;
  std::array<double, kRings + 1> start_m_{};
  std::array<double, kRings> floor_m_{}, weight_{};
};

/// Shares the rings of a sector out to kSteps runs so that least is lost.
/// Cost: O(kRings^2 * (kSteps + falls of the slope)).
class Joining {
 public:
  Joining(const Worth& worth, std::span<const float> slopes) : slopes_(slopes) {
    for (std::size_t first = 0; first < kRings; ++first) weigh_runs_from(worth, first);
  }

  std::array<Run, kSteps> join() const {
    // lost[n][end]: the least that n runs lose of the rings before `end`; begin: of the last one.
    std::array<std::array<double, kRings + 1>, kSteps + 1> lost;
    std::array<std::array<std::size_t, kRings + 1>, kSteps + 1> begin{};
    for (auto& row : lost) row.fill(HUGE_VAL);
    lost[0][0] = 0;
    for (std::size_t n = 1; n <= kSteps; ++n)
      for (std::size_t end = n; end <= kRings; ++end)
        for (std::size_t first = n - 1; first < end; ++first) {
          const double loss = lost[n - 1][first] + runs_[first][end - 1].cost;
          if (loss < lost[n][end]) lost[n][end] = loss, begin[n][end] = first;
        }
    std::array<Run, kSteps> joined;
    std::size_t end = kRings;
    for (std::size_t n = kSteps; n > 0; --n) {
      const std::size_t first = begin[n][end];
      joined[n - 1] = runs_[first][end - 1];
      end = first;
    }
    return joined;
  }

 private:
  void weigh_runs_from(const Worth& worth, std::size_t first) {
    double wanted = 0, kept = 0;
    double least = HUGE_VAL;
    for (std::size_t last = first; last < kRings; ++last) {
      const auto slope = static_cast<double>(slopes_[last]);
      // A bound that is of no use here may still let a run pass over the ring.
      if (slope >= worth.low_slope(last)) wanted += worth.of(slope, last);
      if (slope < least) {
        least = slope;
        kept = 0;
        for (std::size_t k = first; k <= last && least > -HUGE_VAL; ++k) kept += worth.of(least, k);
      } else if (least > -HUGE_VAL) {
        kept += worth.of(least, last);
      }
      runs_[first][last] = {static_cast<std::int32_t>(first), least, wanted, wanted - kept};
    }
  }

  std::span<const float> slopes_;
  std::array<std::array<Run, kRings>, kRings> runs_;  // [first][last]
};

/// Middle directions of the sectors.
std::vector<Axis> directions_of(const PolarLayout& layout) {
  std::vector<Axis> axes;
  for (std::int32_t sector = 0; sector < layout.sectors; ++sector) {
    const double azimuth_rad = azimuth_at(layout, sector + 0.5);
    axes.push_back({std::cos(azimuth_rad), std::sin(azimuth_rad)});
  }
  return axes;
}

float round_up(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) >= value
             ? nearest
             : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

std::uint16_t slope_code(const CertifiedGroup& group, double slope) {
  const auto low = static_cast<double>(group.low_slope);
  if (!(slope >= low)) return 0;
  const auto step = static_cast<double>(group.slope_step);
  double code = step > 0 ? std::min(std::floor((slope - low) / step) + 1, kSlopeCodes - 1.0) : 1;
  while (code > 0 && static_cast<double>(slope_of(group, static_cast<std::int32_t>(code))) > slope)
    --code;
  return static_cast<std::uint16_t>(code);
}

void compress_group(const HidingBounds& bounds, const LeastGround& ground,
                    const std::vector<Axis>& directions, GroupIndex g, CertifiedRegions& regions) {
  const auto sectors = static_cast<std::size_t>(regions.layout.sectors);
  Worth worth(bounds, ground, g);
  std::vector<std::array<Run, kSteps>> runs(sectors);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t s = 0; s < sectors; ++s) {
    worth.turn_to(directions[s]);
    runs[s] = Joining(worth, bounds.at(g, static_cast<std::int32_t>(s))).join();
    for (Run& run : runs[s]) {
      // A finer scale is worth more than slopes that are of use to no camera.
      run.least = std::min(run.least, worth.high_slope(static_cast<std::size_t>(run.first)));
      if (run.wanted - run.cost <= 0) run.least = -HUGE_VAL;
      if (run.least == -HUGE_VAL) continue;
      low = std::min(low, run.least);
      high = std::max(high, run.least);
    }
  }
  CertifiedGroup& group = regions.groups[g];
  const Circle& circle = bounds.circle[g];
  group.centre_x_m = circle.x_m;
  group.centre_y_m = circle.y_m;
  group.height_m = bounds.height_m[g];
  group.radius_m = round_up(circle.radius_m * kFirstRing);
  if (low > high) low = high = 0;
  group.low_slope = -round_up(-low);
  group.slope_step = round_up((high - static_cast<double>(group.low_slope)) / (kSlopeCodes - 2));
  for (std::size_t s = 0; s < sectors; ++s) {
    SectorSteps& steps = regions.steps[g * sectors + s];
    for (std::size_t i = 0; i < kSteps; ++i) {
      const Run& run = runs[s][i];
      steps[i] = static_cast<std::uint16_t>(run.first << kSlopeBits | slope_code(group, run.least));
    }
  }
}

}  // namespace

CertifiedRegions compress_bounds(const HidingBounds& bounds, const LeastGround& ground) {
  CertifiedRegions regions;
  regions.layout = bounds.layout;
  regions.groups.resize(bounds.circle.size());
  regions.steps.resize(bounds.circle.size() * static_cast<std::size_t>(bounds.layout.sectors));
  const std::vector<Axis> directions = directions_of(bounds.layout);
  parallel_for(bounds.circle.size(), [&](std::size_t g) {
    compress_group(bounds, ground, directions, static_cast<GroupIndex>(g), regions);
  });
  return regions;
}

CertifiedRegions certify_groups(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                                std::uint32_t groups, const HidingOptions& options,
                                const Progress& progress) {
  if (groups == 0) return {{options.sectors, 2}, {}, {}};
  return compress_bounds(bound_hiding(tin, group_of_triangle, groups, options, progress),
                         LeastGround(tin));
}

}  // namespace scarp
