#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/loaded_scene.h"
#include "core/threads/progress.h"

namespace scarp {

/// What the judge says about a culling method, in triangles, summed over the eyes.
struct VerifyCounts {
  std::string method;
  double eye_height_m = 0;
  std::uint64_t eyes = 0;
  std::uint64_t triangles = 0;         ///< judged: all of the scene, for each eye
  std::uint64_t hidden = 0;            ///< truly
  std::uint64_t in_hidden_groups = 0;  ///< in groups that are truly hidden as a whole
  std::uint64_t culled = 0;            ///< by the method
  std::uint64_t falsely_culled = 0;    ///< by the method, and visible
};

/// Judges random eyes over known ground, the same places at each height.
std::vector<VerifyCounts> verify_scene(const LoadedScene& scene, int eyes,
                                       const std::vector<double>& heights_m, std::uint64_t seed,
                                       const Progress& progress);

}  // namespace scarp
