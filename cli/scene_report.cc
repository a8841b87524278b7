#include "cli/scene_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "core/error/error.h"

namespace scarp {

using nlohmann::json;

SceneReport::SceneReport(const Scene& scene) : path_(scene.path() + "/report.json") {
  try {
    report_ = json::parse(std::ifstream(path_));
    mesh_error_m_ = report_.at("mesh").at("error_over_surface_m").get<double>();
  } catch (const json::exception& e) {
    refuse(e.what());
  }
}

void SceneReport::refuse(const std::string& reason) const {
  throw Error(ErrorCode::kCorrupt,
              fmt::format("'{}': does not tell the errors of the scene's meshes ({}); build the "
                          "scene again",
                          path_, reason));
}

std::optional<std::string> SceneReport::height_unit() const {
  const json parameters = report_.value("parameters", json::object());
  if (!parameters.contains("height_unit") || !parameters["height_unit"].is_string()) return {};
  return parameters["height_unit"].get<std::string>();
}

std::vector<double> SceneReport::level_errors_m(std::int32_t finest_level) const {
  std::vector<double> errors_m(static_cast<std::size_t>(finest_level) + 1, 0);
  errors_m.back() = mesh_error_m_;
  try {
    for (const json& level : report_.value("levels", json::array()))
      if (level.at("triangles").get<std::uint64_t>() > 0)
        errors_m.at(level.at("level").get<std::size_t>()) =
            mesh_error_m_ + std::max(level.at("above_finest_m").get<double>(),
                                     level.at("below_finest_m").get<double>());
  } catch (const std::exception& e) {
    refuse(e.what());
  }
  for (std::size_t level = errors_m.size() - 1; level-- > 0;)
    errors_m[level] = errors_m[level] == 0 ? 2 * errors_m[level + 1]
                                           : std::max(errors_m[level], errors_m[level + 1]);
  return errors_m;
}

}  // namespace scarp
