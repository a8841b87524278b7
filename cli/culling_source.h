#pragma once

#include "cli/loaded_scene.h"
#include "tiles/culling/culling_file.h"

namespace scarp {

/// What a scene's culling file is made of. The scene must outlive it.
/// Throws Error{kInput} where the scene was built without certified regions, or does not tell what
/// its tiles hold.
CullingSource culling_source(const LoadedScene& scene);

}  // namespace scarp
