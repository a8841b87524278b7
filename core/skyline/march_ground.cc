#include "core/skyline/march_ground.h"

#include <algorithm>
#include <cmath>

#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

inline float greater(float a, float b) {
  return a < b ? b : a;
}

/// to[i] rises to the greatest of from[i + shift], for shift in [least, most], where there is one.
SCARP_FOR_EACH_TARGET
void raise_to_two(std::ptrdiff_t first, std::ptrdiff_t end, std::ptrdiff_t shift,
                  const float* __restrict from, float* __restrict to) {
  for (std::ptrdiff_t i = first; i < end; ++i)
    to[i] = greater(to[i], greater(from[i + shift], from[i + shift + 1]));
}
SCARP_FOR_EACH_TARGET
void raise_to_one(std::ptrdiff_t first, std::ptrdiff_t end, std::ptrdiff_t shift,
                  const float* __restrict from, float* __restrict to) {
  for (std::ptrdiff_t i = first; i < end; ++i) to[i] = greater(to[i], from[i + shift]);
}
SCARP_FOR_EACH_TARGET
void raise_to_two(std::ptrdiff_t first, std::ptrdiff_t end, std::ptrdiff_t shift,
                  const std::uint8_t* __restrict from, std::uint8_t* __restrict to) {
  for (std::ptrdiff_t i = first; i < end; ++i)
    to[i] = static_cast<std::uint8_t>(to[i] | from[i + shift] | from[i + shift + 1]);
}
SCARP_FOR_EACH_TARGET
void raise_to_one(std::ptrdiff_t first, std::ptrdiff_t end, std::ptrdiff_t shift,
                  const std::uint8_t* __restrict from, std::uint8_t* __restrict to) {
  for (std::ptrdiff_t i = first; i < end; ++i)
    to[i] = static_cast<std::uint8_t>(to[i] | from[i + shift]);
}

/// to[i] rises to the magnitude of a rise between ground and ground.
SCARP_FOR_EACH_TARGET
void raise_to_steepness(std::size_t count, const float* __restrict a, const float* __restrict b,
                        float* __restrict to) {
  for (std::size_t i = 0; i < count; ++i) {
    const float rise = a[i] < b[i] ? b[i] - a[i] : a[i] - b[i];
    to[i] = greater(to[i], rise < -MarchGround::kNothing / 10 ? rise : 0);
  }
}

/// Whole lanes from `least` lanes off to `most`, both arrays `count` long; beyond there is nothing.
template <typename Value>
void raise_to(std::size_t count, double least, double most, const Value* from, Value* to) {
  const auto end = static_cast<std::ptrdiff_t>(count);
  auto shift = static_cast<std::ptrdiff_t>(std::ceil(least));
  const auto last = static_cast<std::ptrdiff_t>(std::floor(most));
  while (shift <= last) {
    const bool two = shift < last;
    const std::ptrdiff_t a = std::clamp<std::ptrdiff_t>(-shift, 0, end);
    const std::ptrdiff_t b = std::clamp<std::ptrdiff_t>(end - shift - (two ? 1 : 0), a, end);
    if (two)
      raise_to_two(a, b, shift, from, to);
    else
      raise_to_one(a, b, shift, from, to);
    // The lanes that have only one of two: borders of the padding, of which nothing is known.
    if (two && a > 0) raise_to_one(a - 1, a, shift + 1, from, to);
    if (two && b < end && b + shift >= 0 && b + shift < end)
      raise_to_one(b, b + 1, shift, from, to);
    shift += two ? 2 : 1;
  }
}

}  // namespace

MarchGround::MarchGround(const GroundGrid& grid, March march, bool upside_down)
    : march_(march), upside_down_(upside_down) {
  const bool rows = march == March::kOverRows;
  lines_ = rows ? grid.rows() : grid.columns();
  lanes_ = rows ? grid.columns() : grid.rows();
  constexpr std::size_t kValuesInLine = 16;
  const auto padded = static_cast<std::size_t>(lanes_ + 2 * kPad);
  // An odd number of cache lines, so that a lane's samples do not fall into few sets.
  stride_ = ((padded + kValuesInLine - 1) / kValuesInLine | 1) * kValuesInLine;
  read_heights(grid);
  measure_steepness();
  int level = kLeastLevel;
  do {
    const auto side = std::int32_t{1} << level;
    const auto strips = static_cast<std::size_t>((lines_ + side - 1) / side);
    highest_.emplace_back(strips * stride_);
    if (has_void_) void_.emplace_back(strips * stride_);
  } while ((std::int32_t{1} << level++) < lines_);
}

void MarchGround::read_heights(const GroundGrid& grid) {
  z_ = LargeArray<float>(static_cast<std::size_t>(lines_) * stride_);
  const auto rows = static_cast<std::size_t>(grid.rows());
  std::vector<std::int32_t> low(rows), high(rows);
  std::vector<std::uint8_t> voids(rows);
  parallel_for(rows, [&](std::size_t r) {
    const std::int32_t* steps = grid.row_steps(static_cast<std::int32_t>(r));
    std::int32_t least = std::numeric_limits<std::int32_t>::max();
    std::int32_t most = std::numeric_limits<std::int32_t>::min();
    for (std::int32_t c = 0; c < grid.columns(); ++c) {
      const std::int32_t step = steps[c];
      if (step == GroundGrid::kVoid) {
        voids[r] = 1;
        continue;
      }
      least = std::min(least, step);
      most = std::max(most, step);
    }
    low[r] = least;
    high[r] = most;
  });
  has_void_ = std::find(voids.begin(), voids.end(), 1) != voids.end();
  const std::int64_t least = *std::min_element(low.begin(), low.end());
  const std::int64_t most = *std::max_element(high.begin(), high.end());
  const std::int64_t middle = most >= least ? (least + most) / 2 : 0;
  middle_z_m_ = static_cast<double>(middle) * kLatticeStepM;
  const double reach_m =
      static_cast<double>(std::max<std::int64_t>(most - middle, 0)) * kLatticeStepM;
  rounding_m_ = reach_m < 4095 ? 0 : reach_m * 0x1p-24;
  const double sign = upside_down_ ? -1 : 1;
  const auto value = [&](std::int32_t step) {
    return step == GroundGrid::kVoid
               ? kVoid
               : static_cast<float>(static_cast<double>(step - middle) * kLatticeStepM * sign);
  };
  // Columns become lines in bands, so that what is read and what is written stay in the cache.
  constexpr std::int32_t kBand = 16;
  parallel_for(static_cast<std::size_t>((lines_ + kBand - 1) / kBand), [&](std::size_t band) {
    const std::int32_t first = static_cast<std::int32_t>(band) * kBand;
    const std::int32_t end = std::min(lines_, first + kBand);
    for (std::int32_t l = first; l < end; ++l)
      std::fill_n(&z_[static_cast<std::size_t>(l) * stride_], stride_, kNothing);
    if (march_ == March::kOverRows) {
      for (std::int32_t l = first; l < end; ++l)
        std::transform(grid.row_steps(l), grid.row_steps(l) + lanes_, &z_[base(l)], value);
      return;
    }
    for (std::int32_t lane = 0; lane < lanes_; ++lane) {
      const std::int32_t* steps = grid.row_steps(lane);
      for (std::int32_t l = first; l < end; ++l)
        z_[base(l) + static_cast<std::size_t>(lane)] = value(steps[l]);
    }
  });
}

void MarchGround::measure_steepness() {
  constexpr std::int32_t kBand = 64;
  std::vector<float> most(static_cast<std::size_t>((lines_ + kBand - 1) / kBand));
  parallel_for(most.size(), [&](std::size_t band) {
    std::vector<float> by_lane(stride_, 0);
    const std::int32_t first = static_cast<std::int32_t>(band) * kBand;
    for (std::int32_t l = first; l < std::min(first + kBand, lines_); ++l) {
      const float* line = &z_[static_cast<std::size_t>(l) * stride_];
      raise_to_steepness(stride_ - 1, line, line + 1, by_lane.data());
      if (l + 1 < lines_) raise_to_steepness(stride_, line, line + stride_, by_lane.data());
    }
    most[band] = *std::max_element(by_lane.begin(), by_lane.end());
  });
  constexpr double kRoundingUp = 1 + 1e-6;
  steepest_m_ = *std::max_element(most.begin(), most.end()) * kRoundingUp;
}

void MarchGround::lean(const StripLean& lean) {
  if (has_strips_ && lean == lean_) return;
  lean_ = lean;
  has_strips_ = true;
  make_least_strips();
  for (std::size_t index = 1; index < highest_.size(); ++index) join_strips(index);
}

void MarchGround::make_least_strips() {
  constexpr std::int32_t kSide = 1 << kLeastLevel;
  parallel_for(highest_[0].size() / stride_, [&](std::size_t strip) {
    float* to = &highest_[0][strip * stride_];
    std::fill_n(to, stride_, kNothing);
    std::uint8_t* void_to = has_void_ ? &void_[0][strip * stride_] : nullptr;
    std::vector<std::uint8_t> voids(has_void_ ? stride_ : 0);
    if (has_void_) std::fill_n(void_to, stride_, std::uint8_t{0});
    for (std::int32_t i = 0; i < kSide; ++i) {
      const std::int32_t line =
          static_cast<std::int32_t>(strip) * kSide + (lean_.line_step > 0 ? i : kSide - 1 - i);
      if (line >= lines_) continue;
      const float* from = &z_[static_cast<std::size_t>(line) * stride_];
      const double least = lean_of(i), most = least + width(kLeastLevel);
      raise_to(stride_, least, most, from, to);
      if (!has_void_) continue;
      std::transform(from, from + stride_, voids.begin(),
                     [](float z) { return static_cast<std::uint8_t>(is_void(z) ? 1 : 0); });
      raise_to(stride_, least, most, voids.data(), void_to);
    }
  });
}

/// A strip's far half begins where the near one ends, seldom at a whole lane: then the lanes on
/// both sides of that place. Squares have two in each half.
void MarchGround::join_strips(std::size_t index) {
  const std::int32_t half = 1 << (kLeastLevel + static_cast<int>(index) - 1);
  const std::size_t parts = highest_[index - 1].size() / stride_;
  const double far_lanes = lean_of(half);
  const auto join_strip = [&](std::size_t strip) {
    const std::size_t near = 2 * strip + (lean_.line_step > 0 ? 0 : 1);
    const std::size_t far = 2 * strip + (lean_.line_step > 0 ? 1 : 0);
    const auto join = [&](auto& levels, auto nothing) {
      auto* to = &levels[index][strip * stride_];
      const auto raise = [&](std::size_t part, double least, double most) {
        if (part < parts) raise_to(stride_, least, most, &levels[index - 1][part * stride_], to);
      };
      std::fill_n(to, stride_, nothing);
      raise(near, 0, 0);
      raise(far, std::floor(far_lanes), std::ceil(far_lanes));
      if (!lean_.are_squares) return;
      raise(near, half, half);
      raise(far, half, half);
    };
    join(highest_, kNothing);
    if (has_void_) join(void_, std::uint8_t{0});
  };
  // A few are done before other threads have woken.
  constexpr std::size_t kFew = 8;
  const std::size_t strips = highest_[index].size() / stride_;
  if (strips > kFew)
    parallel_for(strips, join_strip);
  else
    for (std::size_t strip = 0; strip < strips; ++strip) join_strip(strip);
}

}  // namespace scarp
