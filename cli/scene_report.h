#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tiles/store/scene.h"

namespace scarp {

/// What report.json of a scene says of the errors of its meshes.
class SceneReport {
 public:
  /// Throws Error{kCorrupt} where there is none, or it says nothing of errors.
  explicit SceneReport(const Scene& scene);

  /// Greatest vertical distance of the finest level from the source, measured over all of the
  /// surface, metres in the frame.
  double mesh_error_m() const { return mesh_error_m_; }

  /// The unit that heights of the source were read in: m, ft or us-ft; nothing where it is not
  /// told.
  std::optional<std::string> height_unit() const;

  /// How far each level may lie from the source, from the root on, metres in the frame. A level is
  /// never better than a finer one; one without ground (near the root of long rasters) counts as
  /// twice the next finer.
  std::vector<double> level_errors_m(std::int32_t finest_level) const;

 private:
  [[noreturn]] void refuse(const std::string& reason) const;

  std::string path_;
  nlohmann::json report_;
  double mesh_error_m_ = 0;
};

}  // namespace scarp
