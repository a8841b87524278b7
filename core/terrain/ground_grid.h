#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <variant>
#include <vector>

#include "core/geodesy/position.h"
#include "core/memory/large_array.h"
#include "core/terrain/sample_grid.h"

namespace scarp {

/// Every column has one x and every row one y: an affine map plane (flat earth).
struct SeparablePlacement {
  std::vector<double> x_of_column_m;
  std::vector<double> y_of_row_m;
};

/// Each sample has a place of its own.
struct ExplicitPlacement {
  std::vector<double> x_m;  ///< [rows * columns]
  std::vector<double> y_m;
};

/// Places that are interpolated: in each block of samples the plan position, its tilt along the
/// normal and the flattened height are biquadratic in column and row. What this gives, rounded to
/// the lattice, *is* the position, for the judge too; whoever makes the blocks proves how near it
/// comes to the exact place (ingest/dem/ground.h).
///
/// On the normal through a sample, with h the height above the ellipsoid in metres:
///   z = kHeight + h kLift / (1 + h kFall),  x = kX + kTiltX z,  y = kY + kTiltY z.
/// Without refraction these are exact, because flattening is projective.
struct BlockPlacement {
  enum Quantity { kX, kTiltX, kY, kTiltY, kHeight, kLift, kFall, kQuantities };
  /// Coefficients of 1, v, v^2 for 1, then for u, then for u^2.
  using Biquadratic = std::array<double, 9>;
  using Block = std::array<Biquadratic, kQuantities>;

  std::int32_t side = 0;  ///< samples along a block's side, a power of two
  std::int32_t blocks_across = 0;
  std::vector<Block> blocks;  ///< row by row

  const Block& block_of(std::int32_t column, std::int32_t row) const {
    const int bits = std::countr_zero(static_cast<std::uint32_t>(side));
    return blocks[static_cast<std::size_t>(row >> bits) * static_cast<std::size_t>(blocks_across) +
                  static_cast<std::size_t>(column >> bits)];
  }
  /// Place within a block, in [-1, 1), and up to 1 beyond its last sample.
  double local(std::int32_t index) const { return (index & (side - 1)) * (2.0 / side) - 1; }

  /// One quantity along the part of a row that a block holds.
  struct Along {
    double constant, linear, square;

    Along(const BlockPlacement& blocks, Quantity quantity, std::int32_t column, std::int32_t row,
          double below_row = 0) {
      const double v = blocks.local(row) + below_row * (2.0 / blocks.side);
      const Biquadratic& k = blocks.block_of(column, row)[quantity];
      constant = k[0] + v * (k[1] + v * k[2]);
      linear = k[3] + v * (k[4] + v * k[5]);
      square = k[6] + v * (k[7] + v * k[8]);
    }
    double at(double u) const { return constant + u * (linear + u * square); }
  };

  double value(Quantity quantity, std::int32_t column, std::int32_t row) const {
    return Along(*this, quantity, column, row).at(local(column));
  }

  /// The plan position, rounded to the lattice, of a flattened height on the normal of a sample.
  Position place(std::int32_t column, std::int32_t row, double z_m) const {
    const Block& block = block_of(column, row);
    const double step = 2.0 / side;
    const double u = (column & (side - 1)) * step - 1, v = (row & (side - 1)) * step - 1;
    const auto at = [&](Quantity quantity) {
      const Biquadratic& k = block[quantity];
      const double constant = k[0] + v * (k[1] + v * k[2]);
      const double linear = k[3] + v * (k[4] + v * k[5]);
      const double square = k[6] + v * (k[7] + v * k[8]);
      return constant + u * (linear + u * square);
    };
    return {round_to_lattice(at(kX) + at(kTiltX) * z_m),
            round_to_lattice(at(kY) + at(kTiltY) * z_m), z_m};
  }
};

/// The surface `grid` in four bytes a sample: flattened heights in lattice steps, and a placement
/// that gives the plan position. Rows and columns as in SampleGrid.
///
/// Heights reach 524 km above and below the scene's centre, which holds scenes of 5000 km.
class GroundGrid {
 public:
  using Placement = std::variant<SeparablePlacement, ExplicitPlacement, BlockPlacement>;
  static constexpr std::int32_t kVoid = std::numeric_limits<std::int32_t>::min();
  static constexpr double kReachZ_m = 0x1p31 * kLatticeStepM;

  GroundGrid() = default;
  /// All samples void until set.
  GroundGrid(std::int32_t columns, std::int32_t rows, Placement placement);
  /// The same samples at the same positions. Requires |z| < kReachZ_m.
  explicit GroundGrid(const SampleGrid& grid);

  std::int32_t columns() const { return columns_; }
  std::int32_t rows() const { return rows_; }
  const Placement& placement() const { return placement_; }

  bool is_known(std::int32_t column, std::int32_t row) const {
    return steps_[index(column, row)] != kVoid;
  }
  /// Where a sample lies; of a void one the plan position, and z 0.
  Position at(std::int32_t column, std::int32_t row) const;
  /// A target above a sample, along the normal, rounded to the lattice. Requires a known sample.
  Position raised(std::int32_t column, std::int32_t row, double height_m) const;
  /// A point between the samples, on a normal of its own. On a sample and at its height it is the
  /// sample, but for the lattice. Requires 0 <= column <= columns - 1, and so for the row.
  /// @param height_m  above the ellipsoid, above the plane where the earth is flat
  Position place(double column, double row, double height_m) const;
  /// Height above the ellipsoid (the plane) of a known sample, metres.
  double height_m(std::int32_t column, std::int32_t row) const;
  /// The inverse: how far along the normal a flattened height lies above a known sample, metres.
  double height_above_ground_m(std::int32_t column, std::int32_t row, double z_m) const;

  /// Heights of a part of one row, lattice steps or kVoid, in order of columns.
  const std::int32_t* row_steps(std::int32_t row) const { return &steps_[index(0, row)]; }
  /// Samples from one row to the next in row_steps.
  std::size_t stride() const { return stride_; }

  void set_void(std::int32_t column, std::int32_t row) { steps_[index(column, row)] = kVoid; }
  /// Requires |z| < kReachZ_m.
  void set_z(std::int32_t column, std::int32_t row, double z_m);
  /// Sets a part of a row, from a column on, from heights above the ellipsoid (above the plane
  /// where the earth is flat), metres. Samples whose known is 0 are left as they are.
  /// @return false where a height is out of reach
  [[nodiscard]] bool set_heights(std::int32_t row, std::int32_t first_column,
                                 std::span<const double> heights_m, const std::uint8_t* known);

 private:
  std::size_t index(std::int32_t column, std::int32_t row) const {
    assert(column >= 0 && column < columns_ && row >= 0 && row < rows_);
    return static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column);
  }

  std::int32_t columns_ = 0;
  std::int32_t rows_ = 0;
  std::size_t stride_ = 0;
  LargeArray<std::int32_t> steps_;
  Placement placement_;
};

/// The placement of a rectangle of a raster, or of a little more to the left and above: to whole
/// blocks. Its samples have the positions that they have in the raster, bit for bit.
struct PartPlacement {
  GroundGrid::Placement placement;
  std::int32_t first_column = 0, first_row = 0;  ///< in the raster
  std::int32_t columns = 0, rows = 0;
};

/// @param raster_columns  of the raster that `whole` places
/// Cost: O(blocks, or samples, of the part).
PartPlacement part_of(const GroundGrid::Placement& whole, std::int32_t raster_columns,
                      std::int32_t first_column, std::int32_t first_row, std::int32_t columns,
                      std::int32_t rows);

}  // namespace scarp
