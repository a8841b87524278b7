#pragma once

#include <cstdint>
#include <vector>

#include "cli/view_source.h"

namespace scarp {

/// Heights of a source's samples above the datum of its data, and means over 2 x 2, 4 x 4 and so
/// on, for pictures at any scale. 5.4 bytes a sample.
class HeightPyramid {
 public:
  explicit HeightPyramid(const ViewSource& source);

  struct Level {
    std::int32_t columns = 0, rows = 0;
    std::vector<float> heights_m;  ///< [rows * columns]; NaN void

    /// NaN outside.
    float at(std::int32_t column, std::int32_t row) const;
  };
  /// Level l has a cell for each 2^l x 2^l of the samples; a cell is known where one of them is.
  const std::vector<Level>& levels() const { return levels_; }
  float lowest_m() const { return lowest_m_; }
  float highest_m() const { return highest_m_; }

 private:
  std::vector<Level> levels_;
  float lowest_m_ = 0, highest_m_ = 0;
};

}  // namespace scarp
