// Depth-only throughput of the software rasteriser on one core, by size of triangle.
// Run: raster_bench [seconds per size]

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <random>

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
  fmt::print("size_px  kind          Mtriangles/s  Gpixels/s\n");
  for (const int size_px : {1, 5, 10, 25, 50, 100}) {
    const std::size_t triangles = size_px <= 10 ? 200'000 : 20'000;
    const Scene scene = boxes(size_px, triangles);
    const double pixels = static_cast<double>(triangles) * size_px * size_px / 2;
    Target depth = empty_depth_target(kWidthPx, kHeightPx);
    const double depth_s = best_seconds(scene, depth, budget_s);
    Target objects = empty_target(kWidthPx, kHeightPx);
    const double objects_s = best_seconds(scene, objects, budget_s);
    const double millions = static_cast<double>(triangles) / 1e6;
    fmt::print("{:7}  depth only    {:12.2f}  {:9.3f}\n", size_px, millions / depth_s,
               pixels / depth_s / 1e9);
    fmt::print("{:7}  with objects  {:12.2f}  {:9.3f}\n", size_px, millions / objects_s,
               pixels / objects_s / 1e9);
  }
}
