#pragma once

#include <string>

#include "core/terrain/range_pyramid.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kRangeKind = {'R', 'N', 'G', 'E'};

/// A tile's row of the minimum/maximum pyramid. Errors: those of PartFile.
void write_ranges(const std::string& path, const TileRanges& ranges, Existing existing);

/// The ranges of a file; no NaN. Errors: kCorrupt. Cost: O(blocks).
TileRanges read_ranges(const SectionFile& file);

}  // namespace scarp
