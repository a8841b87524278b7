#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "cli/serve/map_tiles.h"
#include "cli/serve/problem.h"
#include "cli/serve/process.h"
#include "cli/serve/request_target.h"
#include "cli/serve/seen_views.h"
#include "cli/temp_file.h"
#include "core/error/error.h"
#include "tiles/layers/geopackage.h"

namespace scarp {
namespace {

using nlohmann::json;

constexpr char kTiff[] = "image/tiff; application=geotiff; profile=cloud-optimized";

/// The inputs as the query of GET /scenes/{name}/viewshed.png and the like.
std::string query_of(const json& inputs) {
  std::string query;
  const auto add = [&](const std::string& name, const std::string& value) {
    query += fmt::format("{}{}={}", query.empty() ? "?" : "&", name, encode_segment(value));
  };
  const auto text_of = [](const json& value) {
    if (value.is_string()) return value.get<std::string>();
    if (!value.is_array()) return value.dump();
    std::string text;
    for (const json& item : value) text += (text.empty() ? "" : ",") + item.dump();
    return text;
  };
  for (const json& observer : inputs["observers"]) add("observer", text_of(observer));
  for (const auto& [name, value] : inputs.items())
    if (name != "observers" && name != "scene") add(name, text_of(value));
  return query;
}

HttpResponse as_picture(const SeenView& view) {
  const auto begun = std::chrono::steady_clock::now();
  const SeenPicture picture = seen_picture(*view.scene, *view.raster);
  const double picture_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
  HttpResponse response = text_response(200, "image/png", picture.png);
  const auto& b = picture.bounds_deg;
  response.set("X-Scarp-Bounds",
               fmt::format("{:.9f},{:.9f},{:.9f},{:.9f}", b[0], b[1], b[2], b[3]));
  response.set("X-Scarp-Visible-Cells", std::to_string(view.seen));
  response.set("X-Scarp-Known-Cells", std::to_string(view.known));
  response.set("Server-Timing",
               fmt::format("see;dur={:.1f}, picture;dur={:.1f}", view.see_ms, picture_ms));
  return response;
}

HttpResponse as_raster(const SeenView& view) {
  const TempFile file(".tif");
  view.raster->write(file.path(), false, Existing::kReplace);
  HttpResponse response = text_response(200, kTiff, file.read());
  response.set("Content-Disposition", fmt::format("attachment; filename=\"{}_viewshed.tif\"",
                                                  encode_segment(view.scene->name())));
  return response;
}

HttpResponse as_polygons(const SeenView& view) {
  if (view.options.mode == ViewshedMode::kGround || view.options.mode == ViewshedMode::kDem)
    throw Refusal(400, "inputs.mode: outlines are of modes visible and count; ask for image/tiff");
  return text_response(200, "application/geo+json",
                       area_polygons_geojson(view.raster->areas(), view.raster->areas_field()));
}

HttpResponse as_document(const SeenView& view, const json& inputs, const std::string& origin) {
  const SampleWindow& window = view.raster->window();
  const Dem& dem = view.scene->source().dem();
  json document = view.summary;
  document["scene"] = view.scene->name();
  document["visible_cells"] = view.seen;
  document["known_cells"] = view.known;
  document["cell_m"] = view.scene->cell_m();
  document["window"] = {{"first_column", window.first_column},
                        {"first_row", window.first_row},
                        {"last_column", window.last_column},
                        {"last_row", window.last_row}};
  std::array<double, 4> bounds = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const double c : {window.first_column - 0.5, window.last_column + 0.5}) {
    for (const double r : {window.first_row - 0.5, window.last_row + 0.5}) {
      const auto at = view.scene->lon_lat_of(dem.x_of(c), dem.y_of(r));
      if (!at) continue;
      bounds = {std::min(bounds[0], at->longitude_deg), std::min(bounds[1], at->latitude_deg),
                std::max(bounds[2], at->longitude_deg), std::max(bounds[3], at->latitude_deg)};
    }
  }
  document["bounds"] = bounds;
  json eyes = json::array();
  for (const RunEye& eye : view.raster->eyes()) {
    const auto at = view.scene->lon_lat_of(eye.at.map.x, eye.at.map.y);
    eyes.push_back({{"lon", at ? json(at->longitude_deg) : json()},
                    {"lat", at ? json(at->latitude_deg) : json()},
                    {"height_m", eye.at.map.height_m},
                    {"ground_m", eye.at.ground_m ? json(*eye.at.ground_m) : json()}});
  }
  document["observers"] = eyes;
  const std::string place = origin + "/scenes/" + encode_segment(view.scene->name()) + "/viewshed";
  const std::string query = query_of(inputs);
  document["href"] = place + ".tif" + query;
  document["links"] = {
      {{"rel", "alternate"}, {"type", "image/tiff"}, {"href", place + ".tif" + query}},
      {{"rel", "alternate"}, {"type", "image/png"}, {"href", place + ".png" + query}},
      {{"rel", "alternate"},
       {"type", "application/geo+json"},
       {"href", place + ".geojson" + query}}};
  return json_response(document);
}

}  // namespace

Process viewshed_process(const ServedScenes& scenes, const ServeLimits& limits) {
  constexpr int kMostObservers = 32;
  Process process;
  process.id = "viewshed";
  process.title = "Viewshed";
  process.description =
      "What eyes see of the ground: exactly what scarp viewshed writes. As a picture in web "
      "mercator, a cloud-optimised GeoTIFF in the CRS of the data, outlines, or numbers.";
  json& in = process.inputs;
  in["scene"] = input("Scene", "Name of a scene that is served", scene_schema(scenes), true);
  in["observers"] =
      input("Observers",
            "Eyes: LON,LAT[,H] in OGC:CRS84, H metres above ground, 2 unless given, or 1200asl",
            {{"type", "array"},
             {"items", position_schema()},
             {"minItems", 1},
             {"maxItems", kMostObservers}},
            true);
  in["target_height_m"] = input("Target height", "Of what is looked for, above ground, metres",
                                number_schema(0, 100'000), false);
  in["max_distance_m"] = input("Greatest distance", "Along the ground, metres",
                               number_schema(1, limits.max_distance_m), false);
  in["min_distance_m"] = input("Least distance", "Along the ground, metres",
                               number_schema(0, limits.max_distance_m), false);
  in["azimuth"] =
      input("Azimuths", "From, to, degrees clockwise from north", range_schema(-720, 720), false);
  in["pitch"] =
      input("Pitch", "Lowest, highest, degrees above level", range_schema(-90, 90), false);
  in["refraction"] = input("Refraction", "Coefficient, 0 to 1: 0.13 light, 0.25 radio",
                           refraction_schema(), false);
  in["mode"] =
      input("Mode",
            "visible: seen by any eye; count: by how many; ground, dem: least height above "
            "ground, above the datum, at which a target is seen",
            {{"type", "string"}, {"enum", {"visible", "count", "ground", "dem"}}}, false);
  in["accuracy"] =
      input("Accuracy",
            "exact, unless given; high: errs seldom and little; fast: for a first look. Of a scene "
            "high and fast take its heights as a raster, which is many times faster",
            {{"type", "string"}, {"enum", {"exact", "high", "fast"}}}, false);
  process.output = "viewshed";
  process.output_schema = {{"type", "object"},
                           {"required", {"visible_cells", "known_cells", "bounds", "href"}},
                           {"properties",
                            {{"visible_cells", {{"type", "integer"}}},
                             {"known_cells", {{"type", "integer"}}},
                             {"bounds", {{"type", "array"}, {"items", {{"type", "number"}}}}},
                             {"href", {{"type", "string"}}}}}};
  process.formats = {"application/json", "image/png", kTiff, "application/geo+json"};
  process.run = [&scenes](const json& inputs, const std::string& format, ProcessContext& context) {
    const auto view = context.views.look(scenes, inputs, context.progress);
    HttpResponse response;
    if (format == "image/png")
      response = as_picture(*view);
    else if (format == kTiff)
      response = as_raster(*view);
    else if (format == "application/geo+json")
      response = as_polygons(*view);
    else
      response = as_document(*view, inputs, context.origin);
    require_not_stopped();
    return response;
  };
  return process;
}

}  // namespace scarp
