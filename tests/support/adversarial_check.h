#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "core/occlusion/certified/certified_regions.h"
#include "core/occlusion/groups.h"
#include "core/sight/tin_index.h"

namespace scarp::test {

/// A camera just inside what a method calls hidden, and how much room the truth leaves there.
struct BorderCamera {
  GroupIndex group = 0;
  Position eye;
  /// How far the camera may rise before the judge sees the group, over its distance from the
  /// group's middle. Below zero for a false cull: how far it must sink until the group is hidden.
  double margin = 0;
};

struct AdversarialReport {
  std::uint64_t cameras = 0;      ///< just inside a region, judged
  std::uint64_t false_culls = 0;  ///< of them, those that see a triangle of the group
  /// The one with the least margin of all, the worst false cull where there are any. Nothing where
  /// no camera was hidden from any group.
  std::optional<BorderCamera> worst;
};

/// Whether a method calls a group hidden from a camera. Must be safe to call from several threads,
/// and hide all cameras under one that it hides.
using HidesGroup = std::function<bool(GroupIndex, const Position&)>;

/// Looks for cameras that a method hides from a group which the judge sees from there.
///
/// Each search takes a random group and some places for a camera: anywhere around the group, or
/// beyond a vertex of the mesh as seen from the group, where the answer is close. There the height
/// at which the method's answer flips is found by bisection, and the judge asked just below it
/// about every triangle of the group. Then the best of the places climbs, by random steps of all
/// sizes, towards where the judge is nearest to disagreeing.
///
/// @param group_of_triangle  [triangles], kNone where a triangle is in no group
/// @param hides              the method
/// @param searches           of kProbes + kClimbSteps cameras each
/// Requires a TIN for which check_tin finds nothing. Same bits for any thread count.
/// Cost: a search judges a group about kProbes + kClimbSteps times; on scenes of some hundred
/// triangles in groups of 8 that is about a millisecond.
AdversarialReport adversarial_check(const TinIndex& index,
                                    std::span<const GroupIndex> group_of_triangle,
                                    std::uint32_t groups, const HidesGroup& hides,
                                    std::uint64_t seed, std::size_t searches);

/// The same for certified regions.
AdversarialReport adversarial_check(const Tin& tin, std::span<const GroupIndex> group_of_triangle,
                                    const CertifiedRegions& regions, std::uint64_t seed,
                                    std::size_t searches);

inline constexpr int kProbes = 8;
inline constexpr int kClimbSteps = 9;

}  // namespace scarp::test
