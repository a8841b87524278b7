#pragma once

#include <string>

#include "core/terrain/sample_grid.h"

namespace scarp::test {

/// A window of a DEM as a flat grid with square cells of cell_m, read with GDAL; columns or rows
/// beyond the raster are cut off. Samples without data are void. Empty where it cannot be read.
SampleGrid dem_window(const std::string& path, std::int32_t column, std::int32_t row,
                      std::int32_t columns, std::int32_t rows, double cell_m);

}  // namespace scarp::test
