#include "core/raster/raster_kernels.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cstring>
#include <random>

#include "core/raster/rasterise.h"

namespace scarp {
namespace {

/// Sets a path, and the vectors that may be taken, and puts everything back.
class OnPath {
 public:
  explicit OnPath(KernelPath path, std::int64_t targets = 0) {
    set_kernel_path(path);
    hwy::SetSupportedTargetsForTest(targets);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
  ~OnPath() {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    set_kernel_path(KernelPath::kVectors);
  }
};

struct Soup {
  std::vector<ClipPosition> corners;
  std::vector<std::array<VertexIndex, 3>> triangles;
};

/// Triangles of all sizes in perspective, many cut, thin, degenerate, or of equal depth.
Soup random_soup(std::uint32_t seed, int count) {
  std::mt19937 random(seed);
  const auto unit = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  Soup soup;
  for (int i = 0; i < count; ++i) {
    const double size = std::pow(10.0, -3 + 3.3 * unit());
    const double x = 2.4 * unit() - 1.2, y = 2.4 * unit() - 1.2, z = i % 5 == 0 ? 0.5 : unit();
    const auto first = static_cast<VertexIndex>(soup.corners.size());
    for (int k = 0; k < 3; ++k) {
      const double w = i % 7 == 0 ? 3 * unit() - 0.5 : 0.3 + unit();
      const double depth = i % 5 == 0 ? 0.5 : z + 0.1 * (unit() - 0.5);
      soup.corners.push_back(
          {(x + size * (unit() - 0.5)) * w, (y + size * (unit() - 0.5)) * w, depth * w, w});
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

Target drawn(const Soup& soup, int width_px, int height_px, bool with_objects) {
  Target target =
      with_objects ? empty_target(width_px, height_px) : empty_depth_target(width_px, height_px);
  rasterise(target, soup.corners, soup.triangles);
  return target;
}

bool same_bits(const Target& a, const Target& b) {
  return a.object == b.object && a.depth.size() == b.depth.size() &&
         std::memcmp(a.depth.data(), b.depth.data(), a.depth.size() * sizeof(float)) == 0;
}

TEST(RasterKernels, EveryInstructionSetDrawsTheSameBitsAsThePlainLoops) {
  std::int64_t left = hwy::SupportedTargets();
  std::vector<std::int64_t> targets;
  for (; left != 0; left &= left - 1) targets.push_back(left & -left);
  ASSERT_FALSE(targets.empty());
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Soup soup = random_soup(seed, 1500);
    // Wide, narrower than any vector, and with last tiles that are narrower than one.
    for (const auto& [width_px, height_px] : {std::pair{300, 150}, {9, 200}, {133, 70}, {64, 64}})
      for (const bool with_objects : {false, true}) {
        Target plain;
        {
          const OnPath on(KernelPath::kPlain);
          plain = drawn(soup, width_px, height_px, with_objects);
        }
        for (const std::int64_t target : targets) {
          const OnPath on(KernelPath::kVectors, target);
          ASSERT_TRUE(same_bits(drawn(soup, width_px, height_px, with_objects), plain))
              << hwy::TargetName(target) << ", seed " << seed << ", " << width_px << " x "
              << height_px << (with_objects ? " with objects" : "");
        }
      }
  }
}

TEST(RasterKernels, TheForcedPathIsTheOneThatRuns) {
  EXPECT_EQ(kernel_path_for(nullptr), KernelPath::kVectors);
  EXPECT_EQ(kernel_path_for(""), KernelPath::kVectors);
  EXPECT_EQ(kernel_path_for("1"), KernelPath::kPlain);
  std::vector<float> depth(64 * 64, 0);
  const PixelTile tile{0, 0, 64, 64, 64, depth.data(), nullptr};
  const ScreenTriangle triangle{{0, 5000, 0}, {0, 0, 5000}, 0.5, 0, 0, 0};
  const std::uint32_t which[] = {0};
  for (const KernelPath path : {KernelPath::kPlain, KernelPath::kVectors}) {
    const OnPath on(path);
    EXPECT_EQ(fill_triangles(tile, &triangle, which), path);
  }
}

}  // namespace
}  // namespace scarp
