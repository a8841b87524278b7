#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace scarp {

/// What a tile's property table says of each of its groups.
struct GroupRow {
  std::uint32_t group = 0;  ///< its number in the scene
  std::uint32_t triangles = 0;
  std::uint32_t first_triangle = 0;  ///< its triangles follow each other in the mesh
  double least_height_m = 0;         ///< above the ellipsoid, of its ground
  double greatest_height_m = 0;
  /// West, south, east, north, radians on WGS 84; west is the greater across the antimeridian.
  std::array<double, 4> region_rad{};
};

/// Ground as glTF draws it: an axis z up, metres, positions relative to an origin.
struct TerrainMesh {
  std::array<double, 3> origin_m{};
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;  ///< of length 1
  /// Corners of triangles, counter-clockwise seen from above.
  std::vector<std::uint32_t> corners;
  /// Row of each vertex in `groups`, groups.size() for ground of no group. Empty where the tile has
  /// no groups at all, as coarse ones.
  std::vector<std::uint32_t> row_of_vertex;
  std::vector<GroupRow> groups;
};

enum class GlbCompression {
  kPlain,
  kMeshopt,  ///< EXT_meshopt_compression; normals in 8 bits (KHR_mesh_quantization)
};

/// A tile's ground as binary glTF 2.0: one mesh of one primitive, below a node that carries the
/// origin. glTF has y up: (x, y, z) is written as (x, z, -y), which readers of 3D Tiles turn back.
/// Positions are the given floats, bit for bit, compressed or not. Groups are feature ids
/// (EXT_mesh_features) and a property table (EXT_structural_metadata). Triangles keep their order.
///
/// Requires at least one triangle, as many normals as positions, fewer than 2^24 groups (asserted).
/// Cost: O(n). The same mesh gives the same bytes. Errors: none.
std::vector<std::byte> terrain_glb(const TerrainMesh& mesh, GlbCompression compression);

}  // namespace scarp
