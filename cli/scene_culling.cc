#include "cli/scene_culling.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/culling/certified_culling.h"
#include "core/culling/visible_groups.h"
#include "core/error/error.h"
#include "tiles/store/groups_file.h"

namespace scarp {
namespace {

[[noreturn]] void refuse(const Scene& scene, const char* method, const char* other) {
  throw Error(ErrorCode::kInput,
              fmt::format("'{}': the scene was built without what --method {} needs; build it "
                          "with --horizon both, or give --method {}",
                          scene.path(), method, other));
}

}  // namespace

bool has_horizons(const Scene& scene) {
  const auto& tiles = scene.description().tiles;
  return std::any_of(tiles.begin(), tiles.end(), [&](const SceneTile& tile) {
    return scene.find(tile.id, "horizon") != nullptr;
  });
}

std::unique_ptr<CullingMethod> culling_method(const Scene& scene, const Groups& groups,
                                              const std::string& name) {
  if (name == "certified" && !groups.has_certified()) refuse(scene, "certified", "thesis");
  if (name == "thesis" && !has_horizons(scene)) refuse(scene, "thesis", "certified");
  if (name != "thesis" && groups.has_certified())
    return std::make_unique<CertifiedCulling>(groups.certified);
  return std::make_unique<ThesisCulling>(groups);
}

std::unique_ptr<CullingMethod> culling_method(const LoadedScene& scene, const std::string& name) {
  return culling_method(scene.scene, scene.groups, name);
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
  if (method == "certified") return kept_bytes(groups.certified);
  const Regions& regions = groups.regions;
  return regions.first.size() * sizeof(std::uint32_t) +
         regions.points.size() * sizeof(RegionPoint) + regions.end_slope.size() * sizeof(double);
}

}  // namespace scarp
