#include "core/terrain/ground_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/threads/for_each_target.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Rows begin an odd number of cache lines apart, so that a column does not fall into few sets.
std::size_t padded_stride(std::int32_t columns) {
  constexpr std::size_t kSamplesInLine = 64 / sizeof(std::int32_t);
  const std::size_t lines =
      (static_cast<std::size_t>(columns) + kSamplesInLine - 1) / kSamplesInLine;
  return (lines | 1) * kSamplesInLine;
}

ExplicitPlacement explicit_placement(const SampleGrid& grid) {
  ExplicitPlacement placement;
  placement.x_m.reserve(grid.positions.size());
  placement.y_m.reserve(grid.positions.size());
  for (const Position& p : grid.positions) {
    placement.x_m.push_back(p.x_m);
    placement.y_m.push_back(p.y_m);
  }
  return placement;
}

/// Flattened height at h along the normal of a sample.
double flattened_height(const BlockPlacement& blocks, std::int32_t column, std::int32_t row,
                        double h) {
  return blocks.value(BlockPlacement::kHeight, column, row) +
         h * blocks.value(BlockPlacement::kLift, column, row) /
             (1 + h * blocks.value(BlockPlacement::kFall, column, row));
}

/// The inverse of flattened_height.
double height_on_normal(const BlockPlacement& blocks, std::int32_t column, std::int32_t row,
                        double z) {
  const double rise = z - blocks.value(BlockPlacement::kHeight, column, row);
  return rise / (blocks.value(BlockPlacement::kLift, column, row) -
                 rise * blocks.value(BlockPlacement::kFall, column, row));
}

/// Flattened heights of a run of samples in one block.
SCARP_FOR_EACH_TARGET
void place_heights(std::size_t count, const double* __restrict heights_m,
                   const BlockPlacement::Along& height, const BlockPlacement::Along& lift,
                   const BlockPlacement::Along& fall, double u, double du, double* __restrict z_m) {
  const BlockPlacement::Along base = height, rate = lift, bend = fall;
  for (std::size_t i = 0; i < count; ++i) {
    const double at = u + static_cast<double>(static_cast<std::int32_t>(i)) * du;
    const double h = heights_m[i];
    z_m[i] = base.at(at) + h * rate.at(at) / (1 + h * bend.at(at));
  }
}

/// Known heights in lattice steps; others are left. @return false where one is out of reach
SCARP_FOR_EACH_TARGET
bool set_steps(std::size_t count, const double* __restrict z_m,
               const std::uint8_t* __restrict known, std::int32_t* __restrict steps) {
  constexpr double kMost = GroundGrid::kReachZ_m - 1;
  std::int32_t beyond = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t given = known[i] != 0 ? 1 : 0;
    const double above = z_m[i] < -kMost ? -kMost : z_m[i];
    const double z = above > kMost ? kMost : above;
    const auto step = static_cast<std::int32_t>(round_to_lattice(z) * (1 / kLatticeStepM));
    const std::int32_t before = steps[i];
    beyond |= given & (z != z_m[i] ? 1 : 0);
    steps[i] = given != 0 ? step : before;
  }
  return beyond == 0;
}

}  // namespace

GroundGrid::GroundGrid(std::int32_t columns, std::int32_t rows, Placement placement)
    : columns_(columns),
      rows_(rows),
      stride_(padded_stride(columns)),
      steps_(stride_ * static_cast<std::size_t>(rows)),
      placement_(std::move(placement)) {
  // On all threads, because touching memory first is what costs.
  parallel_for(static_cast<std::size_t>(rows), [&](std::size_t row) {
    const std::span<std::int32_t> samples = steps_.span().subspan(row * stride_, stride_);
    std::fill(samples.begin(), samples.end(), kVoid);
  });
}

GroundGrid::GroundGrid(const SampleGrid& grid)
    : GroundGrid(grid.columns, grid.rows, explicit_placement(grid)) {
  for (std::int32_t row = 0; row < rows_; ++row)
    for (std::int32_t column = 0; column < columns_; ++column)
      if (grid.is_known(column, row)) set_z(column, row, grid.at(column, row).z_m);
}

Position GroundGrid::at(std::int32_t column, std::int32_t row) const {
  const std::int32_t steps = steps_[index(column, row)];
  const double z = steps == kVoid ? 0 : steps * kLatticeStepM;
  if (const auto* separable = std::get_if<SeparablePlacement>(&placement_))
    return {separable->x_of_column_m[static_cast<std::size_t>(column)],
            separable->y_of_row_m[static_cast<std::size_t>(row)], z};
  if (const auto* blocks = std::get_if<BlockPlacement>(&placement_))
    return blocks->place(column, row, z);
  const auto& own = std::get<ExplicitPlacement>(placement_);
  const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                        static_cast<std::size_t>(column);
  return {own.x_m[i], own.y_m[i], z};
}

Position GroundGrid::raised(std::int32_t column, std::int32_t row, double height_m) const {
  assert(is_known(column, row));
  Position p = at(column, row);
  if (height_m == 0) return p;
  const auto* blocks = std::get_if<BlockPlacement>(&placement_);
  if (!blocks) {
    p.z_m = round_to_lattice(p.z_m + height_m);
    return p;
  }
  const double z = round_to_lattice(flattened_height(
      *blocks, column, row, height_on_normal(*blocks, column, row, p.z_m) + height_m));
  return blocks->place(column, row, z);
}

Position GroundGrid::place(double column, double row, double height_m) const {
  const auto c = static_cast<std::int32_t>(column), r = static_cast<std::int32_t>(row);
  const double right = column - c, below = row - r;
  if (const auto* blocks = std::get_if<BlockPlacement>(&placement_)) {
    const auto value = [&](BlockPlacement::Quantity quantity) {
      return BlockPlacement::Along(*blocks, quantity, c, r, below)
          .at(blocks->local(c) + right * (2.0 / blocks->side));
    };
    const double z =
        value(BlockPlacement::kHeight) +
        height_m * value(BlockPlacement::kLift) / (1 + height_m * value(BlockPlacement::kFall));
    return round_to_lattice(Position{value(BlockPlacement::kX) + value(BlockPlacement::kTiltX) * z,
                                     value(BlockPlacement::kY) + value(BlockPlacement::kTiltY) * z,
                                     z});
  }
  const std::int32_t next_c = right > 0 ? c + 1 : c, next_r = below > 0 ? r + 1 : r;
  const Position nw = at(c, r), ne = at(next_c, r), sw = at(c, next_r), se = at(next_c, next_r);
  const auto between = [&](double Position::*axis) {
    const double north = nw.*axis + right * (ne.*axis - nw.*axis);
    const double south = sw.*axis + right * (se.*axis - sw.*axis);
    return north + below * (south - north);
  };
  return round_to_lattice(Position{between(&Position::x_m), between(&Position::y_m), height_m});
}

double GroundGrid::height_m(std::int32_t column, std::int32_t row) const {
  assert(is_known(column, row));
  const double z = steps_[index(column, row)] * kLatticeStepM;
  const auto* blocks = std::get_if<BlockPlacement>(&placement_);
  return blocks ? height_on_normal(*blocks, column, row, z) : z;
}

double GroundGrid::height_above_ground_m(std::int32_t column, std::int32_t row, double z_m) const {
  assert(is_known(column, row));
  const double ground_m = steps_[index(column, row)] * kLatticeStepM;
  const auto* blocks = std::get_if<BlockPlacement>(&placement_);
  if (!blocks) return z_m - ground_m;
  return height_on_normal(*blocks, column, row, z_m) -
         height_on_normal(*blocks, column, row, ground_m);
}

void GroundGrid::set_z(std::int32_t column, std::int32_t row, double z_m) {
  assert(std::abs(z_m) < kReachZ_m);
  steps_[index(column, row)] = static_cast<std::int32_t>(std::nearbyint(z_m / kLatticeStepM));
}

bool GroundGrid::set_heights(std::int32_t row, std::int32_t first_column,
                             std::span<const double> heights_m, const std::uint8_t* known) {
  assert(first_column >= 0 &&
         first_column + static_cast<std::int64_t>(heights_m.size()) <= columns_);
  std::int32_t* to = &steps_[index(0, row)] + first_column;
  const auto* blocks = std::get_if<BlockPlacement>(&placement_);
  if (!blocks) return set_steps(heights_m.size(), heights_m.data(), known, to);
  bool within = true;
  std::vector<double> z_m(static_cast<std::size_t>(blocks->side));
  for (std::size_t i = 0; i < heights_m.size();) {
    const std::int32_t column = first_column + static_cast<std::int32_t>(i);
    const BlockPlacement::Along height(*blocks, BlockPlacement::kHeight, column, row),
        lift(*blocks, BlockPlacement::kLift, column, row),
        fall(*blocks, BlockPlacement::kFall, column, row);
    const std::size_t end = std::min(
        heights_m.size(), i + static_cast<std::size_t>(blocks->side - column % blocks->side));
    place_heights(end - i, heights_m.data() + i, height, lift, fall, blocks->local(column),
                  2.0 / blocks->side, z_m.data());
    within = set_steps(end - i, z_m.data(), known + i, to + i) && within;
    i = end;
  }
  return within;
}

namespace {

/// A rectangle of an array of rows.
template <class T>
std::vector<T> cut(const std::vector<T>& from, std::int32_t stride, std::int32_t first_column,
                   std::int32_t first_row, std::int32_t columns, std::int32_t rows) {
  std::vector<T> part;
  part.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (std::int32_t row = first_row; row < first_row + rows; ++row) {
    const auto begin = from.begin() + std::ptrdiff_t{row} * stride + first_column;
    part.insert(part.end(), begin, begin + columns);
  }
  return part;
}

}  // namespace

PartPlacement part_of(const GroundGrid::Placement& whole, std::int32_t raster_columns,
                      std::int32_t first_column, std::int32_t first_row, std::int32_t columns,
                      std::int32_t rows) {
  PartPlacement part{{}, first_column, first_row, columns, rows};
  if (const auto* separable = std::get_if<SeparablePlacement>(&whole)) {
    part.placement =
        SeparablePlacement{cut(separable->x_of_column_m, 0, first_column, 0, columns, 1),
                           cut(separable->y_of_row_m, 0, first_row, 0, rows, 1)};
  } else if (const auto* places = std::get_if<ExplicitPlacement>(&whole)) {
    part.placement =
        ExplicitPlacement{cut(places->x_m, raster_columns, first_column, first_row, columns, rows),
                          cut(places->y_m, raster_columns, first_column, first_row, columns, rows)};
  } else {
    const auto& blocks = std::get<BlockPlacement>(whole);
    const std::int32_t left = first_column / blocks.side, above = first_row / blocks.side;
    const std::int32_t across = (first_column + columns - 1) / blocks.side - left + 1;
    const std::int32_t down = (first_row + rows - 1) / blocks.side - above + 1;
    part.first_column = left * blocks.side;
    part.first_row = above * blocks.side;
    part.columns += first_column - part.first_column;
    part.rows += first_row - part.first_row;
    part.placement = BlockPlacement{
        blocks.side, across, cut(blocks.blocks, blocks.blocks_across, left, above, across, down)};
  }
  return part;
}

}  // namespace scarp
