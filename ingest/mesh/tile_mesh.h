#pragma once

#include "core/terrain/tile_scheme.h"
#include "ingest/mesh/mesh.h"

namespace scarp {

/// mesh_samples for one tile of a scene, so that the meshes of all tiles of a level are one
/// surface: welded (weld.h), check_tin finds nothing, and the error bound holds over all of it.
///
/// Which samples of a tile's edge become vertices follows from the samples of the edge and those
/// one cell to either side of it, and from nothing else, so the neighbour finds the same ones. An
/// edge between ground and ground is cut into straight pieces, and a piece is good enough if the
/// ground on both sides keeps its error bound even where all samples next to it are vertices: so
/// whatever the tile's inside needs, it can have without another vertex on its edges.
///
/// @param window   the samples of scheme.window_with_halo(tile), in the frame of the scene; of a
///                 coarser level those of `coarsened`. cell_x_m, cell_y_m and bend_cells are those
///                 of the scene (times the stride), the same for all tiles of a level.
/// @param options  with max_error_m; on coarser levels a greater one
/// @return         the tile's own ground, sample_of_vertex in samples of the raster
///                 (row * columns + column); no triangle and no vertex where none of its cells is
///                 ground. lost_samples counts each sample in one tile only.
///
/// A tile that holds the whole raster gets what mesh_samples gives, bit for bit.
/// Errors: Error(kInput) where the grid bends so much that its triangles turn over.
/// Cost: mesh_samples, and for each edge trying pieces of up to 256 cells; on rough ground they are
/// short. A tile of a large raster takes about half the time a sample that the raster would.
/// Side, accuracy, threads, source: as mesh_samples.
Mesh mesh_tile(const TileScheme& scheme, const TileId& tile, const SampleGrid& window,
               const MeshOptions& options, const Progress& progress);

}  // namespace scarp
