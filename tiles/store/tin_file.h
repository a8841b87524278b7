#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/terrain/tin.h"
#include "tiles/store/mesh_code.h"
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

/// The same in about a fifteenth of the bytes, for scenes of many tiles, where every vertex is a
/// sample: see add_mesh_code, which says what it requires and what it costs. read_sampled_tin gives
/// back bit for bit what was written.
///
/// @param columns    of the raster that samples are numbered in
/// @param heights_m  [vertices] as the data have them, or empty: they make smaller files only
SectionFileWriter compact_tin_writer(const Tin& tin, std::span<const std::int64_t> sample_of_vertex,
                                     std::int64_t columns, std::span<const double> heights_m = {});

/// Errors: those of PartFile.
void write_compact_tin(const std::string& path, const Tin& tin,
                       std::span<const std::int64_t> sample_of_vertex, std::int64_t columns,
                       std::span<const double> heights_m, Existing existing);

/// The TIN of a file, of either kind, checked so far that no walk over it leaves its arrays:
/// indices in range, lattice coordinates, counter-clockwise triangles, neighbours mutual and across
/// the right edge. check_tin finds the rest. Samples are -1 or more, and none where the file does
/// not tell; the raster's size is not known here. Errors: kCorrupt. Cost: O(n).
SampledTin read_sampled_tin(const SectionFile& file);

/// Without the samples.
Tin read_tin(const SectionFile& file);

}  // namespace scarp
