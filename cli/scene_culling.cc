#include "cli/scene_culling.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/build/certified_settings.h"
#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"

namespace scarp {
namespace {

[[noreturn]] void refuse(const LoadedScene& scene, const char* method, const char* other) {
  throw Error(ErrorCode::kInput,
              fmt::format("'{}': the scene was built without what --method {} needs; build it "
                          "with --horizon both, or give --method {}",
                          scene.scene.path(), method, other));
}

}  // namespace

bool has_horizons(const LoadedScene& scene) {
  const auto& tiles = scene.scene.description().tiles;
  return std::any_of(tiles.begin(), tiles.end(), [&](const SceneTile& tile) {
    return scene.scene.find(tile.id, "horizon") != nullptr;
  });
}

std::unique_ptr<CullingMethod> culling_method(const LoadedScene& scene, const std::string& name) {
  if (name == "certified" && !scene.groups.has_certified()) refuse(scene, "certified", "thesis");
  if (name == "thesis" && !has_horizons(scene)) refuse(scene, "thesis", "certified");
  if (name != "thesis" && scene.groups.has_certified())
    return std::make_unique<CertifiedCulling>(scene.groups.certified);
  return std::make_unique<ThesisCulling>(scene.groups);
}

std::vector<std::unique_ptr<CullingMethod>> culling_methods(const Groups& groups,
                                                            bool has_horizons) {
  std::vector<std::unique_ptr<CullingMethod>> methods;
  if (has_horizons) methods.push_back(std::make_unique<ThesisCulling>(groups));
  if (groups.has_certified())
    methods.push_back(std::make_unique<CertifiedCulling>(groups.certified));
  return methods;
}

std::size_t region_bytes(const Groups& groups, const std::string& method) {
  if (method == "certified") return certified_bytes(groups.certified);
  const Regions& regions = groups.regions;
  return regions.first.size() * sizeof(std::uint32_t) +
         regions.points.size() * sizeof(RegionPoint) + regions.end_slope.size() * sizeof(double);
}

}  // namespace scarp
