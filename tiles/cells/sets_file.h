#pragma once

#include <string>

#include "core/culling/view_cells.h"
#include "tiles/store/section_file.h"

namespace scarp {

/// The table of hidden sets beside a file of view cells: kind "SETS", docs/formats.md.
SectionFileWriter sets_writer(const HiddenSets& sets);
/// Errors: those of PartFile.
void write_sets(const std::string& path, const HiddenSets& sets);

/// Errors: kCorrupt where the file is no proper table.
HiddenSets read_sets(const SectionFile& file);

}  // namespace scarp
