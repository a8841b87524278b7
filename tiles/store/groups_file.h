#pragma once

#include <string>

#include "core/occlusion/groups.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kGroupsKind = {'G', 'R', 'P', 'S'};

/// Groups, their tree and their regions, packed. Requires the shapes that
/// core/occlusion/groups.h states (asserted).
SectionFileWriter groups_writer(const Groups& groups);

/// What certified regions take in such a file, without its table of sections: bytes.
/// Cost: that of packing them.
std::size_t kept_bytes(const CertifiedRegions& regions);

/// Errors: those of PartFile.
void write_groups(const std::string& path, const Groups& groups, Existing existing);

/// The groups of a file, checked so far that no walk over them leaves its arrays or runs in a
/// circle: shapes, indices in range, children below their parents and naming them, regions one
/// after the other, no NaN in circles and polylines. What the regions claim is not checked here.
/// Errors: kCorrupt. Cost: O(n).
Groups read_groups(const SectionFile& file);

}  // namespace scarp
