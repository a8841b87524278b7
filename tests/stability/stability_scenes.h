#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/terrain/sample_grid.h"
#include "core/terrain/tin.h"
#include "tests/judge/tiled_scene.h"
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
  /// Cells a side of the tiles that the raster is built in, if it is built in tiles: `tin` is then
  /// what the finest of them make up.
  std::int32_t tile_samples = 0;
  SampleGrid raster = {};
};

/// Every line of the catalogue of places where methods fail: the drawn scenes of tests/scenes, then
/// those that are made of numbers (needles, great coordinates, places on the Earth).
std::vector<StabilityScene> stability_scenes();

/// A scene in tiles, certified tile by tile. Requires tile_samples.
TiledScene tiled(const StabilityScene& scene, const HidingOptions& hiding);

}  // namespace scarp::test
