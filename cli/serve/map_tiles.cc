#include "cli/serve/map_tiles.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/raster/preview.h"
#include "core/threads/parallel_for.h"
#include "tiles/layers/png_image.h"

namespace scarp {
namespace {

using Rgba = std::array<std::uint8_t, 4>;

constexpr auto kSide = static_cast<std::size_t>(kTilePx);

/// Where the middles of a tile's pixels lie in the raster, row by row.
std::vector<RasterPlace> places_of(const MercatorMap& map, const MapTile& tile) {
  const MercatorBox box = tile_box(tile.zoom, tile.x, tile.y);
  const double step_m = (box.east_m - box.west_m) / kTilePx;
  std::vector<RasterPlace> places(kSide * kSide);
  for (std::size_t row = 0; row < kSide; ++row)
    map.places(box.north_m - (static_cast<double>(row) + 0.5) * step_m, box.west_m + step_m / 2,
               step_m, std::span(places).subspan(row * kSide, kSide));
  return places;
}

/// The sample nearest to a place, or nothing outside of the raster.
std::optional<std::size_t> nearest(const RasterPlace& at, std::int32_t columns, std::int32_t rows) {
  // Also false for NaN. A raster's cells reach half a cell beyond its outermost samples.
  if (!(at.column >= -0.5F && at.row >= -0.5F)) return {};
  const auto c = static_cast<std::int64_t>(at.column + 0.5F);
  const auto r = static_cast<std::int64_t>(at.row + 0.5F);
  if (c >= columns || r >= rows) return {};
  return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(c);
}

/// The level of heights whose cells are the smallest that are no smaller than half a pixel.
std::size_t level_of(const ServedScene& scene, const MapTile& tile) {
  const MercatorBox box = tile_box(tile.zoom, tile.x, tile.y);
  const double cells = (box.east_m - box.west_m) / kTilePx / std::max(scene.map().pixel_m(), 1e-9);
  const double level = std::floor(std::log2(std::max(cells, 1.0)) + 0.5);
  return std::min(static_cast<std::size_t>(level), scene.heights().levels().size() - 1);
}

/// Four samples around a place and their shares; nothing outside of the raster's cells.
struct Corners {
  std::int32_t column, row;
  float right, down;
};
std::optional<Corners> corners_of(const RasterPlace& at, std::size_t level,
                                  const HeightPyramid::Level& heights) {
  const auto scale = static_cast<float>(std::size_t{1} << level);
  const float column = (at.column + 0.5F) / scale - 0.5F, row = (at.row + 0.5F) / scale - 0.5F;
  if (!(column >= -0.5F && row >= -0.5F) || column > static_cast<float>(heights.columns) - 0.5F ||
      row > static_cast<float>(heights.rows) - 0.5F)
    return {};
  const float c = std::clamp(std::floor(column), 0.0F, static_cast<float>(heights.columns - 1));
  const float r = std::clamp(std::floor(row), 0.0F, static_cast<float>(heights.rows - 1));
  return Corners{static_cast<std::int32_t>(c), static_cast<std::int32_t>(r),
                 std::clamp(column - c, 0.0F, 1.0F), std::clamp(row - r, 0.0F, 1.0F)};
}

/// Mean of a quantity of the four samples around a place, of those that have it; NaN without any.
template <typename Quantity>
float between(const Corners& at, const Quantity& of) {
  float sum = 0, share = 0;
  for (const std::int32_t down : {0, 1}) {
    for (const std::int32_t right : {0, 1}) {
      const float own = (right ? at.right : 1 - at.right) * (down ? at.down : 1 - at.down);
      if (own == 0) continue;
      const float value = of(at.column + right, at.row + down);
      if (std::isnan(value)) continue;
      sum += own * value;
      share += own;
    }
  }
  // Half of the way to a void sample is void.
  return share >= 0.5F ? sum / share : std::numeric_limits<float>::quiet_NaN();
}

struct Tint {
  float at;  ///< of the way from the lowest to the highest ground
  float r, g, b;
};
constexpr std::array<Tint, 6> kRelief = {{{0.00F, 167, 194, 160},
                                          {0.20F, 206, 214, 172},
                                          {0.40F, 232, 222, 184},
                                          {0.60F, 217, 192, 157},
                                          {0.80F, 196, 174, 160},
                                          {1.00F, 246, 245, 244}}};

std::array<float, 3> relief_colour(float share) {
  std::size_t i = 1;
  while (i + 1 < kRelief.size() && share > kRelief[i].at) ++i;
  const Tint &a = kRelief[i - 1], &b = kRelief[i];
  const float t = std::clamp((share - a.at) / (b.at - a.at), 0.0F, 1.0F);
  return {a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b)};
}

/// Light on ground that rises to the east and to the north by these slopes, from 0 to 1; level
/// ground has kLevelLight.
constexpr float kLevelLight = 0.70710678F;
float light_on(float east, float north) {
  // From the north-west, 45 degrees high: (-1/2, 1/2, sqrt 1/2).
  const float lit =
      (0.5F * east - 0.5F * north + kLevelLight) / std::sqrt(1 + east * east + north * north);
  return std::clamp(lit, 0.0F, 1.0F);
}

/// How much slopes are exaggerated: by the scale, so that relief shows from afar as well.
float exaggeration_of(std::size_t level) {
  return std::min(1.0F + 0.35F * static_cast<float>(level), 4.0F);
}

std::array<Rgba, 256> palette_of_counts(std::size_t eyes) {
  std::array<Rgba, 256> palette{};
  for (std::size_t n = 1; n < palette.size(); ++n) {
    const float t =
        eyes <= 1 ? 0 : std::min(1.0F, static_cast<float>(n - 1) / static_cast<float>(eyes - 1));
    const auto mix = [&](float from, float to) {
      return static_cast<std::uint8_t>(std::lround(from + t * (to - from)));
    };
    palette[n] = {mix(250, 160), mix(196, 20), mix(60, 80), kSeenColour[3]};
  }
  return palette;
}

constexpr std::array<Rgba, 9> kNeededHeightColours = {{{0, 0, 0, 0},
                                                       {250, 196, 60, 190},
                                                       {248, 164, 66, 180},
                                                       {238, 130, 76, 175},
                                                       {216, 98, 92, 170},
                                                       {184, 72, 110, 165},
                                                       {146, 56, 124, 160},
                                                       {106, 46, 126, 155},
                                                       {66, 38, 110, 150}}};

/// Values of what eyes see as indices into a palette.
struct Drawing {
  std::vector<Rgba> palette;
  std::function<std::uint8_t(std::size_t sample)> index_of;
};

Drawing drawing_of(const ServedScene& scene, const EyesRaster& seen) {
  if (!seen.seen().empty())
    return {{{70, 80, 96, 0}, kSeenColour}, [sight = seen.seen()](std::size_t i) {
              return static_cast<std::uint8_t>(sight[i] == Seen::kVisible ? 1 : 0);
            }};
  if (!seen.counts().empty()) {
    const auto palette = palette_of_counts(seen.eyes().size());
    return {{palette.begin(), palette.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(
                                                    256, seen.eyes().size() + 1))},
            [counts = seen.counts()](std::size_t i) {
              const std::uint32_t n = counts[i];
              return static_cast<std::uint8_t>(n == EyeCount::kVoid ? 0 : std::min(n, 255U));
            }};
  }
  // Mode dem has heights above the datum; above the ground they are told apart by the same steps.
  const std::span<const float> ground =
      seen.are_elevations() ? std::span<const float>(scene.heights().levels()[0].heights_m)
                            : std::span<const float>();
  return {{kNeededHeightColours.begin(), kNeededHeightColours.end()},
          [heights = seen.heights_m(), ground](std::size_t i) {
            const float height_m = ground.empty() ? heights[i] : heights[i] - ground[i];
            if (std::isnan(height_m)) return std::uint8_t{0};
            const auto step =
                std::upper_bound(kHeightSteps_m.begin(), kHeightSteps_m.end(), height_m);
            return static_cast<std::uint8_t>(1 + (step - kHeightSteps_m.begin()));
          }};
}

bool is_in(const SampleWindow& window, const RasterPlace& at) {
  return at.column >= static_cast<float>(window.first_column) - 0.5F &&
         at.column < static_cast<float>(window.last_column) + 0.5F &&
         at.row >= static_cast<float>(window.first_row) - 0.5F &&
         at.row < static_cast<float>(window.last_row) + 0.5F;
}

/// The rectangle of web mercator around a window of samples, on the lattice of a step from the
/// north-west corner of the map.
MercatorBox box_around(const ServedScene& scene, const SampleWindow& window, double step_m) {
  constexpr int kParts = 16;
  const Dem& dem = scene.source().dem();
  MercatorBox box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  const auto take = [&](double column, double row) {
    const auto at = scene.lon_lat_of(dem.x_of(column), dem.y_of(row));
    if (!at) return;
    const MercatorPoint p = to_mercator(*at);
    box = {std::min(box.west_m, p.x_m), std::min(box.south_m, p.y_m), std::max(box.east_m, p.x_m),
           std::max(box.north_m, p.y_m)};
  };
  const double left = window.first_column - 0.5, right = window.last_column + 0.5;
  const double top = window.first_row - 0.5, bottom = window.last_row + 0.5;
  for (int i = 0; i <= kParts; ++i) {
    const double across = left + (right - left) * i / kParts;
    const double down = top + (bottom - top) * i / kParts;
    take(across, top);
    take(across, bottom);
    take(left, down);
    take(right, down);
  }
  const MercatorBox& all = scene.map().box();
  const auto clamped = [](double v, double low, double high) { return std::clamp(v, low, high); };
  const double west = clamped(box.west_m, all.west_m, all.east_m);
  const double north = clamped(box.north_m, all.south_m, all.north_m);
  const double east = clamped(box.east_m, all.west_m, all.east_m);
  const double south = clamped(box.south_m, all.south_m, all.north_m);
  return {all.west_m + std::floor((west - all.west_m) / step_m) * step_m,
          all.north_m - std::max(1.0, std::ceil((all.north_m - south) / step_m)) * step_m,
          all.west_m + std::max(1.0, std::ceil((east - all.west_m) / step_m)) * step_m,
          all.north_m - std::floor((all.north_m - north) / step_m) * step_m};
}

/// The groups under a tile's pixels.
struct GroupsOfPixels {
  std::vector<GroupIndex> own;      ///< kNone: none
  std::vector<std::uint8_t> known;  ///< whether there is ground

  GroupsOfPixels(const ServedScene& scene, const MapTile& tile)
      : own(kSide * kSide, kNone), known(kSide * kSide) {
    const std::vector<RasterPlace> places = places_of(scene.map(), tile);
    const GroundGrid& grid = scene.source().samples();
    const std::vector<GroupIndex>& groups = scene.group_of_samples();
    const auto columns = static_cast<std::size_t>(grid.columns());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto sample = nearest(places[i], grid.columns(), grid.rows());
      if (!sample) continue;
      known[i] = grid.is_known(static_cast<std::int32_t>(*sample % columns),
                               static_cast<std::int32_t>(*sample / columns));
      own[i] = groups[*sample];
    }
  }
};

}  // namespace

std::string hillshade_tile(const ServedScene& scene, const MapTile& tile) {
  const std::vector<RasterPlace> places = places_of(scene.map(), tile);
  const std::size_t level = level_of(scene, tile);
  const HeightPyramid::Level& heights = scene.heights().levels()[level];
  const auto cell_m =
      static_cast<float>(scene.cell_m() * static_cast<double>(std::size_t{1} << level));
  const float steeper = exaggeration_of(level);
  const float lowest_m = scene.heights().lowest_m();
  const float range_m = std::max(1.0F, scene.heights().highest_m() - lowest_m);
  // Slope between the neighbours of a sample; towards the one that is known at a border.
  const auto slope = [&](std::int32_t c, std::int32_t r, std::int32_t dc, std::int32_t dr) {
    const float own = heights.at(c, r);
    const float before = heights.at(c - dc, r - dr), after = heights.at(c + dc, r + dr);
    if (std::isnan(own)) return own;
    if (std::isnan(before) && std::isnan(after)) return 0.0F;
    if (std::isnan(before)) return (after - own) / cell_m;
    if (std::isnan(after)) return (own - before) / cell_m;
    return (after - before) / (2 * cell_m);
  };
  std::vector<std::uint8_t> pixels(4 * kSide * kSide);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto at = corners_of(places[i], level, heights);
    if (!at) continue;
    const float height_m =
        between(*at, [&](std::int32_t c, std::int32_t r) { return heights.at(c, r); });
    if (std::isnan(height_m)) continue;
    const float east =
        between(*at, [&](std::int32_t c, std::int32_t r) { return slope(c, r, 1, 0); });
    const float south =
        between(*at, [&](std::int32_t c, std::int32_t r) { return slope(c, r, 0, 1); });
    const float light = light_on(-steeper * east, -steeper * south) / kLevelLight;
    const std::array<float, 3> tint = relief_colour((height_m - lowest_m) / range_m);
    for (std::size_t k = 0; k < 3; ++k)
      pixels[4 * i + k] =
          static_cast<std::uint8_t>(std::clamp(tint[k] * (0.4F + 0.6F * light), 0.0F, 255.0F));
    pixels[4 * i + 3] = 255;
  }
  return encode_png(kTilePx, kTilePx, 4, pixels);
}

std::string terrain_rgb_tile(const ServedScene& scene, const MapTile& tile) {
  const std::vector<RasterPlace> places = places_of(scene.map(), tile);
  const std::size_t level = level_of(scene, tile);
  const HeightPyramid::Level& heights = scene.heights().levels()[level];
  std::vector<std::uint8_t> pixels(3 * kSide * kSide);
  for (std::size_t i = 0; i < places.size(); ++i) {
    float height_m = std::numeric_limits<float>::quiet_NaN();
    if (const auto at = corners_of(places[i], level, heights))
      height_m = between(*at, [&](std::int32_t c, std::int32_t r) { return heights.at(c, r); });
    if (std::isnan(height_m)) height_m = scene.heights().lowest_m();
    const auto steps = static_cast<std::uint32_t>(
        std::clamp(std::lround((static_cast<double>(height_m) + 10'000) * 10), 0L, 0xFFFFFFL));
    pixels[3 * i] = static_cast<std::uint8_t>(steps >> 16U);
    pixels[3 * i + 1] = static_cast<std::uint8_t>((steps >> 8U) & 0xFFU);
    pixels[3 * i + 2] = static_cast<std::uint8_t>(steps & 0xFFU);
  }
  return encode_png(kTilePx, kTilePx, 3, pixels);
}

std::string groups_tile(const ServedScene& scene, const MapTile& tile) {
  const GroupsOfPixels groups(scene, tile);
  const std::vector<GroupIndex>& own = groups.own;
  std::vector<std::uint8_t> pixels(4 * kSide * kSide);
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (!groups.known[i]) continue;
    const bool border = (i % kSide + 1 < kSide && own[i + 1] != own[i]) ||
                        (i + kSide < own.size() && own[i + kSide] != own[i]);
    const Rgb colour = own[i] == kNone ? kOrphan : group_colour(own[i]);
    const double shade = border ? 0.45 : 1;
    const auto channel = [&](double v) {
      return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v * shade, 0.0, 1.0)));
    };
    pixels[4 * i] = channel(colour.r);
    pixels[4 * i + 1] = channel(colour.g);
    pixels[4 * i + 2] = channel(colour.b);
    pixels[4 * i + 3] = 150;
  }
  return encode_png(kTilePx, kTilePx, 4, pixels);
}

std::string group_numbers_tile(const ServedScene& scene, const MapTile& tile) {
  const GroupsOfPixels groups(scene, tile);
  std::vector<std::uint8_t> pixels(4 * kSide * kSide);
  for (std::size_t i = 0; i < groups.own.size(); ++i) {
    if (!groups.known[i]) continue;
    const std::uint32_t number = groups.own[i] == kNone ? kNoGroupNumber : groups.own[i];
    pixels[4 * i] = static_cast<std::uint8_t>((number >> 16U) & 0xFFU);
    pixels[4 * i + 1] = static_cast<std::uint8_t>((number >> 8U) & 0xFFU);
    pixels[4 * i + 2] = static_cast<std::uint8_t>(number & 0xFFU);
    pixels[4 * i + 3] = 255;
  }
  return encode_png(kTilePx, kTilePx, 4, pixels);
}

std::string seen_tile(const ServedScene& scene, const EyesRaster& seen, const MapTile& tile) {
  const std::vector<RasterPlace> places = places_of(scene.map(), tile);
  const GroundGrid& grid = scene.source().samples();
  const Drawing drawing = drawing_of(scene, seen);
  std::vector<std::uint8_t> indices(kSide * kSide);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto sample = nearest(places[i], grid.columns(), grid.rows());
    if (sample && is_in(seen.window(), places[i])) indices[i] = drawing.index_of(*sample);
  }
  return encode_palette_png(kTilePx, kTilePx, indices, drawing.palette);
}

SeenPicture seen_picture(const ServedScene& scene, const EyesRaster& seen) {
  const GroundGrid& grid = scene.source().samples();
  const MercatorMap& map = scene.map();
  double step_m = map.pixel_m();
  MercatorBox box = box_around(scene, seen.window(), step_m);
  const auto pixels_of = [&](double metres) { return std::llround(metres / step_m); };
  while (pixels_of(box.east_m - box.west_m) * pixels_of(box.north_m - box.south_m) >
         kMostPicturePx) {
    step_m *= 2;
    box = box_around(scene, seen.window(), step_m);
  }
  SeenPicture picture;
  picture.width_px = static_cast<int>(pixels_of(box.east_m - box.west_m));
  picture.height_px = static_cast<int>(pixels_of(box.north_m - box.south_m));
  const auto width = static_cast<std::size_t>(picture.width_px);
  const auto height = static_cast<std::size_t>(picture.height_px);
  const Drawing drawing = drawing_of(scene, seen);
  std::vector<std::uint8_t> indices(width * height);
  constexpr std::size_t kRowsPerTask = 32;
  parallel_for((height + kRowsPerTask - 1) / kRowsPerTask, [&](std::size_t task) {
    std::vector<RasterPlace> places(width);
    for (std::size_t row = task * kRowsPerTask; row < std::min(height, (task + 1) * kRowsPerTask);
         ++row) {
      map.places(box.north_m - (static_cast<double>(row) + 0.5) * step_m, box.west_m + step_m / 2,
                 step_m, places);
      std::uint8_t* out = &indices[row * width];
      for (std::size_t i = 0; i < width; ++i) {
        if (!is_in(seen.window(), places[i])) continue;
        if (const auto sample = nearest(places[i], grid.columns(), grid.rows()))
          out[i] = drawing.index_of(*sample);
      }
    }
  });
  picture.png = encode_palette_png(picture.width_px, picture.height_px, indices, drawing.palette);
  const LonLat low = to_lon_lat({box.west_m, box.south_m});
  const LonLat high = to_lon_lat({box.east_m, box.north_m});
  picture.bounds_deg = {low.longitude_deg, low.latitude_deg, high.longitude_deg, high.latitude_deg};
  return picture;
}

}  // namespace scarp
