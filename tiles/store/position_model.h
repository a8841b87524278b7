#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace scarp {

/// One coordinate of a tile's samples as a smooth function of where they are in the raster and of
/// their height: flattened space bends grid lines and spreads heights, slowly. A polynomial of the
/// fourth degree in column and row, of the second times the height, and its square, leaves about a
/// lattice step of tiles of twenty kilometres.
class PositionModel {
 public:
  static constexpr std::size_t kTerms = 22;
  using Terms = std::array<double, kTerms>;

  static constexpr std::int64_t kMostSteps = std::int64_t{1} << 40;

  /// A sample in the tile, its height or z, and the coordinate that the model is about.
  struct Sample {
    double column, row, height_steps;
    double value_steps;
  };

  /// @param last_column, last_row  greatest of any sample, at least 1: the first is 0
  PositionModel(double last_column, double last_row, const Terms& terms)
      : last_column_(last_column), last_row_(last_row), terms_(terms) {}

  /// Least squares over the samples. The same samples give the same bits. Cost: 1 us a sample.
  static PositionModel fit(double last_column, double last_row, std::span<const Sample> samples);

  /// The coordinate, rounded; 0 where that is not a number below kMostSteps.
  std::int64_t at(const Sample& sample) const;

  const Terms& terms() const { return terms_; }

 private:
  Terms basis(const Sample& sample) const;
  double value(const Sample& sample) const;

  double last_column_, last_row_;
  Terms terms_;
};

}  // namespace scarp
