#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/serve/json_schema.h"
#include "tests/cli/served_terrain.h"
#include "tests/support/run_scarp.h"

/// Against what others wrote: the standard's schemas, and our own manual.
namespace scarp {
namespace {

using nlohmann::json;
using test::TempFolder;
using test::TestServer;

/// What is wrong with a value by a schema with $ref and allOf, or nothing.
std::optional<std::string> fault_by(const json& document, const json& schema, const json& value,
                                    const std::string& place, int depth = 0) {
  if (depth > 12 || !schema.is_object()) return {};
  const auto again = [&](const json& other, const json& part, const std::string& where) {
    return fault_by(document, other, part, where, depth + 1);
  };
  if (schema.contains("$ref"))
    return again(document.at(json::json_pointer(schema["$ref"].get<std::string>().substr(1))),
                 value, place);
  for (const json& part : schema.value("allOf", json::array()))
    if (auto fault = again(part, value, place)) return fault;
  for (const char* choice : {"oneOf", "anyOf"}) {
    if (!schema.contains(choice)) continue;
    std::optional<std::string> why;
    bool fits = false;
    for (const json& part : schema[choice]) {
      why = again(part, value, place);
      fits |= !why;
      if (fits) break;
    }
    if (!fits) return why;
  }
  if (value.is_object()) {
    for (const auto& [name, member] : value.items()) {
      const json& properties = schema.value("properties", json::object());
      const json more = schema.value("additionalProperties", json::object());
      if (properties.contains(name)) {
        if (auto fault = again(properties[name], member, place + "." + name)) return fault;
      } else if (auto fault = again(more, member, place + "." + name)) {
        return fault;
      }
    }
  }
  if (value.is_array())
    for (const json& item : value)
      if (auto fault = again(schema.value("items", json::object()), item, place + "[]"))
        return fault;
  json shallow = schema;
  for (const char* done :
       {"allOf", "oneOf", "anyOf", "properties", "items", "additionalProperties"})
    shallow.erase(done);
  return schema_fault(shallow, value, place);
}

TEST(ServeStandard, AnswersAreWhatTheStandardSays) {
  const char* data = std::getenv("SCARP_SHARED_DATA");
  const std::filesystem::path folder =
      data ? std::filesystem::path(data).parent_path()
           : std::filesystem::path(SCARP_SOURCE_DIR).parent_path() / "shared";
  const auto path = folder / "schemas/ogcapi-processes/ogcapi-processes.bundled.json";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "left out, not found: " << path;
  json standard = json::parse(std::ifstream(path));
  // In this bundle two schemas of one name have become one, that of features; an input's own may be
  // any JSON Schema.
  standard["components"]["schemas"]["schema"] = {{"type", "object"}};
  const TestServer server;
  const auto expect_fits = [&](const std::string& name, const json& value) {
    const auto fault = fault_by(standard, standard["components"]["schemas"].at(name), value, name);
    EXPECT_FALSE(fault) << *fault << "\n" << value.dump(1);
  };
  const auto get = [&](const std::string& target) {
    return json::parse(server.get(target, "Accept: application/json\r\n").body);
  };
  expect_fits("landingPage", get("/"));
  expect_fits("confClasses", get("/conformance"));
  expect_fits("processList", get("/processes"));
  const json processes = get("/processes");
  EXPECT_EQ(processes["processes"].size(), 5U);
  for (const json& process : processes["processes"])
    expect_fits("process", get("/processes/" + process["id"].get<std::string>()));
  expect_fits("exception", get("/processes/none"));
  expect_fits("exception", get("/nothing"));
  const auto begun = server.post("/processes/echo/execution", R"({"inputs":{"message":"hello"}})",
                                 "Prefer: respond-async\r\n");
  ASSERT_EQ(begun.status, 201);
  expect_fits("statusInfo", json::parse(begun.body));
  expect_fits("jobList", get("/jobs"));
  // The check can fail.
  EXPECT_TRUE(fault_by(standard, standard["components"]["schemas"]["statusInfo"],
                       {{"status", "confused"}}, ""));
}

/// Commands of docs/server.md: lines of its shell blocks, joined where they end in a backslash.
std::vector<std::string> examples_of_manual() {
  std::vector<std::string> commands;
  std::ifstream manual(SCARP_SOURCE_DIR "/docs/server.md");
  bool in_block = false, goes_on = false;
  for (std::string line; std::getline(manual, line);) {
    if (line.starts_with("```")) {
      in_block = line == "```sh";
      continue;
    }
    if (!in_block || (!goes_on && !line.starts_with("curl "))) continue;
    const bool next_goes_on = line.ends_with('\\');
    if (next_goes_on) line.pop_back();
    if (goes_on)
      commands.back() += line;
    else
      commands.push_back(line);
    goes_on = next_goes_on;
  }
  return commands;
}

TEST(ServeStandard, ExamplesOfTheManualWork) {
  if (std::system("command -v curl >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "left out, curl is not installed";
  const std::vector<std::string> commands = examples_of_manual();
  ASSERT_GE(commands.size(), 10U);
  const TestServer server;
  const TempFolder folder;
  for (std::string command : commands) {
    const std::string typed = "http://127.0.0.1:8080";
    const std::string own = "http://127.0.0.1:" + std::to_string(server.port());
    for (std::size_t at; (at = command.find(typed)) != std::string::npos;)
      command.replace(at, typed.size(), own);
    const auto run = test::run_scarp("cd '" + folder.folder().string() +
                                     "' && curl --fail-with-body -sS -m 20" + command.substr(4));
    EXPECT_EQ(run.exit_code, 0) << command << "\n" << run.output << run.errors;
  }
}

}  // namespace
}  // namespace scarp
