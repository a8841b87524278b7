#pragma once

#include <string>

#include "core/terrain/sample_grid.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kSamplesKind = {'S', 'M', 'P', 'L'};

/// Placed samples of a tile, as one step of a build hands them to the next: no part of a scene.
/// Errors: those of PartFile.
void write_samples(const std::string& path, const SampleGrid& samples, Existing existing);

/// The samples of a file, bit for bit what was written. Errors: kCorrupt. Cost: O(n).
SampleGrid read_samples(const SectionFile& file);

}  // namespace scarp
