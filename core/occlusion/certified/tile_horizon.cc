#include "core/occlusion/certified/tile_horizon.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace scarp {
namespace {

/// A cell of the tile is looked at in so many parts, each as the disc around it.
constexpr std::int32_t kAzimuthParts = 4, kDistanceParts = 2;

/// How far the parts reach over the borders of their cells, relative to the distance: far more than
/// the rounding of a logarithm or of an azimuth, far less than kCellOverlap.
constexpr double kPartOverlap = 1e-9;

/// Relative allowance for rounding of heights and for kHeightRounding.
constexpr double kHeightAllowance = 0x1p-18;

constexpr float kEverythingHidden = std::numeric_limits<float>::infinity();

/// A part of a cell: where cameras are, around the tile's centre.
struct CameraPart {
  double x_m, y_m, reach_m;  // the disc that holds it
  double from_m, to_m;       // distances from the tile's centre
};

double ring_begin(const TileHorizon& horizon, double ring) {
  return horizon.radius_m * std::exp2(ring / 2);
}

CameraPart part_of(const TileHorizon& horizon, std::int32_t sector, std::int32_t ring,
                   std::int32_t azimuth_part, std::int32_t distance_part) {
  const double width = 2 * std::numbers::pi / TileHorizon::kSectors / kAzimuthParts;
  const double middle = width * (sector * kAzimuthParts + azimuth_part + 0.5);
  const double begin = ring + static_cast<double>(distance_part) / kDistanceParts;
  CameraPart part;
  part.from_m = ring_begin(horizon, begin) * (1 - kPartOverlap);
  part.to_m = ring_begin(horizon, begin + 1.0 / kDistanceParts) * (1 + kPartOverlap);
  const double away_m = (part.from_m + part.to_m) / 2;
  part.x_m = away_m * std::cos(middle);
  part.y_m = away_m * std::sin(middle);
  // The corners of a sector of a ring are farthest from a point on its middle line.
  const double half = width / 2 + kPartOverlap;
  const auto to_corner = [&](double d) {
    return std::sqrt(away_m * away_m + d * d - 2 * away_m * d * std::cos(half));
  };
  part.reach_m = std::max(to_corner(part.from_m), to_corner(part.to_m)) * (1 + kPartOverlap);
  return part;
}

/// The greatest slope from the tile's centre that stays under a line from the group's centre, for
/// distances of the part from the one and of [near_m, far_m] from the other.
double slope_under(const TileHorizon& horizon, const CertifiedGroup& group, double slope,
                   const CameraPart& part, double near_m, double far_m, double offset_m) {
  const double base = group.height_m - horizon.height_m;
  const double lowest = base + std::min(slope * near_m, slope * far_m);
  const double by_ends = lowest / (lowest >= 0 ? part.to_m : part.from_m);
  // Distances from the two centres differ by the distance between them at most.
  const double shifted = base - std::abs(slope) * offset_m;
  const double by_shift = slope + shifted / (shifted >= 0 ? part.to_m : part.from_m);
  const double allowance_m =
      kHeightAllowance * (std::abs(base) + std::abs(group.height_m) * 0x1p-24 +
                          std::abs(slope) * far_m + std::abs(lowest));
  return std::max(by_ends, by_shift) - allowance_m / part.from_m;
}

/// The least slope from the tile's centre over what the group's steps say in a range of rings.
double least_slope(const TileHorizon& horizon, const CertifiedGroup& group,
                   const SectorSteps& steps, std::int32_t first_ring, std::int32_t last_ring,
                   const CameraPart& part, double near_m, double far_m, double offset_m) {
  std::int32_t code = 0;
  double least = std::numeric_limits<double>::infinity();
  const auto take = [&](std::int32_t c) {
    least = c == 0 ? -std::numeric_limits<double>::infinity()
                   : std::min(least, slope_under(horizon, group, slope_of(group, c), part, near_m,
                                                 far_m, offset_m));
  };
  // The code that holds where the range begins, then those that begin within it.
  for (const std::uint16_t step : steps)
    if (step <= (first_ring << kSlopeBits | (kSlopeCodes - 1))) code = step & (kSlopeCodes - 1);
  take(code);
  for (const std::uint16_t step : steps)
    if (step >> kSlopeBits > first_ring && step >> kSlopeBits <= last_ring &&
        least > -std::numeric_limits<double>::infinity())
      take(step & (kSlopeCodes - 1));
  return least;
}

double slope_over_part(const TileHorizon& horizon, const CertifiedRegions& regions,
                       std::uint32_t number, const CameraPart& part) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  const CertifiedGroup& group = regions.groups[number];
  const double x = group.centre_x_m - horizon.centre_x_m;
  const double y = group.centre_y_m - horizon.centre_y_m;
  const double dx = part.x_m - x, dy = part.y_m - y;
  const double away_m = std::hypot(dx, dy);
  const double near_m = away_m - part.reach_m, far_m = away_m + part.reach_m;
  if (near_m <= 0) return kNone;
  const double unit_m = static_cast<double>(group.radius_m);
  const auto ring_at = [&](double d) {
    return ring_of(regions.layout, static_cast<float>(d / unit_m * (d / unit_m)));
  };
  const std::int32_t first_ring = ring_at(near_m * (1 - kPartOverlap));
  const std::int32_t last_ring = ring_at(far_m * (1 + kPartOverlap));
  if (first_ring < 0) return kNone;
  const double spread = std::asin(std::min(1.0, part.reach_m / away_m)) + kPartOverlap;
  const double azimuth = std::atan2(dy, dx);
  const auto sector_at = [&](double a) {
    return sector_of(regions.layout, std::cos(a), std::sin(a));
  };
  const double offset_m = std::hypot(x, y) * (1 + kPartOverlap);
  const std::int32_t last_sector = sector_at(azimuth + spread);
  double least = std::numeric_limits<double>::infinity();
  for (std::int32_t s = sector_at(azimuth - spread);; s = (s + 1) % regions.layout.sectors) {
    least = std::min(least, least_slope(horizon, group, regions.at(number, s), first_ring,
                                        last_ring, part, near_m, far_m, offset_m));
    if (s == last_sector || least == kNone) return least;
  }
}

/// Rounded down; kNothingHidden for what is no slope.
float stored_slope(double slope) {
  if (!(slope > -1e30)) return TileHorizon::kNothingHidden;
  return std::nextafter(static_cast<float>(slope), TileHorizon::kNothingHidden);
}

}  // namespace

TileHorizon horizon_of_nothing(double centre_x_m, double centre_y_m, double height_m,
                               double radius_m) {
  return {centre_x_m, centre_y_m, height_m, radius_m,
          std::vector<float>(TileHorizon::kSectors * TileHorizon::kTileRings, kEverythingHidden)};
}

void cover_groups(const CertifiedRegions& regions, TileHorizon& horizon) {
  for (std::int32_t sector = 0; sector < TileHorizon::kSectors; ++sector) {
    for (std::int32_t ring = 0; ring < TileHorizon::kTileRings; ++ring) {
      float& slope =
          horizon.slopes[static_cast<std::size_t>(sector * TileHorizon::kTileRings + ring)];
      for (std::int32_t i = 0; i < kAzimuthParts * kDistanceParts; ++i) {
        const CameraPart part =
            part_of(horizon, sector, ring, i % kAzimuthParts, i / kAzimuthParts);
        for (std::uint32_t g = 0; g < regions.groups.size(); ++g) {
          if (slope == TileHorizon::kNothingHidden) break;
          slope = std::min(slope, stored_slope(slope_over_part(horizon, regions, g, part)));
        }
      }
    }
  }
}

void cover_uncertified(TileHorizon& horizon) {
  std::fill(horizon.slopes.begin(), horizon.slopes.end(), TileHorizon::kNothingHidden);
}

void cover(const TileHorizon& other, TileHorizon& horizon) {
  assert(other.centre_x_m == horizon.centre_x_m && other.centre_y_m == horizon.centre_y_m &&
         other.radius_m == horizon.radius_m && other.height_m == horizon.height_m);
  for (std::size_t i = 0; i < horizon.slopes.size(); ++i)
    horizon.slopes[i] = std::min(horizon.slopes[i], other.slopes[i]);
}

bool hides_tile(const TileHorizon& horizon, const Position& eye) {
  const double x = eye.x_m - horizon.centre_x_m, y = eye.y_m - horizon.centre_y_m;
  const double distance_m = std::hypot(x, y);
  const double place = 2 * std::log2(distance_m / horizon.radius_m);
  if (!(place >= 0 && place < TileHorizon::kTileRings)) return false;
  const double turns = std::atan2(y, x) / (2 * std::numbers::pi);
  const auto sector =
      static_cast<std::int32_t>((turns < 0 ? turns + 1 : turns) * TileHorizon::kSectors) %
      TileHorizon::kSectors;
  const auto cell =
      static_cast<std::size_t>(sector * TileHorizon::kTileRings + static_cast<std::int32_t>(place));
  return eye.z_m < horizon.height_m + static_cast<double>(horizon.slopes[cell]) * distance_m;
}

}  // namespace scarp
