#pragma once

#include <cstdint>
#include <vector>

#include "core/terrain/tin.h"

namespace scarp {

/// About how low the ground is around a place: least heights of vertices over squares of several
/// sizes. It tells where cameras can be, and so where finer bounds are worth their cost.
/// Side: none. Nothing that must be safe may depend on it.
class LeastGround {
 public:
  /// Cost: O(vertices).
  explicit LeastGround(const Tin& tin);

  /// Least height near a place, over a square of about size_m; the least of all where there is no
  /// ground. Cost: O(1) to O(levels).
  double around(double x_m, double y_m, double size_m) const;

  bool is_inside(double x_m, double y_m) const {
    return x_m >= low_x_m_ && x_m <= high_x_m_ && y_m >= low_y_m_ && y_m <= high_y_m_;
  }

  double lowest_m() const { return lowest_m_; }
  double highest_m() const { return highest_m_; }

 private:
  struct Level {
    std::int32_t columns, rows;
    std::vector<float> least_m;
  };

  double low_x_m_ = 0, low_y_m_ = 0, high_x_m_ = 0, high_y_m_ = 0, cell_m_ = 1;
  double lowest_m_ = 0, highest_m_ = 0;
  std::vector<Level> levels_;  // each of twice the cell size of the one before
};

}  // namespace scarp
