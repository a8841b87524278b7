#include "cli/scene_culling.h"

#include <fmt/format.h>

#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"

namespace scarp {
namespace {

/// Without horizons of the vertices the regions of the thesis are empty, and hide nothing.
bool has_thesis(const LoadedScene& scene) {
  return scene.scene.find(kOnlyTile, "horizon") != nullptr;
}

[[noreturn]] void refuse(const LoadedScene& scene, const char* method, const char* other) {
  throw Error(ErrorCode::kInput,
              fmt::format("'{}': the scene was built without what --method {} needs; build it "
                          "with --horizon both, or give --method {}",
                          scene.scene.path(), method, other));
}

}  // namespace

std::unique_ptr<CullingMethod> culling_method(const LoadedScene& scene, const std::string& name) {
  if (name == "certified" && !scene.groups.has_certified()) refuse(scene, "certified", "thesis");
  if (name == "thesis" && !has_thesis(scene)) refuse(scene, "thesis", "certified");
  if (name != "thesis" && scene.groups.has_certified())
    return std::make_unique<CertifiedCulling>(scene.groups.certified);
  return std::make_unique<ThesisCulling>(scene.groups);
}

std::vector<std::unique_ptr<CullingMethod>> culling_methods(const LoadedScene& scene) {
  std::vector<std::unique_ptr<CullingMethod>> methods;
  if (has_thesis(scene)) methods.push_back(std::make_unique<ThesisCulling>(scene.groups));
  if (scene.groups.has_certified())
    methods.push_back(std::make_unique<CertifiedCulling>(scene.groups.certified));
  return methods;
}

}  // namespace scarp
