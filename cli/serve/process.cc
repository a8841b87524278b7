#include "cli/serve/process.h"

#include <fmt/format.h>

#include <cmath>

#include "cli/serve/problem.h"

namespace scarp {

using nlohmann::json;

json Process::inputs_schema() const {
  json schema = {{"type", "object"},
                 {"properties", json::object()},
                 {"required", json::array()},
                 {"additionalProperties", false}};
  for (const auto& [name, own] : inputs.items()) {
    schema["properties"][name] = own["schema"];
    if (own.value("minOccurs", 0) > 0) schema["required"].push_back(name);
  }
  if (id == "echo") schema["additionalProperties"] = true;
  if (schema["required"].empty()) schema.erase("required");
  return schema;
}

std::vector<Process> all_processes(const ServedScenes& scenes, const ServeLimits& limits) {
  std::vector<Process> processes;
  processes.push_back(viewshed_process(scenes, limits));
  processes.push_back(line_of_sight_process(scenes));
  processes.push_back(horizon_process(scenes));
  processes.push_back(cull_process(scenes));
  processes.push_back(echo_process());
  return processes;
}

json input(const char* title, const char* description, json schema, bool is_required) {
  return {{"title", title},
          {"description", description},
          {"schema", std::move(schema)},
          {"minOccurs", is_required ? 1 : 0},
          {"maxOccurs", 1}};
}

json scene_schema(const ServedScenes& scenes) {
  return {{"type", "string"}, {"enum", scenes.names()}};
}

json number_schema(double least, double most) {
  return {{"type", "number"}, {"minimum", least}, {"maximum", most}};
}

json position_schema() {
  constexpr int kLongest = 100;
  return {
      {"oneOf",
       {{{"type", "string"}, {"minLength", 3}, {"maxLength", kLongest}},
        {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 2}, {"maxItems", 3}}}}};
}

json refraction_schema() {
  return number_schema(0, 1);
}

json range_schema(double least, double most) {
  return {
      {"type", "array"}, {"items", number_schema(least, most)}, {"minItems", 2}, {"maxItems", 2}};
}

TypedPosition position_of(const json& input) {
  TypedPosition position;
  if (input.is_string()) {
    position = parse_position(input.get<std::string>());
  } else {
    position.x = input.at(0).get<double>();
    position.y = input.at(1).get<double>();
    if (input.size() > 2) position.height_m = input.at(2).get<double>();
    position.text = fmt::format("{:.10g},{:.10g},{:g}", position.x, position.y, position.height_m);
  }
  constexpr double kMostHeightM = 1e6;
  if (!(std::abs(position.x) <= 360 && std::abs(position.y) <= 90))
    throw Refusal(400, fmt::format("position '{}': is no longitude and latitude; degrees were "
                                   "expected, in this order",
                                   position.text));
  if (!(std::abs(position.height_m) <= kMostHeightM))
    throw Refusal(400, fmt::format("position '{}': its height is beyond {:g} m", position.text,
                                   kMostHeightM));
  return position;
}

HttpResponse json_response(const json& value, int status, const char* content_type) {
  return text_response(status, content_type,
                       value.dump(-1, ' ', false, json::error_handler_t::replace) + "\n");
}

Process echo_process() {
  Process process;
  process.id = "echo";
  process.title = "Echo";
  process.description = "Gives back its inputs: for trying out clients.";
  process.inputs = json::object();
  process.inputs["message"] = input("Message", "Anything", json::object(), false);
  process.output = "echo";
  process.output_schema = {{"type", "object"}};
  process.formats = {"application/json"};
  process.run = [](const json& inputs, const std::string&, ProcessContext&) {
    return json_response(inputs);
  };
  return process;
}

}  // namespace scarp
