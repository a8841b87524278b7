#pragma once

#include <cstddef>
#include <vector>

#include "core/occlusion/upright_occluder.h"
#include "core/sight/tin_index.h"
#include "core/terrain/occluder.h"

namespace scarp {

struct VirtualOccluderOptions {
  double triangle_share = 0.1;  ///< of the surface's triangles that the simplified one may have
  /// How far simplification may rise above the surface before it is lowered under it again, as a
  /// share of the surface's relief.
  double most_raised_share = 0.005;
  std::size_t most_sections = 4000;  ///< sections kept, of the longest and most prominent ridges
  /// A section goes on to both sides for so many times its ridge edge's length.
  double reach = 8;
  /// A ridge has no section of its own where a more prominent one's, in the same direction, passes
  /// it not lower than this share of the relief.
  double near_share = 0.01;
  std::size_t most_corners = 12;  ///< of a section's polyline
};

/// The solid under a surface in few pieces that all lie within it: what they hide is hidden.
struct VirtualOccluders {
  Occluder mesh;  ///< simplified, nowhere above the surface; check_under proves it
  /// Through ridges of the mesh, strictly under it.
  std::vector<UprightOccluder> sections;
};

/// One-sided simplification: edge collapses that take least from the solid under the surface, roofs
/// and walls of buildings as well as ground, and then a lowering of what still rises above it
/// (lower_under, which makes the occluders of coarse tiles too).
///
/// Side: nowhere above the surface; no ground where that has none. Requires a valid TIN.
/// Cost: about 20 us a vertex. Source: Law and Tan 1999, 4; the lowering is ours.
Occluder simplified_under(const Tin& tin, const VirtualOccluderOptions& options);

/// One-sided simplification, and sections along the ridges of what is left. Law and Tan join faces
/// that look away from the target, and cut their supporting planes into a flat occluder for each
/// target; a section of the solid serves all targets. Sections are made in double and kept where
/// exact predicates find them strictly under the mesh.
/// Side: as simplified_under.
VirtualOccluders find_virtual_occluders(const Tin& tin, const VirtualOccluderOptions& options);

/// Whether a polyline runs strictly under ground, ends included. Exact. Requires lattice places,
/// neighbours apart in the plane.
bool is_under_ground(const TinIndex& index, const std::vector<Position>& polyline);

}  // namespace scarp
