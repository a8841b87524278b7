#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/serve/served_scene.h"

namespace scarp {

/// All that a server shows, by name. Immutable once it is made.
class ServedScenes {
 public:
  /// Names are file names without ending. Throws as ServedScene, and kUsage where two share a name.
  ServedScenes(const std::vector<std::string>& sources, const DemOptions& dem);

  const std::vector<std::unique_ptr<const ServedScene>>& all() const { return scenes_; }
  /// Null where there is none.
  const ServedScene* find(const std::string& name) const;
  /// Throws Refusal{404} that names those that there are.
  const ServedScene& require(const std::string& name) const;
  std::vector<std::string> names() const;

 private:
  std::vector<std::unique_ptr<const ServedScene>> scenes_;
};

}  // namespace scarp
