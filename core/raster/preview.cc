#include "core/raster/preview.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/raster/rasterise.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Each pixel is the mean of kSamples x kSamples.
constexpr int kSamples = 2;

constexpr Rgb kSkyTop = {0.62, 0.75, 0.88};
constexpr Rgb kSkyBottom = {0.93, 0.95, 0.96};
constexpr Rgb kHaze = {0.84, 0.89, 0.94};
constexpr Rgb kShade = {0.13, 0.15, 0.27};    // what shaded slopes tend to
constexpr Rgb kSunlit = {1.00, 0.99, 0.93};   // what sunlit slopes tend to
constexpr Rgb kCutSide = {0.66, 0.60, 0.54};  // the sides of the block
constexpr Rgb kUnderside = {0.36, 0.34, 0.33};

Rgb mix(const Rgb& a, const Rgb& b, double share_of_b) {
  return {a.r + (b.r - a.r) * share_of_b, a.g + (b.g - a.g) * share_of_b,
          a.b + (b.b - a.b) * share_of_b};
}

struct Normal {
  double x = 0;
  double y = 0;
  double z = 0;
};

/// Towards the sun: azimuth 315 degrees, elevation 45 degrees.
constexpr Normal kSun = {-0.5, 0.5, std::numbers::sqrt2 / 2};

/// Cosine between normal and sun; the normal need not be of length one.
double lambert(const Normal& n) {
  const double length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
  return length > 0 ? (n.x * kSun.x + n.y * kSun.y + n.z * kSun.z) / length : kSun.z;
}

/// Upward normal with the length of twice the triangle's area.
Normal normal_of(const Tin& tin, const std::array<VertexIndex, 3>& triangle) {
  const Position& a = tin.vertices[triangle[0]];
  const Position& b = tin.vertices[triangle[1]];
  const Position& c = tin.vertices[triangle[2]];
  const double ux = b.x_m - a.x_m, uy = b.y_m - a.y_m, uz = b.z_m - a.z_m;
  const double vx = c.x_m - a.x_m, vy = c.y_m - a.y_m, vz = c.z_m - a.z_m;
  return {uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
}

/// Steeper than this (83 degrees) is a wall: lit as the flat face that it is, and without a share
/// in the normals of the ground and roofs that it joins.
constexpr double kWallSlope = 8;

bool is_wall(const Normal& n) {
  return std::hypot(n.x, n.y) > kWallSlope * n.z;
}

/// Relief colours from lowland to summit, muted so that light and shade stay readable.
Rgb relief_colour(double share) {
  constexpr std::array<Rgb, 7> kRamp = {{{0.46, 0.59, 0.49},
                                         {0.60, 0.69, 0.53},
                                         {0.78, 0.78, 0.61},
                                         {0.83, 0.75, 0.59},
                                         {0.75, 0.63, 0.52},
                                         {0.72, 0.65, 0.62},
                                         {0.91, 0.89, 0.87}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kRamp.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kRamp.size() - 2);
  return mix(kRamp[i], kRamp[i + 1], at - static_cast<double>(i));
}

/// Where a sample lies in its triangle.
struct Place {
  std::array<double, 3> weight;       // of the corners, sum 1, none negative
  std::array<double, 3> distance_px;  // on the screen to the edge opposite each corner
  bool from_below = false;
};

/// Colours of a mesh, without any camera.
class Painter {
 public:
  Painter(const Tin& tin, const Groups& groups, const PreviewOptions& options)
      : tin_(tin), groups_(groups), options_(options) {
    assert(tin.neighbours.size() == tin.triangles.size());
    assert(groups.group_of_triangle.empty() ||
           groups.group_of_triangle.size() == tin.triangles.size());
    assert(options.culled.empty() || options.culled.size() == tin.triangles.size());
    assert(options.heights_m.empty() || options.heights_m.size() == tin.vertices.size());
    find_normals_and_contrast();
    if (!has_groups()) find_height_range();
  }

  Rgb triangle_colour(TriangleIndex t, const Place& place) const {
    if (place.from_below) return kUnderside;
    const Rgb colour = has_groups() ? group_paint(t) : relief_paint(t, place);
    if (!options_.culled.empty() && options_.culled[t] != 0) return wires(colour, place);
    return mix(lit(colour, light(t, place)), kShade, 0.45 * border_coverage(t, place));
  }

  /// The cut side below a border edge.
  Rgb side_colour(const Position& from, const Position& to) const {
    const Normal outwards = {to.y_m - from.y_m, from.x_m - to.x_m, 0};
    return mix(kCutSide, kShade, 0.20 - 0.25 * lambert(outwards));
  }

 private:
  bool has_groups() const { return !groups_.group_of_triangle.empty(); }

  double height_m(VertexIndex v) const {
    return options_.heights_m.empty() ? tin_.vertices[v].z_m : options_.heights_m[v];
  }

  void find_normals_and_contrast() {
    // Deviation of the light that reads well; terrain with less is stretched up to so much.
    constexpr double kWantedDeviation = 0.17;
    constexpr double kGreatestContrast = 8;
    normals_.resize(tin_.vertices.size());
    double area = 0, squares = 0;
    for (const auto& triangle : tin_.triangles) {
      const Normal n = normal_of(tin_, triangle);
      if (is_wall(n)) continue;
      for (const VertexIndex v : triangle) {
        normals_[v].x += n.x;
        normals_[v].y += n.y;
        normals_[v].z += n.z;
      }
      const double deviation = lambert(n) - kSun.z;
      area += n.z;
      squares += n.z * deviation * deviation;
    }
    const double deviation = area > 0 ? std::sqrt(squares / area) : 0;
    contrast_ = std::clamp(kWantedDeviation / std::max(deviation, 1e-9), 1.0, kGreatestContrast);
  }

  void find_height_range() {
    // The outermost half per cent does not stretch the colours.
    std::vector<double> heights(tin_.vertices.size());
    for (VertexIndex v = 0; v < heights.size(); ++v) heights[v] = height_m(v);
    if (heights.empty()) return;
    const auto cut = static_cast<std::ptrdiff_t>(heights.size() / 200);
    std::nth_element(heights.begin(), heights.begin() + cut, heights.end());
    low_m_ = heights[static_cast<std::size_t>(cut)];
    std::nth_element(heights.begin(), heights.end() - 1 - cut, heights.end());
    high_m_ = *(heights.end() - 1 - cut);
  }

  Rgb group_paint(TriangleIndex t) const {
    const GroupIndex group = groups_.group_of_triangle[t];
    return group == kNone ? kOrphan : group_colour(group);
  }

  Rgb relief_paint(TriangleIndex t, const Place& place) const {
    double height = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      height += place.weight[i] * height_m(tin_.triangles[t][i]);
    }
    return relief_colour(high_m_ > low_m_ ? (height - low_m_) / (high_m_ - low_m_) : 0.3);
  }

  /// Light above (positive) or below that of flat ground, normals smooth between corners.
  double light(TriangleIndex t, const Place& place) const {
    const Normal face = normal_of(tin_, tin_.triangles[t]);
    if (is_wall(face)) return 0.5 * (std::max(lambert(face), 0.0) - kSun.z);
    Normal n;
    for (std::size_t i = 0; i < 3; ++i) {
      const Normal& corner = normals_[tin_.triangles[t][i]];
      const double length =
          std::sqrt(corner.x * corner.x + corner.y * corner.y + corner.z * corner.z);
      n.x += place.weight[i] * corner.x / length;
      n.y += place.weight[i] * corner.y / length;
      n.z += place.weight[i] * corner.z / length;
    }
    // A little light straight from above tells ridges that run along the sun's direction.
    constexpr double kFromAbove = 0.3;
    const double length = std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
    const double lost = length > 0 ? 1 - n.z / length : 0;
    return contrast_ * (std::max(lambert(n), 0.0) - kSun.z - kFromAbove * lost);
  }

  static Rgb lit(const Rgb& colour, double light) {
    // Shade is softened at its dark end, so that no slope turns black.
    if (light < 0) return mix(colour, kShade, 0.85 * (1 - std::exp(1.8 * light)));
    return mix(colour, kSunlit, std::min(1.5 * light, 0.55));
  }

  /// How much of the sample a line along the edges of the group, or of the ground, covers.
  double border_coverage(TriangleIndex t, const Place& place) const {
    double nearest_px = 1e9;
    for (std::size_t i = 0; i < 3; ++i) {
      const TriangleIndex other = tin_.neighbours[t][i];
      const bool border = other == kNone || (has_groups() && groups_.group_of_triangle[t] !=
                                                                 groups_.group_of_triangle[other]);
      if (border) nearest_px = std::min(nearest_px, place.distance_px[i]);
    }
    return std::clamp(1 - nearest_px, 0.0, 1.0);
  }

  static Rgb wires(const Rgb& colour, const Place& place) {
    const double nearest_px = *std::min_element(place.distance_px.begin(), place.distance_px.end());
    const double coverage = std::clamp(1 - nearest_px, 0.0, 1.0);
    return mix(kBackground, mix(colour, kShade, 0.15), 0.55 * coverage);
  }

  const Tin& tin_;
  const Groups& groups_;
  const PreviewOptions& options_;
  std::vector<Normal> normals_;  // of the vertices, by area
  double contrast_ = 1;
  double low_m_ = 0;
  double high_m_ = 0;
};

/// Finds the place of samples in triangles, in perspective: with c the corners' (x, y, w), weights
/// go as the determinants |s c1 c2|, |c0 s c2|, |c0 c1 s| of the sample s = (x, y, 1). Works for
/// corners behind the camera too.
class Placer {
 public:
  Placer(std::span<const ClipPosition> clip, int width_px, int height_px)
      : clip_(clip), px_x_(2.0 / width_px), px_y_(2.0 / height_px) {}

  Place place(const std::array<VertexIndex, 3>& triangle, double x, double y) const {
    std::array<std::array<double, 3>, 3> line;  // weight i goes as line[i] . (x, y, 1)
    std::array<double, 3> value, sum = {};
    double total = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const ClipPosition& a = clip_[triangle[(i + 1) % 3]];
      const ClipPosition& b = clip_[triangle[(i + 2) % 3]];
      line[i] = {a.y * b.w - a.w * b.y, a.w * b.x - a.x * b.w, a.x * b.y - a.y * b.x};
      value[i] = line[i][0] * x + line[i][1] * y + line[i][2];
      total += value[i];
      for (std::size_t k = 0; k < 3; ++k) sum[k] += line[i][k];
    }
    Place place;
    place.from_below = total < 0;
    double kept = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double weight = total != 0 ? value[i] / total : 1.0 / 3;
      const double slope_x = px_x_ * (line[i][0] - weight * sum[0]) / total;
      const double slope_y = px_y_ * (line[i][1] - weight * sum[1]) / total;
      place.weight[i] = std::max(weight, 0.0);
      place.distance_px[i] = place.weight[i] / std::max(std::hypot(slope_x, slope_y), 1e-30);
      kept += place.weight[i];
    }
    for (double& weight : place.weight) weight /= kept;
    return place;
  }

 private:
  std::span<const ClipPosition> clip_;
  double px_x_;
  double px_y_;
};

std::uint8_t byte(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255));
}

void set_pixel(Picture& picture, int x, int y, const Rgb& colour) {
  const std::size_t at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) +
           static_cast<std::size_t>(x));
  picture.rgb[at] = byte(colour.r);
  picture.rgb[at + 1] = byte(colour.g);
  picture.rgb[at + 2] = byte(colour.b);
}

/// Asks for each sample's colour and writes their means. colour_at(x, y) is called with samples.
template <typename ColourAt>
Picture develop(int width_px, int height_px, const ColourAt& colour_at) {
  Picture picture;
  picture.width_px = width_px;
  picture.height_px = height_px;
  picture.rgb.resize(3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  parallel_for(static_cast<std::size_t>(height_px), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < width_px; ++x) {
      Rgb sum;
      for (int sample = 0; sample < kSamples * kSamples; ++sample) {
        const Rgb colour =
            colour_at(x * kSamples + sample % kSamples, y * kSamples + sample / kSamples);
        sum = {sum.r + colour.r, sum.g + colour.g, sum.b + colour.b};
      }
      constexpr double kShare = 1.0 / (kSamples * kSamples);
      set_pixel(picture, x, y, {sum.r * kShare, sum.g * kShare, sum.b * kShare});
    }
  });
  return picture;
}

/// Middle of a sample in clip space's x (or, negated, y).
double sample_to_clip(int sample, int size_px) {
  return 2 * (sample + 0.5) / (kSamples * size_px) - 1;
}

/// The pixel's colour with another laid over it.
Rgb blended(const Picture& picture, int x, int y, const Rgb& colour, double coverage) {
  const std::size_t at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) +
           static_cast<std::size_t>(x));
  const Rgb under = {picture.rgb[at] / 255.0, picture.rgb[at + 1] / 255.0,
                     picture.rgb[at + 2] / 255.0};
  return mix(under, colour, coverage);
}

/// A red ring with a dot and four ticks on a white rim, centred on the eye. Requires eye.w > 0.
void draw_mark(Picture& picture, const ClipPosition& eye) {
  const double centre_x = (eye.x / eye.w + 1) / 2 * picture.width_px;
  const double centre_y = (1 - eye.y / eye.w) / 2 * picture.height_px;
  const double radius_px = std::max(7.0, 0.014 * std::min(picture.width_px, picture.height_px));
  const double half_line_px = 0.16 * radius_px;
  const double rim_px = 0.2 * radius_px;
  const double reach_px = 2 * radius_px;
  if (!(std::abs(centre_x) < 1e6 && std::abs(centre_y) < 1e6)) return;
  const int left = std::max(0, static_cast<int>(centre_x - reach_px));
  const int right = std::min(picture.width_px - 1, static_cast<int>(centre_x + reach_px));
  const int top = std::max(0, static_cast<int>(centre_y - reach_px));
  const int bottom = std::min(picture.height_px - 1, static_cast<int>(centre_y + reach_px));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const double dx = std::abs(x + 0.5 - centre_x), dy = std::abs(y + 0.5 - centre_y);
      const double from_centre = std::hypot(dx, dy);
      const double ring = std::abs(from_centre - radius_px) - half_line_px;
      const double dot = from_centre - 0.3 * radius_px;
      const double along = std::max(dx, dy), across = std::min(dx, dy);
      const double tick =
          std::max(across - half_line_px, std::abs(along - 1.3 * radius_px) - 0.3 * radius_px);
      const double outside_px = std::min({ring, dot, tick});
      const Rgb rim =
          blended(picture, x, y, {1, 1, 1}, 0.85 * std::clamp(rim_px + 0.5 - outside_px, 0.0, 1.0));
      set_pixel(picture, x, y, mix(rim, kMark, std::clamp(0.5 - outside_px, 0.0, 1.0)));
    }
  }
}

/// The block of ground that a picture from a camera shows: the surface, and below each border edge
/// two triangles down to a common base, whose object number is triangles + edge.
struct Block {
  std::vector<Position> positions;
  std::vector<std::array<VertexIndex, 3>> triangles;
  std::vector<std::uint32_t> objects;
  std::vector<std::array<VertexIndex, 2>> border;  // ground on the left
};

Block block_of(const Tin& tin, const View& view) {
  Block block;
  block.positions.resize(tin.vertices.size());
  std::transform(tin.vertices.begin(), tin.vertices.end(), block.positions.begin(),
                 [&](const Position& p) { return exaggerated(view, p); });
  block.triangles = tin.triangles;
  block.objects.resize(tin.triangles.size());
  for (std::uint32_t t = 0; t < block.objects.size(); ++t) block.objects[t] = t;

  const Bounds bounds = bounds_of(block.positions);
  const double extent_m =
      std::max(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m);
  const double base_z_m = bounds.low.z_m - kBlockBaseShare * extent_m;
  for (TriangleIndex t = 0; t < tin.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      if (tin.neighbours[t][i] != kNone) continue;
      const VertexIndex from = tin.triangles[t][(i + 1) % 3];
      const VertexIndex to = tin.triangles[t][(i + 2) % 3];
      const auto low = static_cast<VertexIndex>(block.positions.size());
      for (const VertexIndex v : {from, to}) {
        const Position p = block.positions[v];
        block.positions.push_back({p.x_m, p.y_m, base_z_m});
      }
      block.triangles.push_back({low, low + 1, to});
      block.triangles.push_back({low, to, from});
      block.objects.resize(block.triangles.size(),
                           static_cast<std::uint32_t>(tin.triangles.size() + block.border.size()));
      block.border.push_back({from, to});
    }
  }
  return block;
}

Rgb sky(double share_from_top) {
  return mix(kSkyTop, kSkyBottom, std::sqrt(std::sqrt(share_from_top) * share_from_top));
}

}  // namespace

Rgb group_colour(GroupIndex group) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr std::array<double, 3> kLightness = {0.74, 0.83, 0.65};
  constexpr double kChroma = 0.115;
  const double turns = group * kGolden;
  const double hue_rad = 2 * std::numbers::pi * (turns - std::floor(turns));
  // Oklab (Ottosson 2020) keeps hues equally bright.
  const double lightness = kLightness[group % kLightness.size()];
  const double a = kChroma * std::cos(hue_rad), b = kChroma * std::sin(hue_rad);
  const auto cube = [](double value) { return value * value * value; };
  const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
  const auto encode = [](double linear) {
    const double v = std::clamp(linear, 0.0, 1.0);
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  };
  return {encode(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          encode(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          encode(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

Picture preview_from_above(const Tin& tin, const Groups& groups, const PreviewOptions& options) {
  const int width_px = options.width_px, height_px = options.height_px;
  if (tin.triangles.empty()) {
    return develop(width_px, height_px, [](int, int) { return kBackground; });
  }
  const Painter painter(tin, groups, options);
  const Projection projection =
      ortho_from_above(bounds_of(tin.vertices), width_px, height_px, options.margin_px);
  const std::vector<ClipPosition> clip = project_all(projection, tin.vertices);
  Target target = empty_target(kSamples * width_px, kSamples * height_px);
  rasterise(target, clip, tin.triangles);

  const Placer placer(clip, width_px, height_px);
  Picture picture = develop(width_px, height_px, [&](int x, int y) {
    const std::uint32_t t = target.object[target.index(x, y)];
    if (t == kNone) return kBackground;
    return painter.triangle_colour(t, placer.place(tin.triangles[t], sample_to_clip(x, width_px),
                                                   -sample_to_clip(y, height_px)));
  });
  if (options.eye) draw_mark(picture, projection.project(*options.eye));
  return picture;
}

Picture preview_3d(const Tin& tin, const Groups& groups, const View& view,
                   const PreviewOptions& options) {
  const int width_px = options.width_px, height_px = options.height_px;
  const auto sky_at = [&](int y) { return sky((y + 0.5) / (kSamples * height_px)); };
  if (tin.triangles.empty()) {
    return develop(width_px, height_px, [&](int, int y) { return sky_at(y); });
  }
  const Painter painter(tin, groups, options);
  const Block block = block_of(tin, view);
  const Projection projection = look_at(view, width_px, height_px);
  const std::vector<ClipPosition> clip = project_all(projection, block.positions);
  Target target = empty_target(kSamples * width_px, kSamples * height_px);
  rasterise(target, clip, block.triangles, block.objects);

  // Haze grows from the nearest to the farthest ground in the picture; distance is 1 / depth.
  constexpr double kMostHaze = 0.32;
  float nearest = 0, farthest = 1;
  for (const float depth : target.depth) {
    if (depth > 0) nearest = std::max(nearest, depth), farthest = std::min(farthest, depth);
  }
  const auto hazy = [&](const Rgb& colour, float depth) {
    if (nearest <= farthest) return colour;
    const double share = (1.0 / depth - 1.0 / nearest) / (1.0 / farthest - 1.0 / nearest);
    return mix(colour, kHaze, kMostHaze * share * share);
  };
  const Placer placer(clip, width_px, height_px);
  Picture picture = develop(width_px, height_px, [&](int x, int y) {
    const std::size_t at = target.index(x, y);
    const std::uint32_t object = target.object[at];
    if (object == kNone) return sky_at(y);
    if (object >= tin.triangles.size()) {
      const auto [from, to] = block.border[object - tin.triangles.size()];
      return hazy(painter.side_colour(block.positions[from], block.positions[to]),
                  target.depth[at]);
    }
    const Place place = placer.place(tin.triangles[object], sample_to_clip(x, width_px),
                                     -sample_to_clip(y, height_px));
    return hazy(painter.triangle_colour(object, place), target.depth[at]);
  });
  if (options.eye) {
    const ClipPosition eye = projection.project(exaggerated(view, *options.eye));
    if (eye.w >= view.near_m) draw_mark(picture, eye);
  }
  return picture;
}

}  // namespace scarp
