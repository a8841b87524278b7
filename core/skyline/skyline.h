#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/geodesy/earth_frame.h"
#include "core/skyline/march_ground.h"
#include "core/skyline/ray_fan.h"
#include "core/terrain/ground_grid.h"

namespace scarp {

/// kUp: the highest that ground is seen. kDown: all is upside down, so that elevations are how far
/// below the level plane the lowest ground is seen, and negative where all of it lies above.
enum class Sight : std::uint8_t { kUp, kDown };

struct SkylineOptions {
  double eye_height_m = 0;        ///< above ground, along the normal
  double tolerance_rad = 0.0035;  ///< by which upper and lower bound may differ at most
  Sight sight = Sight::kUp;
};

/// One azimuth's horizons of a rectangle of samples, each [rows * columns], in steps of 0.01 degree
/// above the level plane of the sample's eye. kNothingSeen: no ground lies that way within the
/// data; kUnknownElevation: the sample is void, or the ray passes void before known ground.
struct SkylinePart {
  std::int32_t first_column = 0, first_row = 0, columns = 0, rows = 0;
  std::span<const std::int16_t> estimate, lower, upper;
  std::span<const float> distance_m;  ///< along the ground, of the estimate; empty: not wanted
};
/// Takes parts as they are found, on several threads at once and in no order.
using TakeSkylinePart = std::function<void(const SkylinePart&)>;

/// The same of all samples.
struct SkylineBands {
  std::span<std::int16_t> estimate;
  std::span<std::int16_t> lower, upper;  ///< empty: not wanted
  std::span<float> distance_m;           ///< empty: not wanted
};

/// The horizons of all samples of a grid: what the judge (judge_horizon) finds for each, in
/// azimuth after azimuth, with bounds.
///
/// Side of error: lower <= judge <= upper, rounded outwards; they differ by the tolerance and a
/// step at most, but where a ray grazes the border of the data or of void. The estimate is the
/// greatest crossing compared, most often the horizon itself.
/// Void: where a ray comes so near to void that it is not certain to miss it, it is unknown too.
/// Cost: see march_tile; the same bits for any number of threads and parts.
/// Memory: the grid's 4 bytes a sample, 5 more (5.3 where there is void), and 1 MB a thread.
class Skyline {
 public:
  /// Parts are squares of so many samples, less at the right and lower border.
  static constexpr std::int32_t kPartSide = 256;

  /// grid is kept by reference. Requires at least 2 x 2 samples, kLeastCellM apart or more.
  Skyline(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
          const SkylineOptions& options);

  /// Samples are laid out anew when this changes from one azimuth to the next; so ask in its order.
  March march_for(const AzimuthAt& azimuth) const;

  void look(const AzimuthAt& azimuth, bool measures_distance, const TakeSkylinePart& take);
  void look(const AzimuthAt& azimuth, const SkylineBands& bands);

 private:
  struct Tile;
  struct Found;
  const MarchGround& ground_for(March march, const AzimuthAt& azimuth);
  std::vector<Tile> tiles_of(const SkylinePart& part, March preferred,
                             const AzimuthAt& azimuth) const;
  void look_from(const Tile& tile, const MarchGround& ground, const AzimuthAt& azimuth,
                 const SkylinePart& part, Found& found) const;
  float distance_m(const AzimuthAt& azimuth, std::int32_t column, std::int32_t row,
                   float run_m) const;

  const GroundGrid& grid_;
  std::optional<EarthFrame> earth_;
  SkylineOptions options_;
  double tilt_;
  std::unique_ptr<MarchGround> over_rows_, over_columns_;
};

/// The distance between neighbouring samples, the lesser of both ways, in the middle of the grid.
double cell_side_m(const GroundGrid& grid);

/// An azimuth that is the same from everywhere, radians.
AzimuthAt fixed_azimuth(double azimuth_rad);

/// What the exact ray of one sample sees.
struct JudgedHorizon {
  bool is_known = false;  ///< neither is the sample void, nor does the ray pass void before ground
  bool met = false;       ///< some ground lies that way
  double elevation_rad = 0;
  double distance_m = 0;  ///< along the ground
};

/// The judge: the greatest slope of all crossings of the ray, found by exact predicates.
/// Cost: O(columns + rows) predicates.
JudgedHorizon judge_horizon(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                            double eye_height_m, std::int32_t column, std::int32_t row,
                            double azimuth_rad);

/// Whether the sun, a point, stands over the horizon.
enum class Sunlight : std::uint8_t { kShadow = 0, kLit = 1, kUnknown = 255 };

/// Shadows that the ground casts, exact: where the bounds leave it open the judge decides.
/// @param sun            unit vector towards it in ECEF; on the flat earth east, north, up
/// @param light[out]     [rows * columns]
/// @return how many samples the judge decided
std::size_t cast_shadow(const GroundGrid& grid, const std::optional<EarthFrame>& earth,
                        const EcefPoint& sun, std::span<Sunlight> light);

}  // namespace scarp
