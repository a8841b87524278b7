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

/// How strips lean: lanes for each line in the direction in which rays cross lines.
struct StripLean {
  bool are_squares = true;
  int line_step = 1;  ///< +1 towards later lines, -1 towards earlier ones
  double lanes_per_line = 0;
  bool operator==(const StripLean&) const = default;
};

/// The samples of a grid laid out for rays that march over its lines: a line is a row (a column), a
/// lane is the place on it, and neighbouring lanes lie side by side in memory, so that one
/// operation serves the rays of many neighbouring cells.
///
/// Besides, for strips of 8, 16, 32 ... lines, which begin at a multiple of their number: the
/// greatest height that a ray can meet in the strip, from any lane on. Strips lean as the rays of
/// an azimuth do, so that they are little wider than a ray; where rays of one azimuth run too
/// differently, strips are squares instead.
///
/// Heights are flattened metres above middle_z_m (below it upside down), in float: exact below 4096
/// m, because lattice steps are 2^-12 m, and otherwise within rounding_m. Memory: 5 bytes a sample;
/// a quarter more where there is void.
class MarchGround {
 public:
  /// Heights where there are no data: nothing beyond the raster, and void within it.
  static constexpr float kNothing = -1e30F, kVoid = -2e30F;
  static constexpr bool is_ground(float z) { return z > -1e29F; }
  static constexpr bool is_void(float z) { return z < -1.5e30F; }

  /// Lanes beyond either border that may be read: kNothing.
  static constexpr std::int32_t kPad = 272;
  static constexpr int kLeastLevel = 3;  ///< of strips: 8 lines

  /// Without strips.
  /// @param upside_down  heights are those of the ground times -1
  MarchGround(const GroundGrid& grid, March march, bool upside_down = false);

  /// Makes strips, unless they lean so already. Cost: less than a nanosecond a sample.
  void lean(const StripLean& lean);
  const StripLean& leaning() const { return lean_; }

  March march() const { return march_; }
  bool is_upside_down() const { return upside_down_; }
  std::int32_t lines() const { return lines_; }
  std::int32_t lanes() const { return lanes_; }
  double middle_z_m() const { return middle_z_m_; }
  double rounding_m() const { return rounding_m_; }
  bool has_void() const { return has_void_; }
  /// Never below the rise between any two samples that are neighbours on a line or a lane.
  double steepest_m() const { return steepest_m_; }
  int greatest_level() const { return kLeastLevel + static_cast<int>(highest_.size()) - 1; }

  /// Samples from one line to the next.
  std::ptrdiff_t stride() const { return static_cast<std::ptrdiff_t>(stride_); }
  /// Heights of a line by lane, from -kPad on.
  const float* line(std::int32_t line) const { return &z_[base(line)]; }
  /// Greatest heights in a strip of 2^level lines by first lane, from -kPad on: never below a
  /// sample of the i-th line, as rays cross them, on lanes from first + i lean on, up to that and
  /// width(level), both included.
  /// @param strip  its first line / 2^level
  const float* highest(int level, std::int32_t strip) const {
    return &highest_[static_cast<std::size_t>(level - kLeastLevel)][base(strip)];
  }
  std::int32_t width(int level) const {
    return lean_.are_squares ? (std::int32_t{1} << level) - 1 : kLeaningWidth;
  }
  /// Is a sample that `highest` speaks of void? Requires has_void.
  const std::uint8_t* any_void(int level, std::int32_t strip) const {
    return &void_[static_cast<std::size_t>(level - kLeastLevel)][base(strip)];
  }

 private:
  std::size_t base(std::int32_t line) const {
    return static_cast<std::size_t>(line) * stride_ + static_cast<std::size_t>(kPad);
  }
  void read_heights(const GroundGrid& grid);
  void measure_steepness();
  void make_least_strips();
  void join_strips(std::size_t index);
  double lean_of(std::int32_t lines) const {
    return lean_.are_squares ? 0 : lean_.lanes_per_line * lines;
  }

  static constexpr std::int32_t kLeaningWidth = 3;

  March march_;
  bool upside_down_;
  std::int32_t lines_ = 0, lanes_ = 0;
  std::size_t stride_ = 0;
  double middle_z_m_ = 0, rounding_m_ = 0, steepest_m_ = 0;
  StripLean lean_;
  bool has_void_ = false, has_strips_ = false;
  LargeArray<float> z_;
  std::vector<LargeArray<float>> highest_;
  std::vector<LargeArray<std::uint8_t>> void_;
};

}  // namespace scarp
