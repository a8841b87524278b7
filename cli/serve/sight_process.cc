#include "cli/serve/process.h"
#include "cli/serve/seen_views.h"
#include "cli/sight_line.h"
#include "cli/sight_surface.h"

namespace scarp {
namespace {

using nlohmann::json;

json or_null(const std::optional<double>& value) {
  return value ? json(*value) : json();
}

json place_of(const ServedScene& scene, const MapPoint& at) {
  const auto lon_lat = scene.lon_lat_of(at.x, at.y);
  return {{"lon", lon_lat ? json(lon_lat->longitude_deg) : json()},
          {"lat", lon_lat ? json(lon_lat->latitude_deg) : json()},
          {"height_m", at.height_m}};
}

/// Ends and crossings: distance, height of the ground, height of the line.
json profile_of(const SightSurface& surface, const SightLine& line) {
  const GeoFrame::Placer placer(surface.frame());
  json profile = json::array();
  profile.push_back({0, or_null(line.from.ground_m), line.from.map.height_m});
  for (std::size_t i = 0; i < line.profile.size(); ++i) {
    const ProfilePoint& point = line.profile[i];
    // A gap in the ground is a point without ground.
    if (point.void_before)
      profile.push_back({point.distance_m, nullptr, placer.unplace(point.line).height_m});
    profile.push_back(
        {point.distance_m, line.ground[i].height_m, placer.unplace(point.line).height_m});
  }
  if (line.void_at_end) profile.push_back({line.distance_m, nullptr, line.to.map.height_m});
  profile.push_back({line.distance_m, or_null(line.to.ground_m), line.to.map.height_m});
  return profile;
}

json result_of(const ServedScene& scene, const SightSurface& surface, const SightLine& line,
               std::optional<double> frequency_hz) {
  const auto least = line.least_clear();
  json result = {{"visible", line.sight == Sight::kVisible},
                 {"sight", word_of(line.sight)},
                 {"distance_m", line.distance_m},
                 {"azimuth_deg", line.azimuth_deg},
                 {"clearance_m", least ? json(line.profile[*least].clearance_m) : json()},
                 {"clearance_at_m", least ? json(line.profile[*least].distance_m) : json()},
                 {"from", place_of(scene, line.from.map)},
                 {"to", place_of(scene, line.to.map)},
                 {"blocker", nullptr},
                 {"least_eye_height_m", or_null(line.least_from_m)},
                 {"least_target_height_m", or_null(line.least_to_m)}};
  result["from"]["ground_m"] = or_null(line.from.ground_m);
  result["to"]["ground_m"] = or_null(line.to.ground_m);
  if (line.blocker) {
    result["blocker"] = place_of(scene, line.blocker->map);
    result["blocker"]["distance_m"] = line.blocker->distance_m;
    result["blocker"]["above_line_m"] = -line.blocker->clearance_m;
  }
  if (frequency_hz) {
    const auto ratio = line.least_ratio();
    result["fresnel"] = {
        {"frequency_hz", *frequency_hz},
        {"least_ratio", ratio ? json(line.profile[*ratio].fresnel_ratio()) : json()},
        {"distance_m", ratio ? json(line.profile[*ratio].distance_m) : json()},
        {"radius_m", ratio ? json(line.profile[*ratio].fresnel_radius_m) : json()}};
  }
  result["profile"] = profile_of(surface, line);
  return result;
}

}  // namespace

Process line_of_sight_process(const ServedScenes& scenes) {
  Process process;
  process.id = "line-of-sight";
  process.title = "Line of sight";
  process.description =
      "One sight line, as scarp sight has it: whether it is free, what blocks it first, its "
      "profile, and how high its ends would have to be.";
  json& in = process.inputs;
  in["scene"] = input("Scene", "Name of a scene that is served", scene_schema(scenes), true);
  in["from"] = input("Eye", "LON,LAT[,H] in OGC:CRS84", position_schema(), true);
  in["to"] = input("Target", "LON,LAT[,H] in OGC:CRS84", position_schema(), true);
  in["refraction"] = input("Refraction", "Coefficient, 0 to 1", refraction_schema(), false);
  in["frequency_hz"] =
      input("Frequency", "For the first Fresnel zone, hertz", number_schema(1e3, 1e15), false);
  process.output = "line";
  const json number_or_null = {{"type", "number"}, {"nullable", true}};
  process.output_schema = {
      {"type", "object"},
      {"required", {"visible", "distance_m", "clearance_m", "blocker", "profile"}},
      {"properties",
       {{"visible", {{"type", "boolean"}}},
        {"distance_m", {{"type", "number"}}},
        {"clearance_m", number_or_null},
        {"blocker", {{"type", "object"}, {"nullable", true}}},
        {"profile", {{"type", "array"}, {"items", {{"type", "array"}, {"items", number_or_null}}}}},
        {"least_eye_height_m", number_or_null},
        {"least_target_height_m", number_or_null}}}};
  process.formats = {"application/json"};
  process.run = [&scenes](const json& inputs, const std::string&, ProcessContext&) {
    const ServedScene& scene = scenes.require(inputs["scene"].get<std::string>());
    std::optional<double> refraction, frequency_hz;
    if (inputs.contains("refraction")) refraction = inputs["refraction"].get<double>();
    if (inputs.contains("frequency_hz")) frequency_hz = inputs["frequency_hz"].get<double>();
    const auto surface = surface_over(scene.source(refraction));
    const TypedPosition from = position_of(inputs["from"]), to = position_of(inputs["to"]);
    const SightLine line = measure_sight(
        *surface, surface->place(scene.in_data(from), std::string()),
        surface->place(scene.in_data(to), std::string()), frequency_hz, from.text, to.text);
    require_not_stopped();
    return json_response(result_of(scene, *surface, line, frequency_hz));
  };
  return process;
}

}  // namespace scarp
