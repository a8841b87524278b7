#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/build/certified_settings.h"
#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/certified/hiding_bounds.h"
#include "core/occlusion/groups.h"
#include "core/occlusion/hidden_together.h"
#include "core/terrain/tin.h"
#include "tests/support/eyes_over_ground.h"

namespace scarp::test {

/// Figures count for a DEM where at least this share of its triangles is in truly hidden groups.
inline constexpr double kLeastInHiddenGroups = 0.005;

/// How groups are made, certified and judged.
struct CertifiedQuestion {
  std::uint32_t group_triangles = HiddenTogetherOptions{}.group_triangles;
  double compactness = HiddenTogetherOptions{}.compactness;
  double bytes = kCertifiedBytes;   ///< a triangle
  std::optional<int> sectors = {};  ///< instead of bytes
  CertifiedSettings certified = {};
  int eyes = 30;  ///< at each height
  /// The groups of so many triangles drawn at random are certified and judged, all groups where
  /// there are no more: a fair sample, because groups do not depend on each other. Partitions of
  /// one mesh are drawn from at the same places, so that they can be compared.
  std::uint32_t groups = UINT32_MAX;
  /// Meshes of at most so many triangles are judged whole all the same, and from kEyesOfWhole times
  /// the eyes: a DEM counts as much as any other, and of a small one a hundred groups say little.
  std::uint32_t whole_triangles = 0;
};
inline constexpr int kEyesOfWhole = 3;

/// Triangles over all eyes of a height. A triangle of a sample stands for as many as its weight.
struct SeenCounts {
  double triangles = 0, hidden = 0, in_hidden = 0, culled = 0, falsely = 0;
  double bound = 0;  ///< under the bounds of whole cells, before they are coded
};

/// A way to divide a mesh into groups, and what came of it.
struct Partition {
  std::string name;
  LeafGroups groups;  ///< those drawn; all other triangles have none
  std::uint32_t all_groups = 0, median_group = 0;
  double orphans = 0;  ///< share of all triangles
  double grow_user_s = 0;
  /// [triangles] 1 where all groups are drawn; of a sample each draw is shared out to its group.
  std::vector<float> weight;
  std::vector<TriangleIndex> drawn;  ///< in turn; none where all groups are judged
  HidingBounds bounds;
  CertifiedRegions regions;
  double certify_user_s = 0, certify_wall_s = 0;  ///< of all groups; predicted from a sample
  double bytes_per_triangle = 0;                  ///< of all groups
  std::array<SeenCounts, kEyeHeightsM.size()> counts{};
  /// [heights][groups] from how many eyes a group is culled
  std::array<std::vector<std::uint32_t>, kEyeHeightsM.size()> culled_eyes;
};

/// Groups that are hidden together, as by the product.
Partition crystals_of(const Tin& tin, const CertifiedQuestion& question);

/// Squares of a quadtree of the same mean size.
Partition squares_like(const Tin& tin, const Partition& crystals,
                       const CertifiedQuestion& question);

/// Certifies what was drawn, with sectors for all groups. Ends the program where regions are
/// broken. The cost of all is predicted from that of the sample and of its outermost groups: what a
/// mesh costs once, and what each group does.
void certify(const Tin& tin, const CertifiedQuestion& question, Partition& part);

/// Eyes at each height for a mesh.
int eyes_for(const Tin& tin, const CertifiedQuestion& question);

/// What the exact judge sees of some partitions from seeded eyes, the same for all of them.
struct JudgedEye {
  std::size_t height;  ///< index into kEyeHeightsM
  Position eye;
  std::vector<std::uint8_t> is_visible;  ///< [triangles]; 0 where none of the partitions counts it
};
std::vector<JudgedEye> judge_eyes(const Tin& tin, const std::vector<const Partition*>& parts,
                                  int eyes);

/// Counts anew what a certified partition culls from the eyes.
void count_eyes(const std::vector<JudgedEye>& eyes, Partition& part);

/// What one partition culls over what another does, of the same triangles, at the heights where the
/// first has something to cull, taken together.
struct Advantage {
  double culled = 0;     ///< triangles culled / triangles culled
  double in_hidden = 0;  ///< the same of triangles in truly hidden groups: what regions could reach
  double error = 0;      ///< standard error of `culled` that the draw of groups makes
};

/// Requires both drawn at the same places and counted from the same eyes.
/// @return nothing where the other one culls nothing
std::optional<Advantage> advantage_of(const Partition& part, const Partition& over);

/// A partition's figures in words.
nlohmann::json row_of(const Tin& tin, const Partition& part);

/// User time of all threads until now.
double user_seconds();
double wall_seconds();

}  // namespace scarp::test
