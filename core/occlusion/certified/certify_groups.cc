#include "core/occlusion/certified/certify_groups.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "core/occlusion/certified/ring_runs.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Cameras outside the data count little, but they count.
constexpr double kOutsideWeight = 1e-6;

struct Axis {
  double x, y;
};

/// The rings around a group, sector by sector.
class GroundAround {
 public:
  GroundAround(const HidingBounds& bounds, const LeastGround& ground, GroupIndex group)
      : ground_(ground), circle_(bounds.circle[group]), height_m_(bounds.height_m[group]) {
    for (std::int32_t k = 0; k < kRings; ++k)
      start_m_[static_cast<std::size_t>(k)] =
          ring_start(bounds.layout, k) * kFirstRing * circle_.radius_m;
    start_m_[kRings] = start_m_[kRings - 1] * 1.1;
  }

  RingGround towards(const Axis& direction) const {
    RingGround rings;
    for (std::size_t k = 0; k < kRings; ++k) {
      const double size_m = start_m_[k + 1] - start_m_[k];
      const double middle_m = (start_m_[k] + start_m_[k + 1]) / 2;
      const double x_m = circle_.x_m + direction.x * middle_m;
      const double y_m = circle_.y_m + direction.y * middle_m;
      rings.middle_m[k] = static_cast<float>(middle_m);
      rings.low_m[k] = static_cast<float>(ground_.around(x_m, y_m, size_m) - height_m_);
      rings.weight[k] = static_cast<float>((ground_.is_inside(x_m, y_m) ? 1 : kOutsideWeight) *
                                           middle_m * size_m / (start_m_[0] * start_m_[0]));
    }
    return rings;
  }

  /// Above, there are no cameras.
  double high_slope(std::int32_t ring) const {
    return (ground_.highest_m() + static_cast<double>(kHeadroomM) - height_m_) /
           start_m_[static_cast<std::size_t>(ring)];
  }

 private:
  const LeastGround& ground_;
  const Circle circle_;
  const double height_m_;
  std::array<double, kRings + 1> start_m_{};
};

/// How many runs each sector of a group gets, so that they are worth most together and not more
/// than kMeanSteps in the mean. What one more run adds is smoothed to what a few more add each, so
/// that it falls from run to run; then the runs that add most are taken.
std::vector<std::size_t> share_out(std::span<const RingRuns> sectors) {
  const auto wanted =
      static_cast<std::size_t>(kMeanSteps * static_cast<double>(sectors.size())) - sectors.size();
  std::vector<float> gains;  // [sectors * (kMostRuns - 1)]
  for (const RingRuns& runs : sectors)
    for (std::size_t n = 1; n < kMostRuns;) {
      std::size_t best = n + 1;
      float most = runs.worth(best) - runs.worth(n);
      for (std::size_t to = n + 2; to <= kMostRuns; ++to) {
        const float each = (runs.worth(to) - runs.worth(n)) / static_cast<float>(to - n);
        if (each > most) most = each, best = to;
      }
      for (; n < best; ++n) gains.push_back(most);
    }
  std::vector<float> sorted = gains;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(wanted);
  std::nth_element(sorted.begin(), middle, sorted.end(), std::greater<>());
  const float least = std::max(0.0F, *middle);
  std::vector<std::size_t> counts;
  for (std::size_t s = 0; s < sectors.size(); ++s) {
    const auto first = gains.begin() + static_cast<std::ptrdiff_t>(s * (kMostRuns - 1));
    counts.push_back(1 + static_cast<std::size_t>(std::count_if(
                             first, first + (kMostRuns - 1), [&](float g) { return g > least; })));
  }
  return counts;
}

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

float round_down(double value) {
  return -round_up(-value);
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

/// The steps of some runs: those that say the same as the one before are left out.
SectorSteps coded(const CertifiedGroup& group, std::span<const RingRun> runs) {
  SectorSteps steps{};
  std::size_t count = 0;
  for (const RingRun& run : runs) {
    const std::uint16_t code = slope_code(group, static_cast<double>(run.slope));
    if (count > 0 && code == (steps[count - 1] & (kSlopeCodes - 1))) continue;
    steps[count++] = static_cast<std::uint16_t>(run.first << kSlopeBits | code);
  }
  std::fill(steps.begin() + static_cast<std::ptrdiff_t>(count), steps.end(), steps[count - 1]);
  return steps;
}

void compress_group(const HidingBounds& bounds, const LeastGround& ground,
                    const std::vector<Axis>& directions, GroupIndex g, CertifiedRegions& regions) {
  const auto sectors = static_cast<std::size_t>(regions.layout.sectors);
  const GroundAround around(bounds, ground, g);
  std::vector<RingRuns> all;
  all.reserve(sectors);
  for (std::size_t s = 0; s < sectors; ++s)
    all.emplace_back(around.towards(directions[s]), bounds.at(g, static_cast<std::int32_t>(s)));
  const std::vector<std::size_t> counts = share_out(all);
  std::vector<std::array<RingRun, kMostRuns>> runs(sectors);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t s = 0; s < sectors; ++s) {
    std::ranges::copy(all[s].runs(counts[s]), runs[s].begin());
    for (RingRun& run : std::span(runs[s]).first(counts[s])) {
      // A finer scale is worth more than slopes that are of use to no camera.
      run.slope = std::min(run.slope, round_down(around.high_slope(run.first)));
      if (!(run.slope > -std::numeric_limits<float>::infinity())) continue;
      low = std::min(low, static_cast<double>(run.slope));
      high = std::max(high, static_cast<double>(run.slope));
    }
  }
  CertifiedGroup& group = regions.groups[g];
  const Circle& circle = bounds.circle[g];
  group.centre_x_m = circle.x_m;
  group.centre_y_m = circle.y_m;
  group.height_m = bounds.height_m[g];
  group.radius_m = round_up(circle.radius_m * kFirstRing);
  if (low > high) low = high = 0;
  group.low_slope = round_down(low);
  group.slope_step = round_up((high - static_cast<double>(group.low_slope)) / (kSlopeCodes - 2));
  for (std::size_t s = 0; s < sectors; ++s)
    regions.steps[g * sectors + s] = coded(group, std::span(runs[s]).first(counts[s]));
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
