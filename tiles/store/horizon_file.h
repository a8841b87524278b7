#pragma once

#include <string>

#include "core/horizon/sectors.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kHorizonKind = {'H', 'O', 'R', 'Z'};

/// Requires horizon_vertex to have layout.count entries a vertex. The writer borrows the table.
SectionFileWriter horizon_writer(const HorizonTable& table);

/// Errors: those of PartFile.
void write_horizon(const std::string& path, const HorizonTable& table, Existing existing);

/// The table of a file, with a usable layout and every entry kNone or a vertex that has a row.
/// Errors: kCorrupt. Cost: O(n).
HorizonTable read_horizon(const SectionFile& file);

}  // namespace scarp
