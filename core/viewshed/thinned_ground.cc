#include "core/viewshed/thinned_ground.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include "core/threads/parallel_for.h"
#include "core/viewshed/plan_frame.h"

namespace scarp {
namespace {

constexpr std::int32_t kStep = ThinnedGround::kStep;

std::int32_t kept(std::int32_t count) {
  return (count + kStep - 1) / kStep;
}

std::vector<double> every_second(const std::vector<double>& values) {
  std::vector<double> result;
  result.reserve(values.size() / kStep + 1);
  for (std::size_t i = 0; i < values.size(); i += kStep) result.push_back(values[i]);
  return result;
}

struct ThinPlacement {
  std::int32_t columns, rows;

  GroundGrid::Placement operator()(const SeparablePlacement& placement) const {
    return SeparablePlacement{every_second(placement.x_of_column_m),
                              every_second(placement.y_of_row_m)};
  }
  GroundGrid::Placement operator()(const ExplicitPlacement& placement) const {
    ExplicitPlacement result;
    for (std::int32_t row = 0; row < rows; row += kStep)
      for (std::int32_t column = 0; column < columns; column += kStep) {
        const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                              static_cast<std::size_t>(column);
        result.x_m.push_back(placement.x_m[i]);
        result.y_m.push_back(placement.y_m[i]);
      }
    return result;
  }
  /// A block of half as many samples a side has each of them at the same local place.
  GroundGrid::Placement operator()(const BlockPlacement& placement) const {
    BlockPlacement result = placement;
    result.side /= kStep;
    return result;
  }
};

}  // namespace

GroundGrid thinned(const GroundGrid& grid) {
  assert(grid.columns() > kStep && grid.rows() > kStep);
  GroundGrid result(kept(grid.columns()), kept(grid.rows()),
                    std::visit(ThinPlacement{grid.columns(), grid.rows()}, grid.placement()));
  parallel_for(static_cast<std::size_t>(result.rows()), [&](std::size_t r) {
    const auto row = static_cast<std::int32_t>(r);
    const std::int32_t* steps = grid.row_steps(kStep * row);
    for (std::int32_t column = 0; column < result.columns(); ++column)
      if (const std::int32_t step = steps[kStep * column]; step != GroundGrid::kVoid)
        result.set_z(column, row, step * kLatticeStepM);
  });
  return result;
}

ThinnedGround::ThinnedGround(const GroundGrid& stands, const GroundGrid& blocks)
    : stands_(thinned(stands)),
      blocks_(&blocks == &stands ? std::nullopt : std::optional(thinned(blocks))),
      tops_(this->blocks(), stands_) {}

std::optional<double> ground_under_m(const GroundGrid& grid, const Position& place) {
  const PlanFrame frame = plan_frame(grid, place);
  const double column = std::floor(frame.eye_column), row = std::floor(frame.eye_row);
  if (!(column >= 0 && row >= 0 && column + 1 < grid.columns() && row + 1 < grid.rows())) return {};
  const auto c = static_cast<std::int32_t>(column), r = static_cast<std::int32_t>(row);
  const double right = frame.eye_column - column, down = frame.eye_row - row;
  double sum_m = 0;
  for (const std::int32_t dr : {0, 1})
    for (const std::int32_t dc : {0, 1}) {
      if (!grid.is_known(c + dc, r + dr)) return {};
      sum_m += (dc ? right : 1 - right) * (dr ? down : 1 - down) * grid.at(c + dc, r + dr).z_m;
    }
  return sum_m;
}

Position raised_over(const Position& eye, std::optional<double> own_m,
                     std::optional<double> other_m) {
  Position raised = eye;
  if (own_m && other_m) raised.z_m += round_to_lattice(std::max(0.0, *other_m - *own_m));
  return raised;
}

}  // namespace scarp
