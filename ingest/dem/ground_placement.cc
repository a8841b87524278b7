#include "ingest/dem/ground_placement.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error/error.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

/// Heights at which interpolated places are compared with exact ones.
constexpr double kLowestM = -500, kHighestM = 9000;

/// Heights above the ellipsoid through which the course of a normal is fitted.
constexpr double kLowerFitM = 10'000, kUpperFitM = 20'000;

/// Sides that are tried: from where quadratics are good enough at 30 m, down to where every sample
/// is a node, and what lies beyond the raster does not matter.
constexpr std::int32_t kLargestSide = 128, kNodesOnly = 2;

using Node = std::array<double, BlockPlacement::kQuantities>;

Position place_above_ellipsoid(const GeoFrame::Placer& placer, double x, double y, double h) {
  return placer.place_unrounded({x, y, h - placer.undulation_m(x, y)});
}

/// The quantities of BlockPlacement at a point of the map, from three exact places on its normal.
Node exact_node(const GeoFrame::Placer& placer, double x, double y) {
  const Position ground = place_above_ellipsoid(placer, x, y, 0);
  const Position lower = place_above_ellipsoid(placer, x, y, kLowerFitM);
  const Position upper = place_above_ellipsoid(placer, x, y, kUpperFitM);
  // rise = h lift / (1 + h fall), so rise / h = lift - fall rise.
  const double low_rise = lower.z_m - ground.z_m, high_rise = upper.z_m - ground.z_m;
  const double fall = (low_rise / kLowerFitM - high_rise / kUpperFitM) / (high_rise - low_rise);
  const double tilt_x = (lower.x_m - ground.x_m) / low_rise;
  const double tilt_y = (lower.y_m - ground.y_m) / low_rise;
  Node node;
  node[BlockPlacement::kX] = ground.x_m - tilt_x * ground.z_m;
  node[BlockPlacement::kTiltX] = tilt_x;
  node[BlockPlacement::kY] = ground.y_m - tilt_y * ground.z_m;
  node[BlockPlacement::kTiltY] = tilt_y;
  node[BlockPlacement::kHeight] = ground.z_m;
  node[BlockPlacement::kLift] = low_rise / kLowerFitM + fall * low_rise;
  node[BlockPlacement::kFall] = fall;
  return node;
}

/// Coefficients of 1, w, w^2 from the values at w = -1, 0, 1.
std::array<double, 3> quadratic(double before, double middle, double after) {
  return {middle, (after - before) / 2, (after + before) / 2 - middle};
}

BlockPlacement::Biquadratic biquadratic(const std::array<std::array<double, 3>, 3>& value) {
  // value[row][column]; first along the rows, then across.
  std::array<std::array<double, 3>, 3> rows;
  for (std::size_t r = 0; r < 3; ++r) rows[r] = quadratic(value[r][0], value[r][1], value[r][2]);
  BlockPlacement::Biquadratic k;
  for (std::size_t u = 0; u < 3; ++u) {
    const auto down = quadratic(rows[0][u], rows[1][u], rows[2][u]);
    std::copy(down.begin(), down.end(), k.begin() + static_cast<std::ptrdiff_t>(3 * u));
  }
  return k;
}

/// A rectangle of blocks of a raster.
struct BlockRange {
  std::int32_t left = 0, above = 0, across = 0, down = 0;
};

BlockRange blocks_over(const Dem& dem, std::int32_t side) {
  return {0, 0, (dem.columns + side - 1) / side, (dem.rows + side - 1) / side};
}

/// Where node number `node` of a row or column of `count` samples lies. The last ones lie beyond
/// the raster by less than a block.
std::int32_t sample_of_node(std::int32_t node, std::int32_t side, std::int32_t count) {
  const std::int32_t index = node * (side / 2);
  return side == kNodesOnly ? std::min(index, count - 1) : index;
}

Node node_of(const Dem& dem, std::int32_t side, const GeoFrame::Placer& placer, std::int32_t column,
             std::int32_t row) {
  return exact_node(placer, dem.x_of(sample_of_node(column, side, dem.columns)),
                    dem.y_of(sample_of_node(row, side, dem.rows)));
}

/// @param first         of its 3 x 3 nodes
/// @param nodes_across  from a row of nodes to the next
BlockPlacement::Block block_of(const Node* first, std::size_t nodes_across) {
  BlockPlacement::Block block;
  for (std::size_t q = 0; q < BlockPlacement::kQuantities; ++q) {
    std::array<std::array<double, 3>, 3> value;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) value[r][c] = first[r * nodes_across + c][q];
    block[q] = biquadratic(value);
  }
  return block;
}

/// Blocks of a raster, each a function of its own nodes alone. Throws where one cannot be placed.
BlockPlacement interpolated_blocks(const Dem& dem, std::int32_t side, const BlockRange& range) {
  const auto across = static_cast<std::size_t>(range.across);
  // Nodes at the corners and middles of blocks, shared between neighbours.
  const std::size_t nodes_across = 2 * across + 1;
  const auto nodes_down = 2 * static_cast<std::size_t>(range.down) + 1;
  std::vector<Node> nodes(nodes_across * nodes_down);
  constexpr std::size_t kRowsPerTask = 8;
  parallel_for((nodes_down + kRowsPerTask - 1) / kRowsPerTask, [&](std::size_t task) {
    const GeoFrame::Placer placer(*dem.frame);
    const std::size_t end = std::min(nodes_down, (task + 1) * kRowsPerTask);
    for (std::size_t r = task * kRowsPerTask; r < end; ++r)
      for (std::size_t c = 0; c < nodes_across; ++c)
        nodes[r * nodes_across + c] =
            node_of(dem, side, placer, 2 * range.left + static_cast<std::int32_t>(c),
                    2 * range.above + static_cast<std::int32_t>(r));
  });
  BlockPlacement blocks{side, range.across, {}};
  blocks.blocks.resize(across * static_cast<std::size_t>(range.down));
  for (std::size_t b = 0; b < blocks.blocks.size(); ++b)
    blocks.blocks[b] =
        block_of(&nodes[(b / across) * 2 * nodes_across + (b % across) * 2], nodes_across);
  return blocks;
}

/// One block alone.
BlockPlacement interpolated_block(const Dem& dem, std::int32_t side, const GeoFrame::Placer& placer,
                                  std::int32_t column, std::int32_t row) {
  std::array<Node, 9> nodes;
  for (std::int32_t r = 0; r < 3; ++r)
    for (std::int32_t c = 0; c < 3; ++c)
      nodes[static_cast<std::size_t>(3 * r + c)] =
          node_of(dem, side, placer, 2 * column + c, 2 * row + r);
  return {side, 1, {block_of(nodes.data(), 3)}};
}

/// Greatest distance of an interpolated place from the exact one, over spots of a block where the
/// error of quadratics through -1, 0, 1 is greatest: at +-1/sqrt(3), and at 0 in the other axis.
/// @param block  alone
double error_of_block_m(const Dem& dem, const BlockPlacement& block, const GeoFrame::Placer& placer,
                        std::int32_t first_column, std::int32_t first_row) {
  double most_m = 0;
  const std::int32_t quarter = std::max(1, block.side / 4 - block.side / 32);
  for (const std::int32_t dr : {quarter, block.side / 2, block.side - quarter}) {
    for (const std::int32_t dc : {quarter, block.side / 2, block.side - quarter}) {
      const std::int32_t column = first_column + dc, row = first_row + dr;
      if (column >= dem.columns || row >= dem.rows) continue;
      for (const double h : {kLowestM, kHighestM}) {
        const Position exact = place_above_ellipsoid(placer, dem.x_of(column), dem.y_of(row), h);
        const auto value = [&](BlockPlacement::Quantity q) { return block.value(q, dc, dr); };
        const double z = value(BlockPlacement::kHeight) +
                         h * value(BlockPlacement::kLift) / (1 + h * value(BlockPlacement::kFall));
        const double x = value(BlockPlacement::kX) + value(BlockPlacement::kTiltX) * z;
        const double y = value(BlockPlacement::kY) + value(BlockPlacement::kTiltY) * z;
        most_m = std::max(most_m, std::hypot(x - exact.x_m, y - exact.y_m, z - exact.z_m));
      }
    }
  }
  return most_m;
}

/// Whether blocks of a side keep the allowance, by 9 x 9 of them. Throws where a node beyond the
/// raster cannot be placed.
bool is_near_enough(const Dem& dem, std::int32_t side) {
  constexpr std::int32_t kStations = 9;
  const GeoFrame::Placer placer(*dem.frame);
  const BlockRange all = blocks_over(dem, side);
  for (std::int32_t i = 0; i < kStations; ++i) {
    for (std::int32_t j = 0; j < kStations; ++j) {
      const std::int32_t column = (all.across - 1) * j / (kStations - 1);
      const std::int32_t row = (all.down - 1) * i / (kStations - 1);
      if (!(error_of_block_m(dem, interpolated_block(dem, side, placer, column, row), placer,
                             column * side, row * side) < kInterpolationErrorM / 2))
        return false;
    }
  }
  for (std::int32_t c = 0; c <= 2 * all.across; ++c)
    static_cast<void>(node_of(dem, side, placer, c, 2 * all.down));
  for (std::int32_t r = 0; r <= 2 * all.down; ++r)
    static_cast<void>(node_of(dem, side, placer, 2 * all.across, r));
  return true;
}

/// The largest side of blocks that are near enough.
std::int32_t side_of_blocks(const Dem& dem) {
  std::int32_t side = kLargestSide;
  for (; side > kNodesOnly; side /= 2) {
    try {
      if (is_near_enough(dem, side)) return side;
    } catch (const Error&) {
      // A node beyond the raster cannot be placed; smaller blocks reach less far.
    }
  }
  return side;
}

SeparablePlacement flat_placement(const Dem& dem) {
  const GeoFrame::Placer placer(*dem.frame);
  SeparablePlacement flat;
  for (std::int32_t c = 0; c < dem.columns; ++c)
    flat.x_of_column_m.push_back(placer.place({dem.x_of(c), dem.y_of(0), 0}).x_m);
  for (std::int32_t r = 0; r < dem.rows; ++r)
    flat.y_of_row_m.push_back(placer.place({dem.x_of(0), dem.y_of(r), 0}).y_m);
  return flat;
}

}  // namespace

GroundGrid::Placement ground_placement(const Dem& dem) {
  if (dem.frame->description().earth == Earth::kFlat) return flat_placement(dem);
  const std::int32_t side = side_of_blocks(dem);
  return interpolated_blocks(dem, side, blocks_over(dem, side));
}

PartPlacement ground_placement_of_part(const Dem& dem, std::int32_t first_column,
                                       std::int32_t first_row, std::int32_t columns,
                                       std::int32_t rows) {
  if (dem.frame->description().earth == Earth::kFlat)
    return part_of(flat_placement(dem), dem.columns, first_column, first_row, columns, rows);
  const std::int32_t side = side_of_blocks(dem);
  const std::int32_t left = first_column / side, above = first_row / side;
  const BlockRange range{left, above, (first_column + columns - 1) / side - left + 1,
                         (first_row + rows - 1) / side - above + 1};
  return {interpolated_blocks(dem, side, range), left * side, above * side,
          columns + first_column - left * side, rows + first_row - above * side};
}

}  // namespace scarp
