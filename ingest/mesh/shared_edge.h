#pragma once

#include <vector>

#include "core/terrain/sample_grid.h"
#include "ingest/mesh/mesh.h"
#include "ingest/mesh/sample_plane.h"

namespace scarp {

/// Cuts edges between two tiles into straight pieces, in the same way for both: nothing counts but
/// the samples of the edge and the rows of samples next to it on either side.
///
/// A tile must not add vertices to such a piece, so it has to be good enough whatever the tile's
/// inside needs. At worst all samples next to it become vertices. Then the strip of cells along it
/// is cut off from the rest, because sample edges are Delaunay, and its triangles are known: those
/// on one half of the piece have its near end for apex. A piece is good where the error bound holds
/// over these strips on both sides; one cell long it always is.
class SharedEdge {
 public:
  /// @param grid         cell sizes and bend_cells are those of the whole level
  /// @param max_error_m  as the mesher's goal
  SharedEdge(const SampleGrid& grid, double max_error_m, MeshBound bound);

  /// Appends the samples that become vertices, ends included, in order.
  /// @param from, to      on one grid line, ground on both sides between them; from is the lesser
  /// @param from_corner,  whether these ends are corners of tiles. The samples next to those are
  ///        to_corner     always vertices: they lie beside the other edges of the corner.
  /// Cost: O(length * log length * kLongestPieceCells) at most.
  void cut(const GridNode& from, const GridNode& to, bool from_corner, bool to_corner,
           std::vector<GridNode>& vertices) const;

  /// Longer pieces would cost more time to try than they save triangles.
  static constexpr std::int32_t kLongestPieceCells = 256;

 private:
  struct Line;
  struct Worst;
  std::int32_t place_to_cut(const Line& line, std::int32_t from, std::int32_t to) const;
  void look_along_samples(const Line& line, std::int32_t from, std::int32_t to, int side,
                          Worst& worst) const;
  void look_along_fans(const Line& line, std::int32_t from, std::int32_t to, int side,
                       Worst& worst) const;

  const SampleGrid& grid_;
  const double max_error_m_;
  const MeshBound bound_;
  std::int32_t longest_cells_;
};

}  // namespace scarp
