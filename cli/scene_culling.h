#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/loaded_scene.h"
#include "core/culling/culling_method.h"

namespace scarp {

/// The culling method of a scene that a user names: "certified" or "thesis"; where the name is
/// empty, certified if the scene has it. The scene must outlive it.
///
/// Throws Error{kInput} where the scene was built without what the method needs.
std::unique_ptr<CullingMethod> culling_method(const LoadedScene& scene, const std::string& name);

/// All methods that a scene was built for, thesis first.
std::vector<std::unique_ptr<CullingMethod>> culling_methods(const LoadedScene& scene);

}  // namespace scarp
