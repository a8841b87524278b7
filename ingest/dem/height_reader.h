#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ingest/dem/raster_file.h"

namespace scarp {

/// A rectangle of samples, such as of a file or of a mosaic.
struct SampleRect {
  std::int32_t first_column = 0, first_row = 0, columns = 0, rows = 0;
};

/// Values of a piece of a file as they are stored there, with what is known among them.
struct StoredValues {
  std::vector<double> values;
  std::vector<std::uint8_t> mask;  ///< 0 where void
};

struct HeightUnit {
  const char* name;
  double metres;
};

/// Reads heights of one file, in metres. One thread at a time. Borrows file and options.
/// Errors, of all members: Error{kInput} in one line, as read_dem says.
class HeightReader {
 public:
  HeightReader(const RasterFile& source, const DemOptions& options, bool on_earth);

  const char* unit_name() const { return unit_.name; }

  /// The stored values of a rectangle of the file, in the file's own order of rows.
  void read_values(const SampleRect& rect, StoredValues& stored) const;

  /// Stored values of a part of a row to metres, in place, 0 where void; the mask becomes what is
  /// known, 0 or not.
  /// @param column, row  of the first value in the file, for messages
  void to_metres(std::int32_t column, std::int32_t row, std::span<double> values,
                 std::span<std::uint8_t> mask) const;

 private:
  /// Can the mask differ from "all known"? Where it stands for a nodata value only, it is as costly
  /// as the heights, and mostly nothing is near that value.
  bool may_be_void(std::span<const double> values) const;
  /// Refuses a stored value that is no height.
  void check_height(double value, std::int32_t column, std::int32_t row) const;

  const RasterFile& source_;
  const DemOptions& options_;
  bool on_earth_;
  HeightUnit unit_;
  double scale_ = 1, offset_ = 0;
  bool has_mask_ = false;
};

}  // namespace scarp
