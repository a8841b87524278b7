#include "tests/support/fractal_ground.h"

#include <cmath>

namespace scarp::test {
namespace {

constexpr int kOctaves = 10;
constexpr std::int32_t kLargestCells = 1024;  // from one knot of the coarsest noise to the next
constexpr double kReliefM = 4000;
/// Heights of an octave against those of the one before: mountains are about so rough.
constexpr double kGain = 0.47;

/// SplitMix64's finisher over a knot's name.
double knot(std::uint64_t seed, int octave, std::int32_t column, std::int32_t row) {
  std::uint64_t z = seed + 0x9e3779b97f4a7c15U * static_cast<std::uint64_t>(octave + 1);
  z ^= static_cast<std::uint64_t>(static_cast<std::uint32_t>(column)) << 32 |
       static_cast<std::uint32_t>(row);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z ^= z >> 31;
  return static_cast<double>(z >> 11) * 0x1p-53;
}

double smooth(double t) {
  return t * t * t * (t * (6 * t - 15) + 10);
}

/// Noise of one octave along a row: knots are looked up once for each cell of the octave.
class NoiseRow {
 public:
  NoiseRow(std::uint64_t seed, int octave, std::int32_t row)
      : seed_(seed),
        octave_(octave),
        cells_(kLargestCells >> octave),
        knot_row_(row / cells_),
        down_(smooth(static_cast<double>(row % cells_) / cells_)) {}

  /// In [0, 1].
  double at(std::int32_t column) {
    const std::int32_t knot_column = column / cells_;
    if (knot_column != held_) {
      held_ = knot_column;
      left_ = between(knot_column);
      right_ = between(knot_column + 1);
    }
    const double across = smooth(static_cast<double>(column % cells_) / cells_);
    return left_ + across * (right_ - left_);
  }

 private:
  double between(std::int32_t knot_column) const {
    const double upper = knot(seed_, octave_, knot_column, knot_row_);
    const double lower = knot(seed_, octave_, knot_column, knot_row_ + 1);
    return upper + down_ * (lower - upper);
  }

  std::uint64_t seed_;
  int octave_;
  std::int32_t cells_, knot_row_, held_ = -1;
  double down_, left_ = 0, right_ = 0;
};

}  // namespace

void FractalGround::row(std::int32_t first_column, std::int32_t row,
                        std::span<std::int16_t> heights_m) const {
  NoiseRow octaves[kOctaves] = {{seed_, 0, row}, {seed_, 1, row}, {seed_, 2, row}, {seed_, 3, row},
                                {seed_, 4, row}, {seed_, 5, row}, {seed_, 6, row}, {seed_, 7, row},
                                {seed_, 8, row}, {seed_, 9, row}};
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    const std::int32_t column = first_column + static_cast<std::int32_t>(i);
    double height = 0, gain = 0.5, ridge = 1;
    for (NoiseRow& octave : octaves) {
      // A ridge where the noise crosses its middle; finer ones grow on ridges, not in valleys.
      const double folded = 1 - std::abs(2 * octave.at(column) - 1);
      ridge = folded * folded * (0.25 + 0.75 * ridge);
      height += gain * ridge;
      gain *= kGain;
    }
    heights_m[i] = static_cast<std::int16_t>(std::lround(kReliefM * height));
  }
}

}  // namespace scarp::test
