#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/camera_culling.h"
#include "cli/commands.h"
#include "cli/scene_tiles.h"

namespace scarp {
namespace {

double seconds_now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

}  // namespace

int run_cull(const CullOptions& options) {
  if (!options.entities_file.empty()) return run_cull_entities(options);
  const double begun_s = seconds_now();
  SceneTiles tiles(options.scene);
  const double opened_s = seconds_now();
  const MapPoint at = tiles.resolve(options.camera, options.crs);
  const Camera camera =
      camera_at(tiles.frame(), at, options.azimuth_deg, options.field_of_view_deg);
  const CullCounts counts =
      cull_scene(tiles, camera, options.method, options.max_distance_m.value_or(HUGE_VAL));
  const double answered_s = seconds_now();

  if (options.common.json) {
    const nlohmann::json result = {
        {"method", counts.method},
        {"camera", {{"x", at.x}, {"y", at.y}, {"height_m", at.height_m}}},
        {"tiles", tiles.size()},
        {"tiles_read", tiles.tiles_read()},
        {"tiles_hidden", counts.tiles_hidden},
        {"files_read", tiles.files_read()},
        {"groups", counts.groups},
        {"visible_groups", counts.visible_groups},
        {"nodes_tested", counts.nodes_tested},
        {"triangles", counts.triangles},
        {"orphans", counts.orphans},
        {"drawn", counts.drawn},
        {"culled", counts.triangles - counts.drawn},
        {"open_s", opened_s - begun_s},
        {"answer_s", answered_s - opened_s}};
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("{} of {} groups may be visible; {} of {} triangles are culled ({:.1f} %)",
             counts.visible_groups.size(), counts.groups, counts.triangles - counts.drawn,
             counts.triangles,
             100.0 * static_cast<double>(counts.triangles - counts.drawn) /
                 static_cast<double>(std::max<std::uint64_t>(1, counts.triangles)));
  if (tiles.size() > 1)
    fmt::print("; {} of {} tiles read, {} hidden as a whole", tiles.tiles_read(), tiles.size(),
               counts.tiles_hidden);
  fmt::print("\n{}\n", fmt::join(counts.visible_groups, " "));
  return 0;
}

}  // namespace scarp
