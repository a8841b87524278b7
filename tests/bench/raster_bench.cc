// Throughput of the software rasteriser on one core, by size of triangle: in vectors, plainly, and
// how many times faster vectors are.
// Run: raster_bench [seconds per size]

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <random>

#include "core/raster/raster_kernels.h"
#include "core/raster/rasterise.h"
#include "core/threads/parallel_for.h"

namespace {

using namespace scarp;

constexpr int kWidthPx = 1024;
constexpr int kHeightPx = 512;

/// Right triangles that fill half of a box of size_px, turned four ways, at random places; corners
/// of their own, so the cost of placing vertices is counted in full.
struct Scene {
  std::vector<ClipPosition> clip;
  std::vector<std::array<VertexIndex, 3>> triangles;
};

Scene boxes(int size_px, std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(0, kWidthPx - size_px), y(0, kHeightPx - size_px);
  std::uniform_real_distribution<double> depth(0.1, 0.9);
  std::uniform_int_distribution<int> left_out(0, 3);
  Scene scene;
  for (std::size_t i = 0; i < count; ++i) {
    const double x_px = x(random), y_px = y(random);
    const int without = left_out(random);
    const auto first = static_cast<VertexIndex>(scene.clip.size());
    for (int corner = 0; corner < 4; ++corner) {
      if (corner == without) continue;
      scene.clip.push_back({2 * (x_px + size_px * (corner % 2)) / kWidthPx - 1,
                            1 - 2 * (y_px + size_px * (corner / 2)) / kHeightPx, depth(random), 1});
    }
    scene.triangles.push_back({first, first + 1, first + 2});
  }
  return scene;
}

/// Processor time of the fastest repetition: other programs on the machine count little.
double best_seconds(const Scene& scene, Target& target, double budget_s) {
  double best_s = 1e9, spent_s = 0;
  while (spent_s < budget_s) {
    std::fill(target.depth.begin(), target.depth.end(), 0.0F);
    const std::clock_t start = std::clock();
    rasterise(target, scene.clip, scene.triangles);
    const double elapsed_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    best_s = std::min(best_s, elapsed_s);
    spent_s += elapsed_s;
  }
  return best_s;
}

}  // namespace

int main(int count, char** arguments) {
  const double budget_s = count > 1 ? std::atof(arguments[1]) : 1.0;
  set_thread_count(1);
  fmt::print("size_px  kind          Mtriangles/s  Gpixels/s  plainly, Mtriangles/s  ratio\n");
  for (const int size_px : {1, 5, 10, 25, 50, 100}) {
    const std::size_t triangles = size_px <= 10 ? 200'000 : 20'000;
    const Scene scene = boxes(size_px, triangles);
    const double pixels = static_cast<double>(triangles) * size_px * size_px / 2;
    const double millions = static_cast<double>(triangles) / 1e6;
    for (const bool with_objects : {false, true}) {
      Target target = with_objects ? empty_target(kWidthPx, kHeightPx)
                                   : empty_depth_target(kWidthPx, kHeightPx);
      set_kernel_path(KernelPath::kPlain);
      const double plain_s = best_seconds(scene, target, budget_s);
      set_kernel_path(KernelPath::kVectors);
      const double vector_s = best_seconds(scene, target, budget_s);
      fmt::print("{:7}  {:12}  {:12.2f}  {:9.3f}  {:21.2f}  {:5.2f}\n", size_px,
                 with_objects ? "with objects" : "depth only", millions / vector_s,
                 pixels / vector_s / 1e9, millions / plain_s, plain_s / vector_s);
    }
  }
}
