#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// A place among the samples, in cells.
struct GridPlace {
  double column = 0;
  double row = 0;
};

/// The ground of a DEM between its samples, bilinear in each cell: between the two readings that
/// the cell's diagonals give. Requires places inside ground cells.
class GroundBetweenSamples {
 public:
  GroundBetweenSamples(const Dem& dem, const SampleGrid& grid) : dem_(dem), grid_(grid) {}

  /// Metres above the height datum of the data.
  double height_m(const GridPlace& p) const {
    const Corners c(*this, p);
    return c.mix([&](std::size_t i) { return dem_.heights_m[i]; });
  }
  /// In the flattened frame, not rounded.
  Position position(const GridPlace& p) const {
    const Corners c(*this, p);
    const auto& at = grid_.positions;
    return {c.mix([&](std::size_t i) { return at[i].x_m; }),
            c.mix([&](std::size_t i) { return at[i].y_m; }),
            c.mix([&](std::size_t i) { return at[i].z_m; })};
  }

 private:
  struct Corners {
    std::size_t upper_left, columns;
    double right, down;

    Corners(const GroundBetweenSamples& ground, const GridPlace& p) {
      const SampleGrid& grid = ground.grid_;
      const std::int32_t c = std::clamp(static_cast<std::int32_t>(p.column), 0, grid.columns - 2);
      const std::int32_t r = std::clamp(static_cast<std::int32_t>(p.row), 0, grid.rows - 2);
      upper_left = grid.index(c, r);
      columns = static_cast<std::size_t>(grid.columns);
      right = p.column - c;
      down = p.row - r;
    }
    template <class Value>
    double mix(const Value& value) const {
      const double upper = value(upper_left) + right * (value(upper_left + 1) - value(upper_left));
      const double lower = value(upper_left + columns) +
                           right * (value(upper_left + columns + 1) - value(upper_left + columns));
      return upper + down * (lower - upper);
    }
  };

  const Dem& dem_;
  const SampleGrid& grid_;
};

/// Parameters in (0, 1), rising, at which the segment p - q crosses grid lines, and the middle of
/// each piece between: between two neighbours the bilinear ground is nearly straight.
inline std::vector<double> profile_parameters(const GridPlace& p, const GridPlace& q) {
  std::vector<double> crossings{0, 1};
  const auto add = [&](double from, double to) {
    const auto [low, high] = std::minmax(from, to);
    for (double line = std::floor(low) + 1; line < high; ++line)
      crossings.push_back((line - from) / (to - from));
  };
  add(p.column, q.column);
  add(p.row, q.row);
  std::sort(crossings.begin(), crossings.end());
  std::vector<double> parameters;
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    if (crossings[i] == crossings[i - 1]) continue;
    parameters.push_back((crossings[i - 1] + crossings[i]) / 2);
    if (i + 1 < crossings.size()) parameters.push_back(crossings[i]);
  }
  return parameters;
}

}  // namespace scarp
