#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geodesy/earth_frame.h"
#include "core/memory/large_array.h"
#include "core/terrain/ground_grid.h"
#include "core/viewshed/grid_sight.h"
#include "core/viewshed/view_limits.h"

namespace scarp {

/// A sample of a raster.
struct SamplePlace {
  std::int32_t column = 0, row = 0;
};

std::uint64_t count_known(const GroundGrid& grid);

/// Known samples of a raster: all of them in order where there are no more than `count`, otherwise
/// so many, each set of them as likely as any other.
/// @param seed  of SplitMix64; the same one chooses the same samples
/// Source: selection sampling, Knuth, The Art of Computer Programming 2, 3.4.2, algorithm S.
std::vector<SamplePlace> choose_samples(const GroundGrid& grid, std::uint64_t count,
                                        std::uint64_t seed);

/// The ground that a sample stands for, square metres: the cell around it on the ellipsoid (in the
/// plane where there is none). Error below a millionth for cells up to 1 km.
double cell_area_m2(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                    const SamplePlace& place);

/// How much ground each sample sees, out of looks from the ground back at all samples: sight is
/// symmetric, so what a place sees of the samples is what sees that place from them.
///
/// Error: none beyond summing where every known sample has looked. From M of K chosen at random the
/// area is unbiased, with a standard error of at most A / (2 sqrt(M)), A all ground (half a per
/// cent of A with M = 10,000), and none for what all or none of the samples see.
class SeenGround {
 public:
  explicit SeenGround(const GroundGrid& grid);
  /// @param sight  what a sample of ground of area_m2 has of targets at eye height
  void add(const SampleWindow& window, std::span<const Seen> sight, double area_m2);
  /// Ends the sums, in whose memory the answer lies: nothing can be added afterwards.
  /// @return [rows * columns] square kilometres seen; NaN where void
  /// @param share  of the known samples that have looked, (0, 1]
  std::span<const float> finish_km2(double share);

 private:
  std::size_t columns_;
  LargeArray<double> area_m2_;
};

}  // namespace scarp
