#include <fmt/format.h>

#include <set>

#include "cli/serve/api.h"

namespace scarp {
namespace {

using nlohmann::json;

/// Parts of a path by their names, such as "{y}.png".
json path_parameters(const std::string& pattern) {
  json parameters = json::array();
  for (std::size_t begin = pattern.find('{'); begin != std::string::npos;
       begin = pattern.find('{', begin + 1)) {
    std::string name = pattern.substr(begin + 1, pattern.find('}', begin) - begin - 1);
    if (name == "+rest") name = "path";
    const bool is_number = name == "z" || name == "x" || name == "y";
    parameters.push_back({{"name", name},
                          {"in", "path"},
                          {"required", true},
                          {"schema", {{"type", is_number ? "integer" : "string"}}}});
  }
  return parameters;
}

std::string path_of(std::string pattern) {
  const std::size_t rest = pattern.find("{+rest}");
  if (rest != std::string::npos) pattern.replace(rest, 7, "{path}");
  return pattern;
}

json responses_of(const Route& route) {
  json responses = {{"default", {{"$ref", "#/components/responses/Problem"}}}};
  const char* status = "200";
  responses[status] = {{"description", route.summary},
                       {"content", {{route.produces, {{"schema", json::object()}}}}}};
  if (route.id == "execute")
    responses["201"] = {{"description", "A job was begun"},
                        {"headers", {{"Location", {{"schema", {{"type", "string"}}}}}}},
                        {"content", {{"application/json", {{"schema", json::object()}}}}}};
  return responses;
}

}  // namespace

json Api::openapi(const std::string& origin) const {
  json paths = json::object();
  for (const Route& route : routes_) {
    json operation = {{"operationId", route.id},
                      {"summary", route.summary},
                      {"responses", responses_of(route)},
                      {"parameters", path_parameters(route.pattern)}};
    for (const auto& [name, own] : route.parameters.items()) {
      json parameter = {{"name", name},
                        {"in", "query"},
                        {"description", own.value("description", "")},
                        {"required", own.value("required", false)},
                        {"schema", own["schema"]}};
      if (own["schema"].value("type", "") == "array")
        parameter["explode"] = own.value("explode", false);
      operation["parameters"].push_back(std::move(parameter));
    }
    if (operation["parameters"].empty()) operation.erase("parameters");
    if (route.id == "execute")
      operation["requestBody"] = {
          {"required", true},
          {"content",
           {{"application/json", {{"schema", {{"$ref", "#/components/schemas/Execute"}}}}}}}};
    std::string method = route.method;
    for (char& c : method) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    paths[path_of(route.pattern)][method] = std::move(operation);
  }
  json schemas = {{"Problem",
                   {{"type", "object"},
                    {"required", {"type", "title", "status"}},
                    {"properties",
                     {{"type", {{"type", "string"}}},
                      {"title", {{"type", "string"}}},
                      {"status", {{"type", "integer"}}},
                      {"detail", {{"type", "string"}}}}}}},
                  {"Execute",
                   {{"type", "object"},
                    {"properties",
                     {{"inputs", {{"oneOf", json::array()}}},
                      {"outputs", {{"type", "object"}}},
                      {"response", {{"type", "string"}, {"enum", {"raw", "document"}}}}}}}}};
  for (const Process& process : processes_) {
    schemas[process.id] = process.inputs_schema();
    schemas["Execute"]["properties"]["inputs"]["oneOf"].push_back(
        {{"$ref", "#/components/schemas/" + process.id}});
  }
  return {{"openapi", "3.0.3"},
          {"info",
           {{"title", "Scarp"},
            {"description", "What can be seen from where, on terrain"},
            {"version", SCARP_VERSION},
            {"license", {{"name", "see LICENSE"}}}}},
          {"servers", {{{"url", origin.empty() ? "/" : origin}}}},
          {"paths", std::move(paths)},
          {"components",
           {{"schemas", std::move(schemas)},
            {"responses",
             {{"Problem",
               {{"description", "What went wrong, RFC 7807"},
                {"content",
                 {{"application/problem+json",
                   {{"schema", {{"$ref", "#/components/schemas/Problem"}}}}}}}}}}}}}};
}

}  // namespace scarp
