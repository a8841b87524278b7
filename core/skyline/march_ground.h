#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/memory/large_array.h"
#include "core/terrain/ground_grid.h"

namespace scarp {

/// Which grid lines a ray is compared with one after the other; it runs at least about as much
/// across them as along them.
enum class March : std::uint8_t { kOverRows, kOverColumns };

/// The samples of a grid laid out for rays that march over its lines: a line is a row (a column), a
/// lane is the place on it, and neighbouring lanes lie side by side in memory, so that one
/// operation serves the rays of many neighbouring cells.
///
/// Besides, for squares of 8, 16, 32 ... samples: the greatest height in every square whose lines
/// begin at a multiple of its side, from any lane on.
///
/// Heights are flattened metres above middle_z_m, in float: exact below 4096 m, because lattice
/// steps are 2^-12 m, and otherwise within rounding_m.
/// Memory: 5 bytes a sample; one more where there is void.
class MarchGround {
 public:
  /// Heights where there are no data: nothing beyond the raster, and void within it.
  static constexpr float kNothing = -1e30F, kVoid = -2e30F;
  static constexpr bool is_ground(float z) { return z > -1e29F; }
  static constexpr bool is_void(float z) { return z < -1.5e30F; }

  /// Lanes beyond either border that may be read: kNothing.
  static constexpr std::int32_t kPad = 272;
  static constexpr int kLeastLevel = 3;  ///< of squares: 8 samples

  MarchGround(const GroundGrid& grid, March march);

  March march() const { return march_; }
  std::int32_t lines() const { return lines_; }
  std::int32_t lanes() const { return lanes_; }
  double middle_z_m() const { return middle_z_m_; }
  double rounding_m() const { return rounding_m_; }
  bool has_void() const { return has_void_; }
  int greatest_level() const { return kLeastLevel + static_cast<int>(highest_.size()) - 1; }

  /// Samples from one line to the next.
  std::ptrdiff_t stride() const { return static_cast<std::ptrdiff_t>(stride_); }
  /// Heights of a line by lane, from -kPad on.
  const float* line(std::int32_t line) const { return &z_[base(line)]; }
  /// Greatest heights of squares of 2^level samples, by first lane, from -kPad on.
  /// @param block  the square's first line / 2^level
  const float* highest(int level, std::int32_t block) const {
    return &highest_[static_cast<std::size_t>(level - kLeastLevel)][base(block)];
  }
  /// Is a sample of the square void? Requires has_void.
  const std::uint8_t* any_void(int level, std::int32_t block) const {
    return &void_[static_cast<std::size_t>(level - kLeastLevel)][base(block)];
  }

 private:
  std::size_t base(std::int32_t line) const {
    return static_cast<std::size_t>(line) * stride_ + static_cast<std::size_t>(kPad);
  }
  void read_heights(const GroundGrid& grid);
  void build_level(std::size_t index);

  March march_;
  std::int32_t lines_ = 0, lanes_ = 0;
  std::size_t stride_ = 0;
  double middle_z_m_ = 0, rounding_m_ = 0;
  bool has_void_ = false;
  LargeArray<float> z_;
  std::vector<LargeArray<float>> highest_;
  std::vector<LargeArray<std::uint8_t>> void_;
};

}  // namespace scarp
