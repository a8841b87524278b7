#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/terrain/tin.h"
#include "tests/support/drawn_scene.h"

namespace scarp::test {

/// A small terrain on which methods of culling fail, and why.
struct StabilityScene {
  std::string name;
  std::string fails;  ///< the line of the catalogue
  std::string shows;
  Tin tin;
  std::uint32_t group_triangles = 8;
  std::vector<NamedEye> eyes;
};

/// Every line of the catalogue of places where methods fail: the drawn scenes of tests/scenes, then
/// those that are made of numbers (needles, great coordinates, places on the Earth).
std::vector<StabilityScene> stability_scenes();

}  // namespace scarp::test
