#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace scarp {

/// A rectangle of pixels, all of its ends included.
struct PixelBox {
  int left, top, right, bottom;
};

/// Levels of a picture's depths, each half the size of the one below it: what covers a texel, how
/// much of it, and how far behind that is at most.
class CoveragePyramid {
 public:
  /// @param depth  [height * width], greater is nearer, 0 where nothing covers the pixel
  /// Cost: O(pixels). Its memory is reused.
  void build(int width_px, int height_px, std::span<const float> depth);

  /// Whether what is no nearer than `nearest` and lies in the box is covered: from coarse to fine,
  /// until in every texel at least `opacity` is covered, by what is nearer. With opacity 1 every
  /// pixel of the box is; with less, holes do not count that are small beside a texel.
  /// Requires a box within the picture. Cost: O(log pixels) where it is clear, O(box) at worst.
  bool covers(const PixelBox& box, float nearest, float opacity = 1) const;

  int width_px() const { return levels_.empty() ? 0 : levels_[0].width; }
  int height_px() const { return levels_.empty() ? 0 : levels_[0].height; }

 private:
  struct Texel {
    float farthest;  // of what covers it, HUGE_VALF where nothing does
    float opacity;   // share of its pixels that are covered
  };
  struct Level {
    int width, height;
    std::vector<Texel> texels;
  };

  bool covers(std::size_t level, int x, int y, const PixelBox& box, float nearest,
              float opacity) const;

  std::vector<Level> levels_;  // finest first
};

}  // namespace scarp
