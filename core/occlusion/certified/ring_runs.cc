#include "core/occlusion/certified/ring_runs.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

#include "core/threads/for_each_target.h"

namespace scarp {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr auto kRingCount = static_cast<std::size_t>(kRings);

/// Rings side by side that lose next to nothing by sharing a slope are joined first, to so many.
constexpr std::size_t kMostParts = 24;

/// What joining one ring to the one before may lose, of all that the rings are worth. Doubled until
/// there are few enough parts.
constexpr float kJoiningLoss = 0x1p-11F;

/// A run of use adds more than this of all that the rings are worth: more than sums are rounded by.
constexpr float kOfUse = 1e-5F;

/// Worth of what no way leads to: sums of it stay below every other.
constexpr float kNoWay = -1e30F;

/// The square root of a number from 0 on, to 4 %, from its exponent and mantissa as one number.
inline float about_sqrt(float square) {
  constexpr std::int32_t kHalfBias = 0x1fbd1df5;
  const float root = std::bit_cast<float>((std::bit_cast<std::int32_t>(square) >> 1) + kHalfBias);
  return square > 0 ? root : 0;
}

inline float worth_of(float middle_m, float low_m, float weight, float slope) {
  const float above_m = slope * middle_m - low_m;
  const float high_m = above_m > 0 ? above_m : 0;
  return weight * about_sqrt(high_m < kHeadroomM ? high_m : kHeadroomM);
}

/// Rings that share a slope from the start. Where only some are used, the others repeat the last.
struct Parts {
  std::size_t count = 0;
  std::array<std::uint8_t, kMostParts + 1> first;  ///< and one past the last ring
  std::array<float, kMostParts> slope;             ///< least
};

/// Joins each ring to those before it where that loses no more than `most`.
/// @return whether there are few enough parts
bool join(const RingGround& ground, std::span<const float> slopes, float most, Parts& parts) {
  const auto worth = [&](std::size_t k, float slope) {
    return slope > kNothing ? worth_of(ground.middle_m[k], ground.low_m[k], ground.weight[k], slope)
                            : 0;
  };
  parts.count = 0;
  for (std::size_t k = 0; k < kRingCount; ++k) {
    if (k > 0) {
      float& slope = parts.slope[parts.count - 1];
      float loss = 0;
      if (slopes[k] >= slope)
        loss = worth(k, slopes[k]) - worth(k, slope);
      else
        for (std::size_t i = parts.first[parts.count - 1]; i < k; ++i)
          loss += worth(i, slope) - worth(i, slopes[k]);
      if (loss <= most) {
        slope = std::min(slope, slopes[k]);
        continue;
      }
      if (parts.count == kMostParts) return false;
    }
    parts.first[parts.count] = static_cast<std::uint8_t>(k);
    parts.slope[parts.count++] = slopes[k];
  }
  parts.first[parts.count] = static_cast<std::uint8_t>(kRingCount);
  std::fill(parts.slope.begin() + static_cast<std::ptrdiff_t>(parts.count), parts.slope.end(),
            parts.slope[parts.count - 1]);
  return true;
}

/// [ring][part] what the rings before one are worth with the slope of a part.
using WorthBefore = std::array<std::array<float, kMostParts>, kRingCount + 1>;

SCARP_FOR_EACH_TARGET
void add_up(const float* middle_m, const float* low_m, const float* weight, const float* slopes,
            float (*before)[kMostParts]) {
  for (std::size_t p = 0; p < kMostParts; ++p) before[0][p] = 0;
  for (std::size_t k = 0; k < kRingCount; ++k)
    for (std::size_t p = 0; p < kMostParts; ++p)
      before[k + 1][p] = before[k][p] + worth_of(middle_m[k], low_m[k], weight[k], slopes[p]);
}

/// What is kept of the parts before some end by 0, 1, 2, ... runs, and where the last run begins.
struct Kept {
  float worth[kMostRuns + 1];
  std::int32_t first[kMostRuns + 1];
};

/// The best of the ways that lead to `end` over a last run from each of the parts before it.
/// @param last_run  [end] what the run from a part to `end` is worth
SCARP_FOR_EACH_TARGET
void extend(const Kept* kept, const float* last_run, std::size_t end, Kept& best) {
  float worth[kMostRuns];
  std::int32_t first[kMostRuns];
  for (std::size_t n = 0; n < kMostRuns; ++n) worth[n] = kNoWay, first[n] = 0;
  for (std::size_t a = 0; a < end; ++a)
    for (std::size_t n = 0; n < kMostRuns; ++n) {
      const float way = kept[a].worth[n] + last_run[a];
      first[n] = way > worth[n] ? static_cast<std::int32_t>(a) : first[n];
      worth[n] = way > worth[n] ? way : worth[n];
    }
  best.worth[0] = kNoWay;
  for (std::size_t n = 0; n < kMostRuns; ++n)
    best.worth[n + 1] = worth[n], best.first[n + 1] = first[n];
}

}  // namespace

RingRuns::RingRuns(const RingGround& ground, std::span<const float> slopes) {
  assert(slopes.size() == kRingCount);
  float all = 0;
  for (std::size_t k = 0; k < kRingCount; ++k)
    all += slopes[k] > kNothing
               ? worth_of(ground.middle_m[k], ground.low_m[k], ground.weight[k], slopes[k])
               : 0;
  Parts parts;
  for (float loss = kJoiningLoss; !join(ground, slopes, loss * all, parts);) loss *= 2;
  std::array<float, kMostParts> usable;
  // What hides nothing is not worth anything, wherever the ground is.
  for (std::size_t p = 0; p < kMostParts; ++p) usable[p] = std::max(parts.slope[p], -1e6F);
  WorthBefore before;
  add_up(ground.middle_m.data(), ground.low_m.data(), ground.weight.data(), usable.data(),
         reinterpret_cast<float(*)[kMostParts]>(before.data()));

  std::array<Kept, kMostParts + 1> kept;
  std::fill_n(kept[0].worth, kMostRuns + 1, kNoWay);
  kept[0].worth[0] = 0;
  std::array<float, kMostParts> last_run;
  for (std::size_t end = 1; end <= parts.count; ++end) {
    std::size_t lowest = end - 1;
    for (std::size_t a = end; a-- > 0;) {
      if (parts.slope[a] < parts.slope[lowest]) lowest = a;
      last_run[a] = parts.slope[lowest] > kNothing
                        ? before[parts.first[end]][lowest] - before[parts.first[a]][lowest]
                        : 0;
    }
    extend(kept.data(), last_run.data(), end, kept[end]);
  }
  for (std::size_t count = 1; count <= kMostRuns; ++count) {
    RingRun* run = runs_.data() + count * (count - 1) / 2;
    // Fewer parts than runs: the last runs are those of fewer.
    const std::size_t used = std::min(count, parts.count);
    worth_[count] = kept[parts.count].worth[used];
    std::size_t end = parts.count;
    for (std::size_t n = used; n > 0; --n) {
      const auto begin = static_cast<std::size_t>(kept[end].first[n]);
      const bool is_of_use = kept[end].worth[n] - kept[begin].worth[n - 1] > kOfUse * all;
      const float least = *std::min_element(parts.slope.data() + begin, parts.slope.data() + end);
      run[n - 1] = {parts.first[begin], is_of_use ? least : kNothing};
      end = begin;
    }
    std::fill(run + used, run + count, run[used - 1]);
  }
}

}  // namespace scarp
