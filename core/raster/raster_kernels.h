#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/raster/camera.h"
#include "core/raster/screen_triangle.h"

namespace scarp {

/// The loops of the rasteriser over plain arrays. Each is written twice: once plainly, which is its
/// definition, and once in vectors of any length (Highway), for several instruction sets of which
/// one is chosen at run time. All give the same bits: every operation is rounded by itself, and
/// coverage is integers.

/// On which side of the planes of the view a corner lies: a triangle all outside one is not seen.
enum Outside : std::uint32_t {
  kLeft = 1,
  kRight = 2,
  kBelow = 4,
  kAbove = 8,
  kTooNear = 16,
  kTooFar = 32,
  kBeyondGuard = 64,  // of any side; such triangles are cut
};

/// No corner is farther than this from the picture: with 8 bits of subpixels, coordinates stay
/// under 2^29, their differences under 2^30 and products of two differences under 2^60.
inline constexpr double kGuardPx = 1 << 20;

/// How clip space lands on the pixels of a picture.
struct ScreenMap {
  double half_width_px, half_height_px;
  double guard_x, guard_y;  ///< |x| and |y| beyond so many w are beyond the guard

  ScreenMap(int width_px, int height_px)
      : half_width_px(width_px / 2.0),
        half_height_px(height_px / 2.0),
        guard_x(kGuardPx / half_width_px),
        guard_y(kGuardPx / half_height_px) {}
};

/// Requires a corner that is neither too near nor beyond the guard, up to rounding.
ScreenCorner place_corner(const ScreenMap& map, const ClipPosition& p);

/// Corners on the screen, one array a property. Where a corner is too near or beyond the guard,
/// its place means nothing.
struct ScreenCorners {
  std::vector<std::int32_t> x, y;  ///< subpixels from the upper left
  std::vector<double> depth;
  std::vector<std::uint32_t> outside;  ///< bits of Outside

  void resize(std::size_t count);
};

/// Which of both is in use. Vectors, unless the environment has SCARP_SCALAR set to something.
enum class KernelPath { kPlain, kVectors };
KernelPath kernel_path();
/// What the value of SCARP_SCALAR asks for; null where it is not set.
KernelPath kernel_path_for(const char* scarp_scalar);
/// For tests and benchmarks; not while anything is drawn.
void set_kernel_path(KernelPath path);

/// Places the corners [begin, end).
void place_corners(const ScreenMap& map, std::span<const ClipPosition> corners, std::size_t begin,
                   std::size_t end, ScreenCorners& placed);

/// Draws some triangles into a tile, in order: depth wherever it is nearer (greater) than what is
/// there; of equal depths the lowest object number stays. A run of pixels begins with the depth of
/// its first pixel, rounded to float; pixel i of it has `first + step * float(i)`, rounded twice.
/// @return what ran: tiles that are narrower than a vector are filled plainly
KernelPath fill_triangles(const PixelTile& tile, const ScreenTriangle* triangles,
                          std::span<const std::uint32_t> which);

}  // namespace scarp
