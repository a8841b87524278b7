#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/culling_source.h"
#include "core/error/error.h"
#include "ingest/observers/observers.h"
#include "tiles/runtime/scarp_runtime.h"

namespace scarp {
namespace {

/// An entity's box in the frame, or none where it is not known how high it stands.
runtime::Box box_of(const ObserverRecord& entity, const CullOptions& options,
                    const LoadedScene& scene, const GeoFrame::Placer& placer,
                    const runtime::Culling& culling) {
  const double radius_m = entity.max_distance_m.value_or(options.entity_radius_m);
  MapPoint top{entity.x, entity.y, 0};
  if (entity.elevation_m) {
    top.height_m = *entity.elevation_m;
  } else {
    const auto ground_m = ground_height_m(placer, scene.index, entity.x, entity.y);
    if (!ground_m) return {};
    top.height_m = *ground_m + entity.height_m.value_or(options.entity_height_m);
  }
  const Position p = placer.place(top);
  // The plane stretches away from the centre by the square of the tangent, along and across; what
  // stands leans by less than 0.02; over a kilometre the Earth falls by 0.1 m.
  const double scale_m = scene.frame.earth_frame() ? scene.frame.earth_frame()->frame.scale_m() : 0;
  const double square = scale_m > 0 ? (p.x_m * p.x_m + p.y_m * p.y_m) / (scale_m * scale_m) : 0;
  const double half_m = radius_m * (1.01 + 2 * square) +
                        0.02 * std::abs(entity.height_m.value_or(options.entity_height_m));
  const double fall_m = scale_m > 0 ? half_m * 0.02 + half_m * half_m / kEarthRadiusM : 0;
  return culling.box_in_frame(p.x_m - half_m, p.y_m - half_m, p.x_m + half_m, p.y_m + half_m,
                              p.z_m + fall_m);
}

/// A text as CSV has it.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

}  // namespace

int run_cull_entities(const CullOptions& options) {
  const LoadedScene scene(options.scene, {options.common.memory_budget_bytes});
  const auto entities =
      read_observers(options.entities_file, scene.scene.description().crs_wkt, options.crs);
  const MapPoint at = resolve(options.camera, options.crs, scene.frame, scene.index);
  const GeoFrame::Placer placer(scene.frame);
  const Position eye = placer.place(at);
  const std::vector<std::byte> file = culling_file(culling_source(scene));
  runtime::Culling culling;
  if (culling.open(file.data(), file.size(), runtime::Check::kStructure) != runtime::Status::kOk)
    throw Error(ErrorCode::kCorrupt, fmt::format("'{}': its groups cannot be put together; build "
                                                 "the scene again",
                                                 options.scene));
  const double within_m = options.within_m;
  const runtime::Box cell =
      culling.box_in_frame(eye.x_m - within_m, eye.y_m - within_m, eye.x_m + within_m,
                           eye.y_m + within_m, eye.z_m + within_m);
  std::vector<bool> may_be_seen;
  for (const ObserverRecord& entity : entities)
    may_be_seen.push_back(
        culling.box_visible(cell, box_of(entity, options, scene, placer, culling)));
  const auto seen = std::count(may_be_seen.begin(), may_be_seen.end(), true);

  if (options.common.json) {
    nlohmann::json answers = nlohmann::json::array();
    for (std::size_t i = 0; i < entities.size(); ++i)
      answers.push_back({{"name", entities[i].name},
                         {"x", entities[i].x},
                         {"y", entities[i].y},
                         {"may_be_seen", static_cast<bool>(may_be_seen[i])}});
    const nlohmann::json result = {
        {"camera", {{"x", at.x}, {"y", at.y}, {"height_m", at.height_m}}},
        {"within_m", within_m},
        {"entities", entities.size()},
        {"may_be_seen", seen},
        {"hidden", static_cast<std::int64_t>(entities.size()) - seen},
        {"answers", answers}};
    fmt::print("{}\n", result.dump(2));
    return 0;
  }
  fmt::print("name,x,y,may_be_seen\n");
  for (std::size_t i = 0; i < entities.size(); ++i)
    fmt::print("{},{:.12g},{:.12g},{}\n", quoted(entities[i].name), entities[i].x, entities[i].y,
               may_be_seen[i] ? 1 : 0);
  return 0;
}

}  // namespace scarp
