#include "cli/serve/served_scenes.h"

#include <fmt/format.h>

#include <filesystem>

#include "cli/serve/problem.h"
#include "cli/serve/request_target.h"

namespace scarp {
namespace {

std::string name_of(const std::string& source) {
  std::filesystem::path path(source);
  if (path.filename().empty()) path = path.parent_path();
  const std::string name = path.stem().string();
  bool fits = !name.empty() && is_utf8(name) && name != "." && name != "..";
  for (const char c : name)
    if (static_cast<unsigned char>(c) < ' ' || c == '/' || c == '\\') fits = false;
  if (!fits)
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': has no name that an address can hold; rename it", source));
  return name;
}

}  // namespace

ServedScenes::ServedScenes(const std::vector<std::string>& sources, const DemOptions& dem) {
  for (const std::string& source : sources) {
    const std::string name = name_of(source);
    if (find(name) != nullptr)
      throw Error(
          ErrorCode::kUsage,
          fmt::format("'{}': a scene named '{}' is served already, '{}'; rename one of them",
                      source, name, find(name)->path()));
    scenes_.push_back(std::make_unique<const ServedScene>(name, source, dem));
  }
}

const ServedScene* ServedScenes::find(const std::string& name) const {
  for (const auto& scene : scenes_)
    if (scene->name() == name) return scene.get();
  return nullptr;
}

const ServedScene& ServedScenes::require(const std::string& name) const {
  const ServedScene* scene = find(name);
  if (!scene)
    throw Refusal(404, fmt::format("scene '{}': is not served; one of {} was expected", name,
                                   fmt::join(names(), ", ")));
  return *scene;
}

std::vector<std::string> ServedScenes::names() const {
  std::vector<std::string> names;
  for (const auto& scene : scenes_) names.push_back(scene->name());
  return names;
}

}  // namespace scarp
