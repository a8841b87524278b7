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

/// to[i] = the greatest of two lines at i and at i + shift, of count lanes; beyond them nothing.
SCARP_FOR_EACH_TARGET
void greatest_of_four(std::size_t count, std::size_t shift, const float* __restrict first,
                      const float* __restrict second, float* __restrict to) {
  const std::size_t inside = count > shift ? count - shift : 0;
  for (std::size_t i = 0; i < inside; ++i)
    to[i] = greater(greater(first[i], second[i]), greater(first[i + shift], second[i + shift]));
  for (std::size_t i = inside; i < count; ++i) to[i] = greater(first[i], second[i]);
}

SCARP_FOR_EACH_TARGET
void any_of_four(std::size_t count, std::size_t shift, const std::uint8_t* __restrict first,
                 const std::uint8_t* __restrict second, std::uint8_t* __restrict to) {
  const std::size_t inside = count > shift ? count - shift : 0;
  for (std::size_t i = 0; i < inside; ++i)
    to[i] = static_cast<std::uint8_t>(first[i] | second[i] | first[i + shift] | second[i + shift]);
  for (std::size_t i = inside; i < count; ++i)
    to[i] = static_cast<std::uint8_t>(first[i] | second[i]);
}

/// Greatest over squares of 2^kLeastLevel, from that many lines (kNothing where there is none).
template <typename Value, typename Combine>
void reduce_lines(std::vector<std::vector<Value>>& lines, std::size_t count,
                  const Combine& combine) {
  std::size_t shift = 1;
  for (std::size_t left = lines.size(); left > 1; left /= 2, shift *= 2)
    for (std::size_t i = 0; i < left / 2; ++i) {
      std::vector<Value> to(count);
      combine(count, shift, lines[2 * i].data(), lines[2 * i + 1].data(), to.data());
      lines[i] = std::move(to);
    }
}

}  // namespace

MarchGround::MarchGround(const GroundGrid& grid, March march) : march_(march) {
  const bool rows = march == March::kOverRows;
  lines_ = rows ? grid.rows() : grid.columns();
  lanes_ = rows ? grid.columns() : grid.rows();
  constexpr std::size_t kValuesInLine = 16;
  const auto padded = static_cast<std::size_t>(lanes_ + 2 * kPad);
  // An odd number of cache lines, so that a lane's samples do not fall into few sets.
  stride_ = ((padded + kValuesInLine - 1) / kValuesInLine | 1) * kValuesInLine;
  read_heights(grid);
  int level = kLeastLevel;
  do {
    const auto side = std::int32_t{1} << level;
    const auto blocks = static_cast<std::size_t>((lines_ + side - 1) / side);
    highest_.emplace_back(blocks * stride_);
    if (has_void_) void_.emplace_back(blocks * stride_);
    build_level(highest_.size() - 1);
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
  const auto value = [&](std::int32_t step) {
    return step == GroundGrid::kVoid
               ? kVoid
               : static_cast<float>(static_cast<double>(step - middle) * kLatticeStepM);
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

void MarchGround::build_level(std::size_t index) {
  const int level = kLeastLevel + static_cast<int>(index);
  const std::int32_t side = std::int32_t{1} << level;
  const auto blocks = static_cast<std::size_t>((lines_ + side - 1) / side);
  parallel_for(blocks, [&](std::size_t block) {
    float* to = &highest_[index][block * stride_];
    if (index == 0) {
      std::vector<std::vector<float>> heights(static_cast<std::size_t>(side),
                                              std::vector<float>(stride_, kNothing));
      std::vector<std::vector<std::uint8_t>> voids(has_void_ ? static_cast<std::size_t>(side) : 0,
                                                   std::vector<std::uint8_t>(stride_, 0));
      for (std::size_t i = 0; i < static_cast<std::size_t>(side); ++i) {
        const std::size_t line = block * static_cast<std::size_t>(side) + i;
        if (line >= static_cast<std::size_t>(lines_)) break;
        const float* from = &z_[line * stride_];
        for (std::size_t lane = 0; lane < stride_; ++lane) {
          heights[i][lane] = is_ground(from[lane]) ? from[lane] : kNothing;
          if (has_void_) voids[i][lane] = is_void(from[lane]) ? 1 : 0;
        }
      }
      reduce_lines(heights, stride_, greatest_of_four);
      std::copy(heights[0].begin(), heights[0].end(), to);
      if (!has_void_) return;
      reduce_lines(voids, stride_, any_of_four);
      std::copy(voids[0].begin(), voids[0].end(), &void_[index][block * stride_]);
      return;
    }
    // An odd block out stands for both of its pair.
    const std::size_t below = highest_[index - 1].size() / stride_;
    const std::size_t first = 2 * block, second = std::min(2 * block + 1, below - 1);
    const auto shift = static_cast<std::size_t>(side / 2);
    greatest_of_four(stride_, shift, &highest_[index - 1][first * stride_],
                     &highest_[index - 1][second * stride_], to);
    if (has_void_)
      any_of_four(stride_, shift, &void_[index - 1][first * stride_],
                  &void_[index - 1][second * stride_], &void_[index][block * stride_]);
  });
}

}  // namespace scarp
