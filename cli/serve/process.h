#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/serve/http.h"
#include "cli/serve/served_scenes.h"
#include "core/threads/progress.h"
#include "core/threads/stop.h"

namespace scarp {

class SeenViews;

/// What a process has at hand while it runs.
struct ProcessContext {
  const ServedScenes& scenes;
  const ServeLimits& limits;
  SeenViews& views;
  Progress progress;   ///< may be empty
  std::string origin;  ///< of links, such as "http://localhost:8080"; empty: links without it
};

/// A process of OGC API - Processes: a function with a name from inputs, checked by the schemas
/// that it publishes, to one output in one of several formats.
struct Process {
  std::string id, title, description;
  nlohmann::json inputs;             ///< name -> {"title", "schema", "required"}
  std::string output;                ///< name of the output
  nlohmann::json output_schema;      ///< of the first format
  std::vector<std::string> formats;  ///< media types, the one taken unless asked for first

  /// Inputs that the schemas find nothing wrong with. Called within the StopScope of the request;
  /// throws Refusal or Error.
  std::function<HttpResponse(const nlohmann::json& inputs, const std::string& format,
                             ProcessContext& context)>
      run;

  /// The schema of all inputs as one object.
  nlohmann::json inputs_schema() const;
};

/// @param limits  become part of the schemas
std::vector<Process> all_processes(const ServedScenes& scenes, const ServeLimits& limits);

Process viewshed_process(const ServedScenes& scenes, const ServeLimits& limits);
Process line_of_sight_process(const ServedScenes& scenes);
Process horizon_process(const ServedScenes& scenes);
Process cull_process(const ServedScenes& scenes);
Process echo_process();

/// Schemas of inputs that several processes have.
nlohmann::json scene_schema(const ServedScenes& scenes);
nlohmann::json position_schema();
nlohmann::json refraction_schema();
nlohmann::json number_schema(double least, double most);
nlohmann::json range_schema(double least, double most);
/// {"title", "description", "schema", "required"}
nlohmann::json input(const char* title, const char* description, nlohmann::json schema,
                     bool is_required);

/// A position of the inputs in lon, lat: "LON,LAT[,H]" or [lon, lat] or [lon, lat, height].
/// Throws Refusal{400}.
TypedPosition position_of(const nlohmann::json& input);

HttpResponse json_response(const nlohmann::json& json, int status = 200,
                           const char* content_type = "application/json");

}  // namespace scarp
