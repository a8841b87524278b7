#include "cli/fly/flown_ground.h"

#include "cli/loaded_scene.h"
#include "cli/scene_culling.h"

namespace scarp {

FlownGround flown(const LoadedScene& scene) {
  return {scene.tin,         scene.index, scene.groups, scene.frame, has_horizons(scene.scene),
          scene.scene.path()};
}

}  // namespace scarp
