#include "core/occlusion/certified/certify_groups.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr std::size_t kSteps = std::tuple_size_v<SectorSteps>;

/// Bounds far above all ground say no more than those that reach this far above it.
constexpr double kHeadroomM = 2000;

/// Cameras outside the data count little, but they count.
constexpr double kOutsideWeight = 1e-6;

/// Rings are joined one by one where least is lost, until there are so few runs that the best way
/// to join these can be found.
constexpr std::size_t kFewRuns = 20;

/// Sums are taken in so many parts, side by side.
constexpr std::size_t kParts = 8;

struct Axis {
  double x, y;
};

/// A run of rings that share one slope, and what that is worth.
struct Run {
  std::int32_t first;
  double least;  // slope
  double worth;
};

/// What cameras a slope can hide over the ground of rings: sqrt of the height over ground, weighed.
SCARP_FOR_EACH_TARGET
float worth_of_rings(const float* middle_m, const float* low_m, const float* weight, float slope,
                     std::size_t first, std::size_t end) {
  float parts[kParts] = {};
  for (std::size_t k = first; k < end; k += kParts)
    for (std::size_t j = 0; j < kParts; ++j) {
      const float above_m = slope * middle_m[k + j] - low_m[k + j];
      const float high_m = above_m > 0 ? above_m : 0;
      const float reach_m =
          high_m < static_cast<float>(kHeadroomM) ? high_m : static_cast<float>(kHeadroomM);
      const float worth = weight[k + j] * std::sqrt(reach_m);
      parts[j] += k + j < end ? worth : 0;
    }
  float sum = 0;
  for (const float part : parts) sum += part;
  return sum;
}

/// The same for each ring with a slope of its own.
SCARP_FOR_EACH_TARGET
void worth_of_each(const float* middle_m, const float* low_m, const float* weight,
                   const float* slopes, std::size_t count, float* worth) {
  for (std::size_t k = 0; k < count; ++k) {
    const float above_m = slopes[k] * middle_m[k] - low_m[k];
    const float high_m = above_m > 0 ? above_m : 0;
    const float reach_m =
        high_m < static_cast<float>(kHeadroomM) ? high_m : static_cast<float>(kHeadroomM);
    const float of_ring = weight[k] * std::sqrt(reach_m);
    worth[k] = slopes[k] > -std::numeric_limits<float>::infinity() ? of_ring : 0;
  }
}

/// The first of the least numbers.
SCARP_FOR_EACH_TARGET
std::size_t least_index(const double* numbers, std::size_t count) {
  double least[kParts];
  for (double& lane : least) lane = HUGE_VAL;
  std::size_t k = 0;
  for (; k + kParts <= count; k += kParts)
    for (std::size_t j = 0; j < kParts; ++j)
      least[j] = numbers[k + j] < least[j] ? numbers[k + j] : least[j];
  for (; k < count; ++k) least[0] = numbers[k] < least[0] ? numbers[k] : least[0];
  for (std::size_t half = kParts / 2; half > 0; half /= 2)
    for (std::size_t j = 0; j < half; ++j)
      least[j] = least[j + half] < least[j] ? least[j + half] : least[j];
  std::size_t i = 0;
  while (i + 1 < count && !(numbers[i] <= least[0])) ++i;
  return i;
}

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
      middle_m_[k] = static_cast<float>(middle_m);
      low_m_[k] = static_cast<float>(floor_m_[k] - height_m_);
      weight_[k] = static_cast<float>((ground_.is_inside(x_m, y_m) ? 1 : kOutsideWeight) *
                                      middle_m * size_m / (start_m_[0] * start_m_[0]));
    }
  }

  /// Above, there are no cameras.
  double high_slope(std::size_t k) const {
    return (ground_.highest_m() + kHeadroomM - height_m_) / start_m_[k];
  }

  /// Of one slope in rings from `first` to `last`.
  double of(double slope, std::size_t first, std::size_t last) const {
    if (!(slope > -HUGE_VAL)) return 0;
    return static_cast<double>(worth_of_rings(middle_m_.data(), low_m_.data(), weight_.data(),
                                              static_cast<float>(slope), first, last + 1));
  }

  /// Of a slope for each of some rings.
  void of_each(const float* slopes, std::size_t first, std::size_t count, float* worth) const {
    worth_of_each(middle_m_.data() + first, low_m_.data() + first, weight_.data() + first, slopes,
                  count, worth);
  }

 private:
  const LeastGround& ground_;
  const Circle circle_;
  const double height_m_;
  std::array<double, kRings + 1> start_m_{};
  std::array<double, kRings> floor_m_{};
  // As many more as a sum may read beyond the last.
  std::array<float, kRings + kParts> middle_m_{}, low_m_{}, weight_{};
};

/// Shares the rings of a sector out to kSteps runs so that least is lost.
/// Cost: O(kRings + kFewRuns^2 * kSteps) sums over a run.
class Joining {
 public:
  Joining(const Worth& worth, std::span<const float> slopes) : worth_(worth) {
    std::array<float, kRings> each;
    worth.of_each(slopes.data(), 0, kRings, each.data());
    runs_.reserve(kRings);
    for (std::size_t k = 0; k < kRings; ++k)
      runs_.push_back({static_cast<std::int32_t>(k), static_cast<double>(slopes[k]),
                       static_cast<double>(each[k])});
    join_cheapest(slopes);
  }

  std::array<Run, kSteps> join() const {
    // kept[n][end]: the most that n runs keep of what is before `end`; begin: of the last one.
    std::array<std::array<double, kFewRuns + 1>, kSteps + 1> kept;
    std::array<std::array<std::size_t, kFewRuns + 1>, kSteps + 1> begin{};
    for (auto& row : kept) row.fill(-HUGE_VAL);
    kept[0][0] = 0;
    for (std::size_t first = 0; first < kFewRuns; ++first) {
      Run run = runs_[first];
      for (std::size_t end = first + 1; end <= kFewRuns; ++end) {
        if (end > first + 1) run = joined(run, runs_[end - 1], last_of(end - 1));
        for (std::size_t n = 1; n <= kSteps; ++n)
          if (kept[n - 1][first] + run.worth > kept[n][end])
            kept[n][end] = kept[n - 1][first] + run.worth, begin[n][end] = first;
      }
    }
    std::array<Run, kSteps> best;
    std::size_t end = kFewRuns;
    for (std::size_t n = kSteps; n > 0; --n) {
      const std::size_t first = begin[n][end];
      best[n - 1] = runs_[first];
      for (std::size_t i = first + 1; i < end; ++i)
        best[n - 1] = joined(best[n - 1], runs_[i], last_of(i));
      end = first;
    }
    return best;
  }

 private:
  std::size_t last_of(std::size_t run) const {
    return run + 1 < runs_.size() ? static_cast<std::size_t>(runs_[run + 1].first) - 1 : kRings - 1;
  }

  /// @param last  ring of the second run
  Run joined(const Run& run, const Run& next, std::size_t last) const {
    if (next.least >= run.least)
      return {run.first, run.least,
              run.worth + worth_.of(run.least, static_cast<std::size_t>(next.first), last)};
    return {run.first, next.least,
            worth_.of(next.least, static_cast<std::size_t>(run.first),
                      static_cast<std::size_t>(next.first) - 1) +
                next.worth};
  }

  /// @param slopes  of the rings, which are the runs at first
  void join_cheapest(std::span<const float> slopes) {
    std::vector<double> loss(kRings - 1);
    const auto weigh = [&](std::size_t i) {
      loss[i] = runs_[i].worth + runs_[i + 1].worth -
                joined(runs_[i], runs_[i + 1], last_of(i + 1)).worth;
    };
    // Two rings are joined by the lesser slope, which the other ring loses by.
    std::array<float, kRings> lower, before, after;
    for (std::size_t k = 0; k + 1 < kRings; ++k) lower[k] = std::min(slopes[k], slopes[k + 1]);
    worth_.of_each(lower.data(), 0, kRings - 1, before.data());
    worth_.of_each(lower.data(), 1, kRings - 1, after.data());
    for (std::size_t i = 0; i < loss.size(); ++i)
      loss[i] = runs_[i].worth + runs_[i + 1].worth -
                (slopes[i + 1] >= slopes[i] ? runs_[i].worth + static_cast<double>(after[i])
                                            : static_cast<double>(before[i]) + runs_[i + 1].worth);
    while (runs_.size() > kFewRuns) {
      const std::size_t i = least_index(loss.data(), loss.size());
      runs_[i] = joined(runs_[i], runs_[i + 1], last_of(i + 1));
      runs_.erase(runs_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      loss.erase(loss.begin() + static_cast<std::ptrdiff_t>(i));
      if (i < loss.size()) weigh(i);
      if (i > 0) weigh(i - 1);
    }
  }

  const Worth& worth_;
  std::vector<Run> runs_;
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
      if (run.worth <= 0) run.least = -HUGE_VAL;
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
