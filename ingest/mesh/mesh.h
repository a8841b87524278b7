#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"

namespace scarp {

/// Where the error bound of a mesh must hold.
enum class MeshBound {
  kSurface,  ///< everywhere on the ground, whichever diagonal a cell is read with
  kSamples,  ///< at the samples only, as most meshers do; fewer triangles, weaker promise
};

/// Exactly one of max_error_m and vertex_budget is given.
struct MeshOptions {
  std::optional<double> max_error_m = {};  ///< >= 0, vertical, in flattened space
  /// Stop at so many vertices; the corners of the border, and what bending demands, come first and
  /// in any case.
  std::optional<std::uint32_t> vertex_budget = {};
  MeshBound bound = MeshBound::kSurface;  ///< for max_error_m
};

/// An error-bounded triangulation of the ground of a SampleGrid.
struct Mesh {
  Tin tin;
  /// [vertices] the sample that each vertex is, rising; -1 for a vertex that is no sample.
  std::vector<std::int64_t> sample_of_vertex;
  double error_at_samples_m = 0;    ///< greatest vertical distance at a sample
  double error_over_surface_m = 0;  ///< the same over the whole ground, but for resolved cells
  /// Greatest distance between the two readings of a cell whose four corners are vertices: there
  /// the mesh takes one diagonal where the data do not say which.
  double cell_ambiguity_m = 0;
  std::uint32_t lost_samples = 0;  ///< known samples that belong to no ground cell
};

/// How far a border edge may run from the samples between its ends, in cells (bent grids only).
inline constexpr double kBorderDeviationCells = 1.0 / 32;

/// Rounding of heights compared in double, metres: measured errors are this exact, and an error
/// bound below half of it means half of it.
inline constexpr double kErrorRoundingM = 1e-7;

/// Greatest number of columns and of rows, so that all arithmetic in the sample plane is exact.
inline constexpr std::int32_t kMeshReachCells = 1 << 20;

/// Error-bounded TIN of the ground: greedy insertion of the sample with the greatest error into a
/// constrained Delaunay triangulation of the sample plane (columns to the right, rows down, scaled
/// to the shape of a cell). The ground is the union of the cells with four known corners; it is cut
/// out exactly along the sample edges, holes and islands included.
///
/// Of the two diagonals of four vertices on one circle the one with the lesser error is taken.
///
/// With MeshBound::kSurface the error is bounded wherever a mesh edge crosses a grid line or either
/// diagonal of a cell, which bounds it everywhere: between those the difference is linear.
///
/// @param grid     at most kMeshReachCells in columns and rows, fewer than 2^30 samples; void
///                 samples need x and y, too, where the grid bends
/// @return         a mesh for which check_mesh finds nothing
///
/// Side: none; an error may lie above or below the ground.
/// Errors: Error(kInput) where there is no ground cell, or where the grid bends so much from one
///   cell to the next that its triangles turn over.
/// Cost: about 2 microseconds and 200 bytes a vertex, and O(log n) looks at each sample.
/// Same bits on every run; one thread. Accuracy: kErrorRoundingM.
/// Source: Garland and Heckbert 1995 (greedy insertion), with CGAL's triangulation.
Mesh mesh_samples(const SampleGrid& grid, const MeshOptions& options, const Progress& progress);

/// What measure_error finds. Errors are vertical distances in flattened space, metres.
struct MeasuredError {
  double at_samples_m = 0;
  double over_surface_m = 0;            ///< as Mesh::error_over_surface_m
  double cell_ambiguity_m = 0;          ///< as Mesh::cell_ambiguity_m
  double border_gap_cells = 0;          ///< farthest that a border sample lies outside the mesh
  std::uint64_t uncovered_samples = 0;  ///< samples of ground cells farther outside than that
};

/// The judge of mesh_samples: every triangle is cut with every ground cell that it touches, read
/// with either diagonal, and the two planes are compared at the corners of what they share. Border
/// samples just outside the mesh (bent grids) are compared with the plane of their border triangle.
///
/// Requires every vertex to be a sample. Cost: O(cells + triangles), about 2 microseconds each.
/// Errors: none. Accuracy: kErrorRoundingM.
MeasuredError measure_error(const SampleGrid& grid, const Mesh& mesh);

/// What measure_error finds of each triangle by itself: the greatest of its over_surface_m and
/// at_samples_m; cells that it fills alone with another count as in cell_ambiguity_m and are left
/// out. [triangles], metres. Requirements, cost and accuracy as measure_error.
std::vector<double> measure_triangle_errors(const SampleGrid& grid, const Mesh& mesh);

/// Names the first broken invariant of a mesh of a grid, or nothing where all hold: check_tin;
/// vertices are their samples; Delaunay in the sample plane but across the border; the border runs
/// along sample edges with ground on its inner side only; the area is that of the ground, exactly.
/// Requires every vertex to be a sample. Cost: O(n log n).
/// @param tile_cells  of a mesh that is welded of tiles of so many cells: their edges are where the
///                    whole need not be Delaunay, and no triangle crosses one
std::optional<std::string> check_mesh(const SampleGrid& grid, const Mesh& mesh,
                                      std::optional<std::int32_t> tile_cells = {});

}  // namespace scarp
