#pragma once

#include <optional>

#include "cli/compare/jobs.h"

namespace scarp::test {

/// Horizons by bisection with Embree's rays over the square's cells as two triangles each; nothing
/// where Embree is not installed. The ground is kept by reference.
std::optional<HorizonPeer> embree_horizons(const ComparedGround& ground);

}  // namespace scarp::test
