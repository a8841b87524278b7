#pragma once

#include <cstdint>
#include <vector>

#include "cli/fly/valley_way.h"
#include "cli/loaded_scene.h"
#include "core/culling/group_batches.h"

namespace scarp {

/// Something that moves through a flight: a box that keeps its direction, as culling sees it.
struct Mover {
  std::vector<PlanPoint> way;
  double begin_m = 0;  ///< along the way, at the first frame
  double step_m = 0;   ///< a frame; backwards where negative; it turns back at either end
  double half_length_m = 0, half_width_m = 0, height_m = 0;
  double above_ground_m = 0;    ///< its underside; NaN for one that flies level
  double level_m = 0;           ///< then, its flattened height
  bool is_translucent = false;  ///< is hidden, and hides nothing
};

/// Vehicles on the ground and, every third, an aircraft; every fourth is translucent. The same seed
/// makes the same ones.
/// @param on_streets  vehicles keep to the streets of a town, otherwise to valleys
std::vector<Mover> make_movers(const LoadedScene& scene, int count, bool on_streets,
                               std::uint64_t seed);

/// Where a mover is at a frame; not on the lattice.
Bounds box_at(const Mover& mover, const TinIndex& index, std::size_t frame);

/// Adds the twelve triangles of a box, all with one object number.
void add_box(const Bounds& box, std::uint32_t object, GroupBatches::Drawing& drawing);

}  // namespace scarp
