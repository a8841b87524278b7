#include "core/raster/coverage_pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

std::size_t at(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

/// Rows that one thread joins at a time, at least.
constexpr int kRows = 32;

}  // namespace

void CoveragePyramid::join(const Level& fine, Level& coarse, int y) const {
  for (int x = 0; x < coarse.width; ++x) {
    Texel sum{HUGE_VALF, 0};
    int parts = 0;
    for (int dy = 0; dy < block_ && block_ * y + dy < fine.height; ++dy)
      for (int dx = 0; dx < block_ && block_ * x + dx < fine.width; ++dx, ++parts) {
        const Texel& part = fine.texels[at(fine.width, block_ * x + dx, block_ * y + dy)];
        sum.farthest = std::min(sum.farthest, part.farthest);
        sum.opacity += part.opacity;
      }
    sum.opacity /= static_cast<float>(parts);
    coarse.texels[at(coarse.width, x, y)] = sum;
  }
}

void CoveragePyramid::build(int width_px, int height_px, std::span<const float> depth, int block) {
  assert(width_px > 0 && height_px > 0 && depth.size() == at(width_px, 0, height_px) && block >= 2);
  block_ = block;
  const auto fewer = [&](int size) { return (size + block - 1) / block; };
  std::size_t count = 1;
  for (int w = width_px, h = height_px; w > 1 || h > 1; w = fewer(w), h = fewer(h)) ++count;
  levels_.resize(count);
  levels_[0].width = width_px;
  levels_[0].height = height_px;
  levels_[0].scale = 1;
  levels_[0].texels.resize(depth.size());
  const auto by_rows = [](int rows, const auto& body) {
    const int parts = (rows + kRows - 1) / kRows;
    const auto part = [&](std::size_t p) {
      const int first = static_cast<int>(p) * kRows;
      for (int y = first; y < std::min(rows, first + kRows); ++y) body(y);
    };
    if (parts == 1)
      part(0);
    else
      parallel_for(static_cast<std::size_t>(parts), part);
  };
  by_rows(height_px, [&](int y) {
    for (std::size_t i = at(width_px, 0, y); i < at(width_px, 0, y + 1); ++i)
      levels_[0].texels[i] = depth[i] > 0 ? Texel{depth[i], 1} : Texel{HUGE_VALF, 0};
  });
  for (std::size_t k = 1; k < count; ++k) {
    const Level& fine = levels_[k - 1];
    Level& coarse = levels_[k];
    coarse.width = fewer(fine.width);
    coarse.height = fewer(fine.height);
    coarse.scale = fine.scale * block;
    coarse.texels.resize(at(coarse.width, 0, coarse.height));
    by_rows(coarse.height, [&](int y) { join(fine, coarse, y); });
  }
}

bool CoveragePyramid::covers(std::size_t level, int x, int y, const PixelBox& box, float nearest,
                             float opacity) const {
  const Texel& texel = levels_[level].texels[at(levels_[level].width, x, y)];
  if (texel.opacity >= opacity && texel.farthest > nearest) return true;
  if (level == 0 || texel.opacity == 0) return false;
  const Level& fine = levels_[level - 1];
  const int last_x = std::min({block_ * x + block_ - 1, fine.width - 1, box.right / fine.scale});
  const int last_y = std::min({block_ * y + block_ - 1, fine.height - 1, box.bottom / fine.scale});
  for (int fy = std::max(block_ * y, box.top / fine.scale); fy <= last_y; ++fy)
    for (int fx = std::max(block_ * x, box.left / fine.scale); fx <= last_x; ++fx)
      if (!covers(level - 1, fx, fy, box, nearest, opacity)) return false;
  return true;
}

bool CoveragePyramid::covers(const PixelBox& box, float nearest, float opacity) const {
  assert(box.left >= 0 && box.right < width_px() && box.top >= 0 && box.bottom < height_px());
  return covers(levels_.size() - 1, 0, 0, box, nearest, opacity);
}

}  // namespace scarp
