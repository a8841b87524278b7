#pragma once

#include <string>

#include "core/occlusion/certified/tile_tree.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kTreeKind = {'T', 'R', 'E', 'E'};

/// The group tree across tiles, or a part of it. Requires what check_tile_tree checks (asserted).
/// Errors: those of PartFile.
void write_tree(const std::string& path, const TileTree& tree, Existing existing);

/// What write_tree writes.
SectionFileWriter tree_writer(const TileTree& tree);

/// The tree of a file, as check_tile_tree has it. Errors: kCorrupt. Cost: O(cells).
TileTree read_tree(const SectionFile& file);

}  // namespace scarp
