#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/horizon/sectors.h"
#include "core/occlusion/certified/certified_regions.h"
#include "core/terrain/tin.h"

namespace scarp {

/// Index of a node of the group tree. The leaves come first: nodes [0, leaf_count) are the groups
/// that triangles belong to, the others are merged from two nodes with smaller indices.
using GroupIndex = std::uint32_t;

/// Where a camera is hidden from a whole node, in one sector's plane (u along the sector's axis
/// from the frame's origin, z up, both metres): u >= the first point's u, and z strictly below the
/// polyline, which goes on beyond its last point with end_slope. Concave, so the region is convex.
/// No points: nothing is hidden.
struct RegionPoint {
  double u_m;
  double z_m;
};
struct RegionView {
  const RegionPoint* points;
  std::uint32_t count;
  double end_slope;
};

/// The regions of all nodes in all sectors, in one flat array each.
struct Regions {
  SectorLayout layout;
  std::vector<std::uint32_t> first;  ///< [nodes * sectors + 1] into points
  std::vector<RegionPoint> points;
  std::vector<double> end_slope;  ///< [nodes * sectors]

  RegionView at(GroupIndex node, std::int32_t sector) const {
    const std::size_t i = static_cast<std::size_t>(node) * static_cast<std::size_t>(layout.count) +
                          static_cast<std::size_t>(sector);
    return {points.data() + first[i], first[i + 1] - first[i], end_slope[i]};
  }
};

/// A node of the group tree and the circle in the plane that holds its triangles.
struct GroupNode {
  GroupIndex parent = kNone;
  std::array<GroupIndex, 2> children = {kNone, kNone};
  std::uint32_t triangles = 0;
  double centre_x_m = 0;
  double centre_y_m = 0;
  double radius_m = 0;
};

/// Triangles in groups that are hidden together, the tree above them and their regions.
struct Groups {
  std::vector<GroupIndex> group_of_triangle;  ///< [triangles], kNone for an orphan: always drawn
  std::uint32_t leaf_count = 0;
  std::vector<GroupNode> nodes;
  Regions regions;
  /// Of the leaves; none where the scene was built without.
  CertifiedRegions certified;

  bool has_certified() const { return leaf_count > 0 && certified.groups.size() == leaf_count; }
};

}  // namespace scarp
