#include <algorithm>
#include <cmath>

#include "cli/camera_culling.h"
#include "cli/serve/problem.h"
#include "cli/serve/process.h"
#include "cli/serve/seen_views.h"

namespace scarp {
namespace {

using nlohmann::json;

/// Numbers below `end` that are not in a sorted list.
std::vector<GroupIndex> others(const std::vector<GroupIndex>& sorted, std::uint64_t end) {
  std::vector<GroupIndex> rest;
  std::size_t next = 0;
  for (GroupIndex group = 0; group < end; ++group) {
    if (next < sorted.size() && sorted[next] == group)
      ++next;
    else
      rest.push_back(group);
  }
  return rest;
}

}  // namespace

Process cull_process(const ServedScenes& scenes) {
  Process process;
  process.id = "cull";
  process.title = "Culling";
  process.description =
      "Which groups of a scene a camera may see, as scarp cull has it. Groups that are hidden are "
      "hidden for certain.";
  json& in = process.inputs;
  in["scene"] = input("Scene", "Name of a scene (not of a DEM)", scene_schema(scenes), true);
  in["camera"] = input("Camera", "LON,LAT[,H] in OGC:CRS84", position_schema(), true);
  in["heading_deg"] = input("Heading", "Azimuth that it looks along; all around unless given",
                            number_schema(-720, 720), false);
  in["pitch_deg"] = input("Pitch", "Taken and not used: a group counts at every pitch",
                          number_schema(-90, 90), false);
  in["field_of_view_deg"] = input("Field of view", "Width of the view, degrees; 90 unless given",
                                  number_schema(1, 360), false);
  in["max_distance_m"] =
      input("Greatest distance", "Of groups, in the plane, metres", number_schema(1, 1e7), false);
  in["method"] = input("Method", "certified, or thesis, where the scene has it",
                       {{"type", "string"}, {"enum", {"certified", "thesis"}}}, false);
  process.output = "groups";
  const json count = {{"type", "integer"}};
  const json ids = {{"type", "array"}, {"items", count}};
  process.output_schema = {
      {"type", "object"},
      {"required", {"groups", "visible", "hidden", "triangles"}},
      {"properties",
       {{"groups",
         {{"type", "object"},
          {"properties",
           {{"total", count}, {"in_view", count}, {"visible", count}, {"hidden", count}}}}},
        {"visible", ids},
        {"hidden", ids},
        {"triangles", {{"type", "object"}}}}}};
  process.formats = {"application/json"};
  process.run = [&scenes](const json& inputs, const std::string&, ProcessContext&) {
    const ServedScene& scene = scenes.require(inputs["scene"].get<std::string>());
    if (!scene.is_scene())
      throw Refusal(400, "inputs.scene: '" + scene.name() +
                             "' is a DEM, which has no groups; a scene made by scarp build was "
                             "expected");
    // A copy reads tiles for itself: what was read is remembered.
    SceneTiles tiles(scene.path());
    const MapPoint at = tiles.resolve(scene.in_data(position_of(inputs["camera"])), std::string());
    std::optional<double> heading_deg;
    if (inputs.contains("heading_deg")) heading_deg = inputs["heading_deg"].get<double>();
    const double field_deg = inputs.value("field_of_view_deg", 90.0);
    const double distance_m = inputs.value("max_distance_m", HUGE_VAL);
    const std::string method = inputs.value("method", std::string());
    const Camera camera = camera_at(tiles.frame(), at, heading_deg, field_deg);
    CullCounts counts = cull_scene(tiles, camera, method, distance_m);
    require_not_stopped();
    std::vector<GroupIndex>& visible = counts.visible_groups;
    std::sort(visible.begin(), visible.end());
    const std::uint64_t total = scene.source().groups();
    const std::vector<GroupIndex> hidden = others(visible, std::max(total, counts.groups));
    return json_response({{"method", counts.method},
                          {"groups",
                           {{"total", std::max(total, counts.groups)},
                            {"in_view", counts.groups},
                            {"visible", visible.size()},
                            {"hidden", hidden.size()}}},
                          {"visible", visible},
                          {"hidden", hidden},
                          {"triangles",
                           {{"total", scene.source().triangles()},
                            {"in_view", counts.triangles},
                            {"drawn", counts.drawn},
                            {"culled", counts.triangles - counts.drawn}}}});
  };
  return process;
}

}  // namespace scarp
