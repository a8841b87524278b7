#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "core/terrain/tin.h"

namespace scarp::test {

/// Terrains for tests, in flattened metres on the lattice: x = column * cell_m, and row 0 is the
/// northern one, y = (rows - 1 - row) * cell_m. All are affine grids with square cells.

/// Heights from a function of (column, row), rounded to the lattice; NaN makes a void sample.
SampleGrid grid_of(std::int32_t columns, std::int32_t rows, double cell_m,
                   const std::function<double(std::int32_t column, std::int32_t row)>& height_m);

/// A grid drawn as text: one line per row, heights in metres, '?' for void.
SampleGrid drawn_grid(const std::string& text, double cell_m);

/// A profile along x, the same in every one of `rows` rows.
SampleGrid extruded_profile(const std::vector<double>& heights_m, double cell_m, std::int32_t rows);

/// Hills of several sizes, `relief_m` high in all, in whole steps of `step_m` (which makes
/// equal heights and terraces); `void_share` of the samples are void, in patches.
SampleGrid random_hills(std::int32_t columns, std::int32_t rows, double cell_m, std::uint64_t seed,
                        double relief_m, double step_m, double void_share = 0);

/// A cone with its top in the middle sample, falling by `slope` to zero and flat beyond.
SampleGrid cone(std::int32_t columns, std::int32_t rows, double cell_m, double top_m, double slope);

/// The triangles of all cells with four known samples; the diagonal is drawn from the seed, 0 for
/// the one from upper left to lower right everywhere. Samples without a triangle are left out.
Tin triangulated(const SampleGrid& grid, std::uint64_t diagonal_seed = 0);

}  // namespace scarp::test
