#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace scarp {

/// A rectangle of pixels, all of its ends included.
struct PixelBox {
  int left, top, right, bottom;
};

/// Levels of a picture's depths, each as many times smaller than the one below it as a block has
/// pixels on a side: what covers a texel, how much of it, and how far behind that is at most.
class CoveragePyramid {
 public:
  /// @param depth  [height * width], greater is nearer, 0 where nothing covers the pixel
  /// @param block  pixels a side that become one of the next level, >= 2
  /// Cost: O(pixels), rows in parallel. Its memory is reused.
  void build(int width_px, int height_px, std::span<const float> depth, int block = 2);

  /// Whether what is no nearer than `nearest` and lies in the box is covered: from coarse to fine,
  /// until in every texel at least `opacity` is covered, by what is nearer. With opacity 1 every
  /// pixel of the box is; with less, holes do not count that are small beside a texel.
  /// Requires a box within the picture. Cost: O(log pixels) where it is clear, O(box) at worst.
  bool covers(const PixelBox& box, float nearest, float opacity = 1) const;

  /// Whether enough is covered, however far behind: the test of overlap alone.
  bool overlaps(const PixelBox& box, float opacity) const { return covers(box, -1, opacity); }

  int width_px() const { return levels_.empty() ? 0 : levels_[0].width; }
  int height_px() const { return levels_.empty() ? 0 : levels_[0].height; }

 private:
  struct Texel {
    float farthest;  // of what covers it, HUGE_VALF where nothing does
    float opacity;   // share of its pixels that are covered
  };
  struct Level {
    int width, height;
    int scale;  // pixels a side
    std::vector<Texel> texels;
  };

  void join(const Level& fine, Level& coarse, int row) const;
  bool covers(std::size_t level, int x, int y, const PixelBox& box, float nearest,
              float opacity) const;

  int block_ = 2;
  std::vector<Level> levels_;  // finest first
};

}  // namespace scarp
