#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/raster/camera.h"
#include "core/terrain/tin.h"

namespace scarp {

/// What some triangles hide from a camera, by the pixels of a small picture.
///
/// Side: a ray anywhere in a pixel meets one of the triangles at the pixel's depth or nearer
/// (greater); 0 where that is not known of all its rays.
struct OcclusionMap {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> depth;  ///< [height * width], rows from the top
};

/// Edges count as touching a pixel within this distance of it, pixels: more than the rounding of
/// corners when a picture of at most 64 times the map's size is drawn.
inline constexpr double kEdgeMarginPx = 1.0 / 8;

/// Draws triangles of a surface so that a pixel counts only where it is covered entirely, not by
/// one triangle but by connected ones together.
///
/// Why it is right. Take a triangle at a pixel's centre, and all that can be reached from it over
/// shared edges within the pixel: a layer. Unless an edge lies in the pixel at which the layer
/// ends, or turns away from the camera, the layer covers the pixel once and whole. Its triangles
/// meet within the pixel, so their depths make one interval without gaps: of all that touches the
/// pixel, what does not overlap that interval is not of the layer. So depths are united to
/// intervals that do not overlap, and the nearest of them counts that holds a centre and no end.
///
/// Keeps a reference to the TIN, which must outlive it; one thread at a time.
class OcclusionMapper {
 public:
  explicit OcclusionMapper(const Tin& tin) : tin_(tin), is_drawn_(tin.triangles.size(), 0) {}

  /// @param occluders  triangles, none twice; cut off at the near plane
  /// @param map[out]   of the size that it has; its memory is reused
  /// Cost: O(p log d) for p pixels that occluders touch, d of them one pixel; 16 bytes each.
  void draw(const Projection& projection, std::span<const TriangleIndex> occluders,
            OcclusionMap& map);

 private:
  /// A triangle, or a part of one that is cut off at the near plane.
  struct ScreenTriangle {
    std::array<double, 3> x_px, y_px, depth;
    std::array<bool, 3> is_end;  // the layer ends at the edge opposite to the corner
  };

  /// What touches a pixel: depths, and whether it covers the centre or is where a layer ends.
  struct Touch {
    std::uint32_t pixel;
    float low, high;
    bool is_at_centre, is_end;
  };

  void add(TriangleIndex triangle, const OcclusionMap& map);
  void touch_pixels(const ScreenTriangle& triangle, int turn, const OcclusionMap& map);
  void touch_end(const ScreenTriangle& triangle, std::size_t corner, const OcclusionMap& map);
  int turn_of(TriangleIndex triangle) const;

  const Tin& tin_;
  Projection projection_;
  std::vector<std::uint8_t> is_drawn_;  // [triangles]
  std::vector<Touch> touches_, by_pixel_;
  std::vector<std::uint32_t> first_;  // [pixels + 1] into by_pixel_
};

}  // namespace scarp
