#pragma once

#include "core/horizon/sectors.h"
#include "tiles/store/section_file.h"

namespace scarp {

/// Most sectors, and most subsectors, that a file may ask for: 20 seconds of arc are finer than any
/// raster, and their product stays a 32-bit number.
inline constexpr std::int32_t kMostSectors = 1 << 16;
inline constexpr std::int32_t kMostSubsectors = 1 << 14;

/// The section "layout" of horizon and group files: sectors, subsectors.
void add_layout(SectionFileWriter& writer, const SectorLayout& layout);
SectorLayout read_layout(const SectionFile& file);

}  // namespace scarp
