#include "core/raster/coverage_pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scarp {
namespace {

std::size_t at(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

}  // namespace

void CoveragePyramid::build(int width_px, int height_px, std::span<const float> depth) {
  assert(width_px > 0 && height_px > 0 && depth.size() == at(width_px, 0, height_px));
  std::size_t count = 1;
  for (int w = width_px, h = height_px; w > 1 || h > 1; w = (w + 1) / 2, h = (h + 1) / 2) ++count;
  levels_.resize(count);
  levels_[0].width = width_px;
  levels_[0].height = height_px;
  levels_[0].texels.resize(depth.size());
  for (std::size_t i = 0; i < depth.size(); ++i)
    levels_[0].texels[i] = depth[i] > 0 ? Texel{depth[i], 1} : Texel{HUGE_VALF, 0};
  for (std::size_t k = 1; k < count; ++k) {
    const Level& fine = levels_[k - 1];
    Level& coarse = levels_[k];
    coarse.width = (fine.width + 1) / 2;
    coarse.height = (fine.height + 1) / 2;
    coarse.texels.resize(at(coarse.width, 0, coarse.height));
    for (int y = 0; y < coarse.height; ++y)
      for (int x = 0; x < coarse.width; ++x) {
        Texel sum{HUGE_VALF, 0};
        int parts = 0;
        for (int dy = 0; dy < 2 && 2 * y + dy < fine.height; ++dy)
          for (int dx = 0; dx < 2 && 2 * x + dx < fine.width; ++dx, ++parts) {
            const Texel& part = fine.texels[at(fine.width, 2 * x + dx, 2 * y + dy)];
            sum.farthest = std::min(sum.farthest, part.farthest);
            sum.opacity += part.opacity;
          }
        sum.opacity /= static_cast<float>(parts);
        coarse.texels[at(coarse.width, x, y)] = sum;
      }
  }
}

bool CoveragePyramid::covers(std::size_t level, int x, int y, const PixelBox& box, float nearest,
                             float opacity) const {
  const Texel& texel = levels_[level].texels[at(levels_[level].width, x, y)];
  if (texel.opacity >= opacity && texel.farthest > nearest) return true;
  if (level == 0 || texel.opacity == 0) return false;
  const Level& fine = levels_[level - 1];
  const int shift = static_cast<int>(level) - 1;
  for (int fy = std::max(2 * y, box.top >> shift);
       fy <= std::min({2 * y + 1, fine.height - 1, box.bottom >> shift}); ++fy)
    for (int fx = std::max(2 * x, box.left >> shift);
         fx <= std::min({2 * x + 1, fine.width - 1, box.right >> shift}); ++fx)
      if (!covers(level - 1, fx, fy, box, nearest, opacity)) return false;
  return true;
}

bool CoveragePyramid::covers(const PixelBox& box, float nearest, float opacity) const {
  assert(box.left >= 0 && box.right < width_px() && box.top >= 0 && box.bottom < height_px());
  return covers(levels_.size() - 1, 0, 0, box, nearest, opacity);
}

}  // namespace scarp
