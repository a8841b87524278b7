#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/progress_bar.h"
#include "core/occlusion/group_tree.h"
#include "tiles/store/scene.h"

namespace scarp {

int run_check(const CheckOptions& options) {
  ProgressBar bar(!options.common.json);
  const std::vector<SceneFinding> findings =
      check_scene(options.scene, check_groups, bar.stage("check"));
  bar.clear();
  std::size_t faults = 0;
  nlohmann::json result = nlohmann::json::array();
  for (const SceneFinding& finding : findings) {
    faults += finding.is_fault;
    result.push_back({{"fault", finding.is_fault}, {"message", finding.message}});
    if (!options.common.json)
      fmt::print("{}: {}\n", finding.is_fault ? "fault" : "note", finding.message);
  }
  if (options.common.json)
    fmt::print("{}\n", result.dump(2));
  else if (faults == 0)
    fmt::print("{}: sound\n", options.scene);
  return faults == 0 ? 0 : 1;
}

}  // namespace scarp
