#include "core/occlusion/certified/tile_horizon.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// A cell of the tile is looked at in parts, each as the disc around it, of which there are at
/// least so many in a turn and in an octave.
constexpr std::int32_t kPartsOfTurn = 64, kPartsOfOctave = 4;

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
  return horizon.radius_m * std::exp2(ring / horizon.layout.rings_per_octave);
}

/// Not clamped: below 0 nearer than ring 0; NaN where a distance is none.
double ring_place(const TileHorizon& horizon, double distance_m) {
  return horizon.layout.rings_per_octave * std::log2(distance_m / horizon.radius_m);
}

std::int32_t sector_place(const TileHorizon& horizon, double azimuth_rad) {
  const double turns = azimuth_rad / (2 * std::numbers::pi);
  return static_cast<std::int32_t>((turns - std::floor(turns)) * horizon.layout.sectors) %
         horizon.layout.sectors;
}

/// @param sector, ring  places in the row of sectors and of rings where the part begins
CameraPart part_of(const TileHorizon& horizon, double sector, double sector_part, double ring,
                   double ring_part) {
  const double width = 2 * std::numbers::pi / horizon.layout.sectors * sector_part;
  const double middle = 2 * std::numbers::pi / horizon.layout.sectors * sector + width / 2;
  CameraPart part;
  part.from_m = ring_begin(horizon, ring) * (1 - kPartOverlap);
  part.to_m = ring_begin(horizon, ring + ring_part) * (1 + kPartOverlap);
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

/// Something with a centre and slopes of its own, as a part of a cell sees it.
struct Seen {
  double height_m;        // that its slopes start from
  double near_m, far_m;   // distances of the part from its centre
  double offset_m;        // of its centre from the tile's
  double part_x, part_y;  // metres of the part's middle from its centre
};

/// A group or a tile, which have their centres alike.
template <typename Centred>
Seen seen_by(const CameraPart& part, const Centred& what, const TileHorizon& horizon) {
  const double x = what.centre_x_m - horizon.centre_x_m;
  const double y = what.centre_y_m - horizon.centre_y_m;
  const double dx = part.x_m - x, dy = part.y_m - y;
  const double away_m = std::hypot(dx, dy);
  return {what.height_m,
          away_m - part.reach_m,
          away_m + part.reach_m,
          std::hypot(x, y) * (1 + kPartOverlap),
          dx,
          dy};
}

/// The greatest slope from the tile's centre that stays under a line from the other's centre, for
/// distances of the part from the one and of [near_m, far_m] from the other.
double slope_under(const TileHorizon& horizon, const Seen& seen, double slope,
                   const CameraPart& part) {
  const double base = seen.height_m - horizon.height_m;
  const double lowest = base + std::min(slope * seen.near_m, slope * seen.far_m);
  const double by_ends = lowest / (lowest >= 0 ? part.to_m : part.from_m);
  // Distances from the two centres differ by the distance between them at most.
  const double shifted = base - std::abs(slope) * seen.offset_m;
  const double by_shift = slope + shifted / (shifted >= 0 ? part.to_m : part.from_m);
  const double allowance_m =
      kHeightAllowance * (std::abs(base) + std::abs(seen.height_m) * 0x1p-24 +
                          std::abs(slope) * seen.far_m + std::abs(lowest));
  return std::max(by_ends, by_shift) - allowance_m / part.from_m;
}

/// The least slope from the tile's centre over what the group's steps say in a range of rings.
double least_slope(const TileHorizon& horizon, const CertifiedGroup& group, const Seen& seen,
                   const SectorSteps& steps, std::int32_t first_ring, std::int32_t last_ring,
                   const CameraPart& part) {
  double least = std::numeric_limits<double>::infinity();
  const auto take = [&](std::int32_t c) {
    least = c == 0 ? -std::numeric_limits<double>::infinity()
                   : std::min(least, slope_under(horizon, seen, slope_of(group, c), part));
  };
  // The code that holds where the range begins, then those that begin within it.
  take(code_in(steps, first_ring));
  for (const std::uint16_t step : steps)
    if (step >> kSlopeBits > first_ring && step >> kSlopeBits <= last_ring &&
        least > -std::numeric_limits<double>::infinity())
      take(step & (kSlopeCodes - 1));
  return least;
}

/// The azimuths of a part from a centre: where the first sector is that it may touch, and the last.
struct Azimuths {
  double from_rad, to_rad;
};
Azimuths azimuths_of(const CameraPart& part, double dx, double dy) {
  const double spread = std::asin(std::min(1.0, part.reach_m / std::hypot(dx, dy))) + kPartOverlap;
  const double azimuth = std::atan2(dy, dx);
  return {azimuth - spread, azimuth + spread};
}

double slope_over_part(const TileHorizon& horizon, const CertifiedRegions& regions,
                       std::uint32_t number, const CameraPart& part) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  const CertifiedGroup& group = regions.groups[number];
  const Seen seen = seen_by(part, group, horizon);
  if (seen.near_m <= 0) return kNone;
  const double unit_m = static_cast<double>(group.radius_m);
  const auto ring_at = [&](double d) {
    return ring_of(regions.layout, static_cast<float>(d / unit_m * (d / unit_m)));
  };
  const std::int32_t first_ring = ring_at(seen.near_m * (1 - kPartOverlap));
  const std::int32_t last_ring = ring_at(seen.far_m * (1 + kPartOverlap));
  if (first_ring < 0) return kNone;
  const Azimuths azimuths = azimuths_of(part, seen.part_x, seen.part_y);
  const auto sector_at = [&](double a) {
    return sector_of(regions.layout, std::cos(a), std::sin(a));
  };
  const std::int32_t last_sector = sector_at(azimuths.to_rad);
  double least = std::numeric_limits<double>::infinity();
  for (std::int32_t s = sector_at(azimuths.from_rad);; s = (s + 1) % regions.layout.sectors) {
    least = std::min(least, least_slope(horizon, group, seen, regions.at(number, s), first_ring,
                                        last_ring, part));
    if (s == last_sector || least == kNone) return least;
  }
}

/// The same for what the horizon of another tile says.
double slope_over_part(const TileHorizon& horizon, const TileHorizon& tile,
                       const CameraPart& part) {
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  const Seen seen = seen_by(part, tile, horizon);
  const double first = ring_place(tile, seen.near_m * (1 - kPartOverlap));
  const double last = ring_place(tile, seen.far_m * (1 + kPartOverlap));
  if (!(first >= 0 && last < tile.layout.rings)) return kNone;
  const Azimuths azimuths = azimuths_of(part, seen.part_x, seen.part_y);
  const std::int32_t last_sector = sector_place(tile, azimuths.to_rad);
  double least = std::numeric_limits<double>::infinity();
  for (std::int32_t s = sector_place(tile, azimuths.from_rad);; s = (s + 1) % tile.layout.sectors) {
    for (auto ring = static_cast<std::int32_t>(first); ring <= static_cast<std::int32_t>(last);
         ++ring) {
      const float slope = tile.slopes[static_cast<std::size_t>(s * tile.layout.rings + ring)];
      if (slope == TileHorizon::kNothingHidden) return kNone;
      if (slope < kEverythingHidden)
        least = std::min(least, slope_under(horizon, seen, static_cast<double>(slope), part));
    }
    if (s == last_sector) return least;
  }
}

/// Rounded down; kNothingHidden for what is no slope.
float stored_slope(double slope) {
  if (!(slope > -1e30)) return TileHorizon::kNothingHidden;
  return std::nextafter(static_cast<float>(slope), TileHorizon::kNothingHidden);
}

/// Lowers each slope to the least over the parts of its cell. @param slope_at  (part, slope so far)
template <class SlopeAt>
void lower(TileHorizon& horizon, const SlopeAt& slope_at) {
  const HorizonLayout& layout = horizon.layout;
  const std::int32_t across = std::max(1, kPartsOfTurn / layout.sectors);
  const std::int32_t outwards = std::max(1, kPartsOfOctave / layout.rings_per_octave);
  parallel_for(static_cast<std::size_t>(layout.sectors), [&](std::size_t sector) {
    for (std::int32_t ring = 0; ring < layout.rings; ++ring) {
      float& slope = horizon.slopes[sector * static_cast<std::size_t>(layout.rings) +
                                    static_cast<std::size_t>(ring)];
      for (std::int32_t i = 0; i < across * outwards; ++i) {
        if (slope == TileHorizon::kNothingHidden) break;
        const CameraPart part = part_of(
            horizon, static_cast<double>(sector) + static_cast<double>(i % across) / across,
            1.0 / across, ring + static_cast<double>(i / across) / outwards, 1.0 / outwards);
        slope = slope_at(part, slope);
      }
    }
  });
}

}  // namespace

TileHorizon horizon_of_nothing(const HorizonLayout& layout, double centre_x_m, double centre_y_m,
                               double height_m, double radius_m) {
  return {layout,   centre_x_m, centre_y_m,
          height_m, radius_m,   std::vector<float>(layout.cells(), kEverythingHidden)};
}

void cover_groups(const CertifiedRegions& regions, TileHorizon& horizon) {
  // The highest first: they are seen from most places, and where one is nothing else matters.
  std::vector<std::uint32_t> order(regions.groups.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::greater(),
                           [&](std::uint32_t g) { return regions.groups[g].height_m; });
  lower(horizon, [&](const CameraPart& part, float slope) {
    for (const std::uint32_t g : order) {
      if (slope == TileHorizon::kNothingHidden) break;
      slope = std::min(slope, stored_slope(slope_over_part(horizon, regions, g, part)));
    }
    return slope;
  });
}

void cover_tile(const TileHorizon& tile, TileHorizon& horizon) {
  lower(horizon, [&](const CameraPart& part, float slope) {
    const double least = slope_over_part(horizon, tile, part);
    return least < HUGE_VAL ? std::min(slope, stored_slope(least)) : slope;
  });
}

void cover_uncertified(TileHorizon& horizon) {
  std::fill(horizon.slopes.begin(), horizon.slopes.end(), TileHorizon::kNothingHidden);
}

void cover(const TileHorizon& other, TileHorizon& horizon) {
  assert(other.layout == horizon.layout && other.centre_x_m == horizon.centre_x_m &&
         other.centre_y_m == horizon.centre_y_m && other.radius_m == horizon.radius_m &&
         other.height_m == horizon.height_m);
  for (std::size_t i = 0; i < horizon.slopes.size(); ++i)
    horizon.slopes[i] = std::min(horizon.slopes[i], other.slopes[i]);
}

bool hides_tile(const TileHorizon& horizon, const Position& eye) {
  const double x = eye.x_m - horizon.centre_x_m, y = eye.y_m - horizon.centre_y_m;
  const double distance_m = std::hypot(x, y);
  const double place = ring_place(horizon, distance_m);
  if (!(place >= 0 && place < horizon.layout.rings)) return false;
  const auto cell =
      static_cast<std::size_t>(sector_place(horizon, std::atan2(y, x)) * horizon.layout.rings +
                               static_cast<std::int32_t>(place));
  return eye.z_m < horizon.height_m + static_cast<double>(horizon.slopes[cell]) * distance_m;
}

}  // namespace scarp
