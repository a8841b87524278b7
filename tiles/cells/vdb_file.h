#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tiles/store/part_file.h"

/// Grids of numbers over space as OpenVDB files, which its own tools open.
namespace scarp {

/// A grid of columns * rows * layers cells. Cell (i, j, k) has its middle at
/// low + ((i, j, k) + 1/2) * cell.
struct VdbShape {
  std::int32_t columns = 0, rows = 0, layers = 1;
  double low[3] = {0, 0, 0};
  double cell[3] = {1, 1, 1};
};

/// One named grid of a file. Values are [layers * rows * columns], columns fastest.
template <class Value>
struct VdbGrid {
  std::string name;
  VdbShape shape;
  Value background;
  std::vector<Value> values;
  std::vector<std::uint8_t> is_active;  ///< of the same length; others have the background
};

struct VdbFile {
  std::vector<VdbGrid<std::int32_t>> integers;
  std::vector<VdbGrid<float>> floats;
  std::map<std::string, std::string> metadata;  ///< of the file and of each grid
};

/// What was written, for reports and tests.
struct VdbSummary {
  std::uint64_t active_cells = 0, leaves = 0, tiles = 0;
};

/// Writes the grids; blocks of equal cells become tiles of the tree. Errors: those of PartFile, and
/// kResource where OpenVDB cannot write.
VdbSummary write_vdb(const std::string& path, const VdbFile& file, Existing existing);

/// Reads a file back, for tests: the grids' values over their shapes.
VdbFile read_vdb(const std::string& path, const VdbFile& shapes);

}  // namespace scarp
