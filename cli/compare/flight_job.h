#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/compare/compared_job.h"
#include "cli/fly/flown_ground.h"
#include "core/threads/progress.h"

namespace scarp {

struct FlightQuestion {
  std::vector<std::string> routes;  ///< as scarp fly calls them
  int frames = 20;                  ///< of each
  std::uint64_t seed = 1;
  double limit_s = 300;  ///< frames that would not fit are left out
  std::string ground;    ///< what is flown over, in words
  std::string commands;  ///< that make the scene, with " && ", or none
  std::string scene;     ///< as commands call it
};

/// Every culling method on short flights over one ground: wrong pixels against the time of a frame
/// and the triangles drawn.
/// @param why[out]  why there is nothing, where there is not
std::optional<ComparedJob> compare_flight(const FlownGround& ground, const FlightQuestion& question,
                                          const Progress& progress, std::string& why);

}  // namespace scarp
