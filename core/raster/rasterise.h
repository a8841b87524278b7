#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/raster/camera.h"
#include "core/raster/screen_triangle.h"

namespace scarp {

/// What is nearest in each pixel. Rows from the top, pixel (x, y) has its centre at
/// (x + 0.5, y + 0.5). An empty `object` asks for depth alone, which is faster.
struct Target {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> depth;           ///< [height * width], greater is nearer, 0 where nothing is
  std::vector<std::uint32_t> object;  ///< [height * width] or empty, kNone where nothing is

  std::size_t index(int x_px, int y_px) const {
    return static_cast<std::size_t>(y_px) * static_cast<std::size_t>(width_px) +
           static_cast<std::size_t>(x_px);
  }
};

/// Targets with nothing in them. Requires (asserted) sizes in [1, kGreatestSizePx].
Target empty_target(int width_px, int height_px);
Target empty_depth_target(int width_px, int height_px);

inline constexpr int kGreatestSizePx = 1 << 16;

/// Draws triangles over what the target already holds.
///
/// @param target     depth and object numbers, changed where a triangle is nearer
/// @param vertices   corners in clip space; finite
/// @param triangles  three indices each; both sides are drawn
/// @param objects    [triangles] object number of each; empty: the triangle's own index
///
/// A pixel belongs to a triangle when its centre lies inside, or on a left or a top edge (on a
/// centre that two triangles share by an edge exactly one of them falls). Only what lies beyond
/// the near plane (z <= w) and before the farthest (z >= 0) is drawn. Of equal depths the lowest
/// object number stays, so the result does not depend on the order of the triangles, nor on the
/// number of threads.
///
/// Accuracy: corners within half a subpixel; depth linear between them, about 1e-7 relative.
/// A triangle that is cut (by the near plane, or 2^20 px away from the picture) is drawn as a fan
/// whose new corners are rounded too: it leaves no gap to its neighbours, but a pixel on its new
/// edges may be covered twice.
/// Requires (asserted): indices in range; objects empty or one a triangle, none of them kNone.
/// Cost: O(vertices + triangles + pixels covered); memory up to about 30 MB, and 24 bytes a vertex.
/// Source: scan conversion with exact edges, after Pineda 1988 and the usual top-left rule.
void rasterise(Target& target, std::span<const ClipPosition> vertices,
               std::span<const std::array<VertexIndex, 3>> triangles,
               std::span<const std::uint32_t> objects = {});

}  // namespace scarp
