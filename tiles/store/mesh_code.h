#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/terrain/tin.h"
#include "tiles/store/section_file.h"

namespace scarp {

/// A TIN whose vertices are samples of a raster, and which sample each is.
struct SampledTin {
  Tin tin;
  std::vector<std::int64_t> sample_of_vertex;  ///< [vertices], row * columns + column, rising
};

/// Adds a mesh to a file as few bytes: from triangle to triangle across their edges, for each edge
/// what lies beyond it (border, a new vertex, or which of those that are known), and for each new
/// vertex how far sample and height are from those expected beyond the triangle, and position from
/// a polynomial of the sample and the height. All of it in whole numbers: nothing is lost.
///
/// @param tin      check_tin finds nothing; triangles with their lowest vertex first, ordered by
///                 that and the next one, as mesh_samples has them (asserted); no vertex farther
///                 than 2^19 m from another in any coordinate
/// @param samples  [vertices], rising, from 0
/// @param columns  of the raster, at least 1, at most 2^31
/// @param heights_m  [vertices] as the data have them, or empty. Data come in whole metres, feet or
///                 parts of them, which take fewer bytes than heights in the frame
/// Cost: about 3 us a vertex, most of it packing.
/// Source: the walk is that of cut-border machines (Gumhold and Strasser 1998), without their
/// splits: known vertices are named by number, so that borders, holes and parts need no rules.
void add_mesh_code(SectionFileWriter& writer, const Tin& tin, std::span<const std::int64_t> samples,
                   std::int64_t columns, std::span<const double> heights_m = {});

/// The inverse, bit for bit. Errors: kCorrupt; the triangles may still be any that a walk gives,
/// clockwise ones too. Cost: about 0.3 us a vertex.
SampledTin read_mesh_code(const SectionFile& file);

}  // namespace scarp
