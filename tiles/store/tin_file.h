#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/terrain/tin.h"
#include "tiles/store/section_file.h"

namespace scarp {

inline constexpr FileKind kTinKind = {'T', 'I', 'N', ' '};

/// A TIN, and optionally where each vertex came from: the index of its sample in the raster
/// (row * columns + column), -1 where it has none.
///
/// @param sample_of_vertex  [vertices] or empty: not written
///
/// Requires check_tin(tin) to find nothing, and fewer than 2^32 - 1 vertices and triangles.
/// The writer borrows both. Errors: none.
SectionFileWriter tin_writer(const Tin& tin, std::span<const std::int64_t> sample_of_vertex = {});

/// Errors: those of PartFile.
void write_tin(const std::string& path, const Tin& tin,
               std::span<const std::int64_t> sample_of_vertex, Existing existing);

/// The same in about a third of the bytes, for scenes of many tiles: heights and places in lattice
/// steps from a corner, corners of triangles and samples as differences, no neighbours, which are
/// found again. read_tin gives back bit for bit what was written.
///
/// Requires besides: vertices within 2^19 m of each other, as those of a tile are (asserted).
SectionFileWriter compact_tin_writer(const Tin& tin,
                                     std::span<const std::int64_t> sample_of_vertex);

/// Errors: those of PartFile.
void write_compact_tin(const std::string& path, const Tin& tin,
                       std::span<const std::int64_t> sample_of_vertex, Existing existing);

/// The TIN of a file, of either kind, checked so far that no walk over it leaves its arrays:
/// indices in range, lattice coordinates, counter-clockwise triangles, neighbours mutual and across
/// the right edge. check_tin finds the rest. Errors: kCorrupt. Cost: O(n).
Tin read_tin(const SectionFile& file);

/// [vertices], or empty where the file does not tell. Each is -1 or more; the raster's size is not
/// known here. Errors: kCorrupt.
std::vector<std::int64_t> read_sample_of_vertex(const SectionFile& file);

}  // namespace scarp
