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

/// The same for the groups of one tile of a scene, which must outlive it.
std::unique_ptr<CullingMethod> culling_method(const Scene& scene, const Groups& groups,
                                              const std::string& name);

/// Whether a scene has horizons of the vertices. Without them the regions of method thesis are
/// empty, and hide nothing.
bool has_horizons(const Scene& scene);

/// All methods that groups can be culled by, thesis first. The groups must outlive them.
std::vector<std::unique_ptr<CullingMethod>> culling_methods(const Groups& groups,
                                                            bool has_horizons);

/// What a method's regions take of the groups' file, bytes.
std::size_t region_bytes(const Groups& groups, const std::string& method);

}  // namespace scarp
