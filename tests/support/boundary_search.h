#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"

namespace scarp::test {

/// [groups] the triangles of each group, ascending; orphans are left out.
std::vector<std::vector<TriangleIndex>> triangles_of_groups(
    std::span<const GroupIndex> group_of_triangle, std::uint32_t groups);

/// Whether the judge sees any of the triangles. Serial; ends at the first that is seen.
bool is_any_seen(const TinIndex& index, const Position& eye,
                 std::span<const TriangleIndex> triangles);

/// Greatest lattice height in [low_m, high_m] from which the group is hidden at a place, by
/// bisection to one lattice step, or nothing where it is not hidden from low_m.
std::optional<double> greatest_hidden_z(const CertifiedRegions& regions, GroupIndex group,
                                        Position place, double low_m, double high_m);

struct BoundarySearch {
  std::uint64_t seed = 1;
  int starts = 4;                      ///< random directions and distances around each group
  int steps = 24;                      ///< of each climb
  std::size_t most_groups = SIZE_MAX;  ///< of more groups, so many evenly spread over their order
};

/// What a search found, over all groups.
struct BoundaryFinding {
  std::uint64_t judged = 0;       ///< cameras just inside the boundary of a region
  std::uint64_t false_culls = 0;  ///< of them, that see a triangle of the group
  GroupIndex group = kNone;       ///< of the first false cull
  Position eye{};                 ///< its camera
  /// Least height above the boundary from which the judge sees the group where a climb ended,
  /// metres: how close the search came, to an eighth. Infinite where no region hides anything.
  double least_slack_m = 0;
};

/// Looks for cameras that a region hides wrongly. For each group and each start a place is drawn
/// around the group, the height at which its region's answer flips is bisected, and the camera
/// just inside is judged against all triangles of the group. Then the place is moved, in steps that
/// get finer down to the lattice, to where the truth lies less above that height: as long as the
/// judge sees the group from closer above the boundary than before.
///
/// @param members  triangles_of_groups of the same groups
/// Parallel over the groups; the same finding for any number of threads.
/// Cost: searched groups * starts * steps * about two judgements of a group.
BoundaryFinding search_boundaries(const TinIndex& index, const CertifiedRegions& regions,
                                  const std::vector<std::vector<TriangleIndex>>& members,
                                  const BoundarySearch& search);

}  // namespace scarp::test
