#include "cli/fly/valley_way.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "core/occlusion/splitmix64.h"

namespace scarp {
namespace {

/// Heights on a coarse grid over the plan, and how they compare with what is around.
struct CoarseGround {
  int columns = 0, rows = 0;
  double low_x_m = 0, low_y_m = 0, cell_m = 1;
  std::vector<double> height_m;      // NaN over void
  std::vector<double> above_mean_m;  // of the ground within kAroundCells

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(column);
  }
  PlanPoint place(std::size_t cell) const {
    const auto width = static_cast<std::size_t>(columns);
    return {low_x_m + (static_cast<double>(cell % width) + 0.5) * cell_m,
            low_y_m + (static_cast<double>(cell / width) + 0.5) * cell_m};
  }
};

/// A valley is looked for within so many cells around.
constexpr int kAroundCells = 8;

/// Heights alone.
CoarseGround heights_over(const TinIndex& index, const Bounds& bounds, int most_cells) {
  CoarseGround ground;
  ground.low_x_m = bounds.low.x_m, ground.low_y_m = bounds.low.y_m;
  const double width_m = bounds.high.x_m - bounds.low.x_m;
  const double depth_m = bounds.high.y_m - bounds.low.y_m;
  ground.cell_m = std::max(width_m, depth_m) / most_cells;
  ground.columns = std::max(1, static_cast<int>(width_m / ground.cell_m));
  ground.rows = std::max(1, static_cast<int>(depth_m / ground.cell_m));
  const auto cells =
      static_cast<std::size_t>(ground.columns) * static_cast<std::size_t>(ground.rows);
  for (std::size_t i = 0; i < cells; ++i) {
    const PlanPoint at = ground.place(i);
    const double x_m = round_to_lattice(at.x_m), y_m = round_to_lattice(at.y_m);
    ground.height_m.push_back(index.ground_height_m(x_m, y_m).value_or(NAN));
  }
  ground.above_mean_m.assign(cells, NAN);
  return ground;
}

CoarseGround coarse_ground(const TinIndex& index) {
  CoarseGround ground = heights_over(index, bounds_of(index.tin().vertices), kWayCells);
  for (int row = 0; row < ground.rows; ++row)
    for (int column = 0; column < ground.columns; ++column) {
      double sum_m = 0;
      int known = 0;
      for (int y = std::max(0, row - kAroundCells);
           y <= std::min(ground.rows - 1, row + kAroundCells); ++y)
        for (int x = std::max(0, column - kAroundCells);
             x <= std::min(ground.columns - 1, column + kAroundCells); ++x) {
          const double height_m = ground.height_m[ground.index(x, y)];
          if (std::isnan(height_m)) continue;
          sum_m += height_m;
          ++known;
        }
      const std::size_t i = ground.index(column, row);
      if (known > 0) ground.above_mean_m[i] = ground.height_m[i] - sum_m / known;
    }
  return ground;
}

/// The cheapest ways from one cell to all others.
struct Ways {
  std::vector<double> cost;  // infinite where there is no way
  std::vector<std::size_t> from;
};

Ways ways_from(const CoarseGround& ground, std::size_t start, double relief_m) {
  constexpr double kSteepness = 6;  // how much dearer the top of the relief is than its middle
  Ways ways{std::vector<double>(ground.height_m.size(), HUGE_VAL),
            std::vector<std::size_t>(ground.height_m.size(), start)};
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  ways.cost[start] = 0;
  open.push({0, start});
  while (!open.empty()) {
    const auto [cost, cell] = open.top();
    open.pop();
    if (cost > ways.cost[cell]) continue;
    const auto column = static_cast<int>(cell % static_cast<std::size_t>(ground.columns));
    const auto row = static_cast<int>(cell / static_cast<std::size_t>(ground.columns));
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        if (column + dx < 0 || column + dx >= ground.columns || row + dy < 0 ||
            row + dy >= ground.rows)
          continue;
        const std::size_t next = ground.index(column + dx, row + dy);
        if (std::isnan(ground.height_m[next])) continue;
        const double step = std::sqrt(dx * dx + dy * dy) *
                            std::exp(kSteepness * ground.above_mean_m[next] / relief_m);
        if (cost + step >= ways.cost[next]) continue;
        ways.cost[next] = cost + step;
        ways.from[next] = cell;
        open.push({cost + step, next});
      }
  }
  return ways;
}

/// Cuts every corner twice (Chaikin), so that a camera does not turn at once.
std::vector<PlanPoint> rounded(std::vector<PlanPoint> way) {
  for (int pass = 0; pass < 3; ++pass) {
    std::vector<PlanPoint> cut{way.front()};
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const auto between = [&](double share) {
        return PlanPoint{way[i].x_m + share * (way[i + 1].x_m - way[i].x_m),
                         way[i].y_m + share * (way[i + 1].y_m - way[i].y_m)};
      };
      cut.push_back(between(0.25));
      cut.push_back(between(0.75));
    }
    cut.push_back(way.back());
    way = std::move(cut);
  }
  return way;
}

/// A way from one of the floors, drawn by the seed, to that which is farthest of those it can
/// reach.
std::vector<PlanPoint> way_between(const CoarseGround& ground,
                                   const std::vector<std::size_t>& floors, double relief_m,
                                   SplitMix64& random) {
  const std::size_t start =
      floors[static_cast<std::size_t>(random.unit() * static_cast<double>(floors.size()))];
  const Ways ways = ways_from(ground, start, relief_m);
  std::size_t end = start;
  double farthest_m = 0;
  for (const std::size_t floor : floors) {
    const PlanPoint a = ground.place(start), b = ground.place(floor);
    const double distance_m = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
    if (ways.cost[floor] < HUGE_VAL && distance_m > farthest_m) {
      farthest_m = distance_m;
      end = floor;
    }
  }
  if (end == start) return {};
  std::vector<PlanPoint> way;
  for (std::size_t cell = end; cell != start; cell = ways.from[cell])
    way.push_back(ground.place(cell));
  way.push_back(ground.place(start));
  std::reverse(way.begin(), way.end());
  return rounded(std::move(way));
}

/// Where some vertices that the seed draws have most others around.
Position densest_place(const Tin& tin, SplitMix64& random) {
  constexpr int kCandidates = 32;
  constexpr double kAroundM = 150;
  Position densest = tin.vertices.front();
  std::size_t most = 0;
  for (int i = 0; i < kCandidates; ++i) {
    const Position& at = tin.vertices[static_cast<std::size_t>(
        random.unit() * static_cast<double>(tin.vertices.size()))];
    const auto around = static_cast<std::size_t>(
        std::count_if(tin.vertices.begin(), tin.vertices.end(), [&](const Position& p) {
          return std::abs(p.x_m - at.x_m) < kAroundM && std::abs(p.y_m - at.y_m) < kAroundM;
        }));
    if (around > most) most = around, densest = at;
  }
  return densest;
}

/// Makes void of all cells that rise like walls, and of those beside them.
void forbid_walls(CoarseGround& ground) {
  constexpr double kWallM = 2.5;
  std::vector<std::uint8_t> is_free(ground.height_m.size(), 0);
  const auto any_near = [&](int column, int row, int reach, const auto& visit) {
    for (int y = std::max(0, row - reach); y <= std::min(ground.rows - 1, row + reach); ++y)
      for (int x = std::max(0, column - reach); x <= std::min(ground.columns - 1, column + reach);
           ++x)
        if (visit(ground.index(x, y))) return true;
    return false;
  };
  for (int row = 0; row < ground.rows; ++row)
    for (int column = 0; column < ground.columns; ++column) {
      const double height_m = ground.height_m[ground.index(column, row)];
      is_free[ground.index(column, row)] =
          !std::isnan(height_m) && !any_near(column, row, kAroundCells, [&](std::size_t i) {
            return ground.height_m[i] < height_m - kWallM;
          });
    }
  for (int row = 0; row < ground.rows; ++row)
    for (int column = 0; column < ground.columns; ++column) {
      const std::size_t i = ground.index(column, row);
      ground.above_mean_m[i] = 0;
      if (any_near(column, row, 1, [&](std::size_t near) { return !is_free[near]; }))
        ground.above_mean_m[i] = NAN;
    }
  for (std::size_t i = 0; i < ground.height_m.size(); ++i)
    if (std::isnan(ground.above_mean_m[i])) ground.height_m[i] = NAN;
}

}  // namespace

std::vector<PlanPoint> valley_way(const TinIndex& index, std::uint64_t seed) {
  const CoarseGround ground = coarse_ground(index);
  std::vector<std::size_t> floors;
  for (std::size_t i = 0; i < ground.height_m.size(); ++i)
    if (!std::isnan(ground.height_m[i])) floors.push_back(i);
  if (floors.empty()) return {};
  std::sort(floors.begin(), floors.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(ground.above_mean_m[a], a) < std::pair(ground.above_mean_m[b], b);
  });
  const double relief_m =
      std::max(1.0, ground.above_mean_m[floors.back()] - ground.above_mean_m[floors.front()]);
  // The lowest twentieth are floors of valleys.
  floors.resize(floors.size() / 20 + 1);
  SplitMix64 random(seed);
  return way_between(ground, floors, relief_m, random);
}

std::vector<PlanPoint> street_way(const TinIndex& index, std::uint64_t seed) {
  constexpr double kCellM = 4;
  SplitMix64 random(seed);
  const Position middle = densest_place(index.tin(), random);
  const Bounds window{{middle.x_m - kStreetReachM, middle.y_m - kStreetReachM, 0},
                      {middle.x_m + kStreetReachM, middle.y_m + kStreetReachM, 0}};
  CoarseGround ground = heights_over(index, window, static_cast<int>(2 * kStreetReachM / kCellM));
  forbid_walls(ground);
  std::vector<std::size_t> streets;
  for (std::size_t i = 0; i < ground.height_m.size(); ++i)
    if (!std::isnan(ground.height_m[i])) streets.push_back(i);
  if (streets.empty()) return {};
  return way_between(ground, streets, 1, random);
}

}  // namespace scarp
