#pragma once

#include <cstdint>
#include <vector>

#include "core/occlusion/certified/hiding_bounds.h"
#include "core/occlusion/groups.h"
#include "tests/stability/stability_scenes.h"
#include "tests/support/adversarial_check.h"

namespace scarp::test {

/// A scene in groups, with the regions of both methods: `thesis` (horizons by stewart, 16 sectors
/// of 4 subsectors, and the tree) and `certified`. The groups are squares, the same for both.
struct GroupedScene {
  Tin tin;
  Groups groups;
};
GroupedScene group_scene(const StabilityScene& scene, const HidingOptions& options);

/// The scene's own eyes and `scattered` more: over all of it and somewhat beyond, at, a little and
/// much above ground.
std::vector<Position> eyes_of(const StabilityScene& scene, int scattered);

/// What a method makes of all eyes, in triangles summed over the eyes.
struct MethodCounts {
  std::uint64_t falsely_culled = 0;    ///< culled and visible
  std::uint64_t culled_of_hidden = 0;  ///< culled and in a group that is hidden as a whole
  AdversarialReport search;
};

struct SceneCounts {
  std::uint64_t eyes = 0;
  std::uint64_t visible = 0;           ///< triangles
  std::uint64_t in_hidden_groups = 0;  ///< triangles: the most that groups can cull
  MethodCounts thesis, certified;
};

/// How much is asked of each scene.
struct ComparisonOptions {
  HidingOptions hiding;
  int scattered_eyes = 25;
  std::size_t searches = 60;         ///< for cameras that `certified` is wrong about
  std::size_t thesis_searches = 60;  ///< and `thesis`, which takes longer to answer
};

/// Both methods against the judge, from the scene's eyes and scattered ones, and by adversarial
/// search.
SceneCounts compare_methods(const StabilityScene& scene, const ComparisonOptions& options);

}  // namespace scarp::test
