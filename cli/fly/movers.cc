#include "cli/fly/movers.h"

#include <algorithm>
#include <cmath>

#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// Ways that vehicles share.
constexpr std::uint64_t kWays = 3;

double length_m(const std::vector<PlanPoint>& way) {
  double sum_m = 0;
  for (std::size_t i = 1; i < way.size(); ++i)
    sum_m += std::hypot(way[i].x_m - way[i - 1].x_m, way[i].y_m - way[i - 1].y_m);
  return sum_m;
}

PlanPoint place_at(const std::vector<PlanPoint>& way, double along_m) {
  for (std::size_t i = 1; i < way.size(); ++i) {
    const double step_m = std::hypot(way[i].x_m - way[i - 1].x_m, way[i].y_m - way[i - 1].y_m);
    if (along_m <= step_m && step_m > 0) {
      const double share = along_m / step_m;
      return {way[i - 1].x_m + share * (way[i].x_m - way[i - 1].x_m),
              way[i - 1].y_m + share * (way[i].y_m - way[i - 1].y_m)};
    }
    along_m -= step_m;
  }
  return way.back();
}

/// A straight way across the scene.
std::vector<PlanPoint> across(const Bounds& bounds, SplitMix64& random) {
  const auto point = [&] {
    return PlanPoint{bounds.low.x_m + random.unit() * (bounds.high.x_m - bounds.low.x_m),
                     bounds.low.y_m + random.unit() * (bounds.high.y_m - bounds.low.y_m)};
  };
  const PlanPoint from = point();
  return {from, point()};
}

}  // namespace

std::vector<Mover> make_movers(const LoadedScene& scene, int count, bool on_streets,
                               std::uint64_t seed) {
  std::vector<std::vector<PlanPoint>> ways;
  for (std::uint64_t i = 0; i < kWays && count > 0; ++i) {
    auto way = on_streets ? street_way(scene.index, seed + i) : valley_way(scene.index, seed + i);
    if (way.size() >= 2) ways.push_back(std::move(way));
  }
  const Bounds bounds = bounds_of(scene.tin.vertices);
  SplitMix64 random(seed);
  std::vector<Mover> movers;
  for (int i = 0; i < count; ++i) {
    Mover mover;
    mover.is_translucent = i % 4 == 3;
    if (i % 3 == 2 || ways.empty()) {
      mover.way = across(bounds, random);
      mover.step_m = 8;
      mover.half_length_m = mover.half_width_m = 15;
      mover.height_m = 6;
      mover.above_ground_m = NAN;
      const double relief_m = bounds.high.z_m - bounds.low.z_m;
      mover.level_m = bounds.low.z_m + relief_m * (0.3 + random.unit());
    } else {
      mover.way = ways[static_cast<std::size_t>(random.unit() * static_cast<double>(ways.size()))];
      mover.step_m = random.unit() < 0.5 ? -1 : 1;
      mover.half_length_m = mover.half_width_m = 2;
      mover.height_m = 2.5;
      mover.above_ground_m = 0.3;
    }
    // Vehicles are met where the flight begins: at most half a kilometre along their way.
    mover.begin_m = random.unit() * std::min(500.0, length_m(mover.way));
    movers.push_back(std::move(mover));
  }
  return movers;
}

Bounds box_at(const Mover& mover, const TinIndex& index, std::size_t frame) {
  const double whole_m = std::max(1.0, length_m(mover.way));
  const double turned =
      std::remainder(mover.begin_m + static_cast<double>(frame) * mover.step_m, 2 * whole_m);
  const PlanPoint at = place_at(mover.way, std::abs(turned));
  double low_m = mover.level_m;
  if (!std::isnan(mover.above_ground_m)) {
    const auto ground_m = index.ground_height_m(round_to_lattice(at.x_m), round_to_lattice(at.y_m));
    low_m = ground_m.value_or(mover.level_m) + mover.above_ground_m;
  }
  return {{at.x_m - mover.half_length_m, at.y_m - mover.half_width_m, low_m},
          {at.x_m + mover.half_length_m, at.y_m + mover.half_width_m, low_m + mover.height_m}};
}

void add_box(const Bounds& box, std::uint32_t object, GroupBatches::Drawing& drawing) {
  constexpr std::array<VertexIndex, 3> kTriangles[] = {{0, 2, 6}, {0, 6, 4}, {1, 3, 7}, {1, 7, 5},
                                                       {0, 1, 5}, {0, 5, 4}, {2, 3, 7}, {2, 7, 6},
                                                       {0, 1, 3}, {0, 3, 2}, {4, 5, 7}, {4, 7, 6}};
  const auto base = static_cast<VertexIndex>(drawing.vertices.size());
  for (unsigned i = 0; i < 8; ++i)
    drawing.vertices.push_back({(i & 1) != 0 ? box.high.x_m : box.low.x_m,
                                (i & 2) != 0 ? box.high.y_m : box.low.y_m,
                                (i & 4) != 0 ? box.high.z_m : box.low.z_m});
  for (const auto& [a, b, c] : kTriangles) {
    drawing.triangles.push_back({base + a, base + b, base + c});
    drawing.objects.push_back(object);
  }
}

}  // namespace scarp
