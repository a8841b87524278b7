#include <cmath>
#include <stdexcept>
#include <string>

#include "cli/serve/json_schema.h"
#include "cli/serve/process.h"
#include "core/error/error.h"
#include "tests/fuzz/fuzz_target.h"

/// Bodies of executions, and positions in them: any bytes are refused with an Error or give inputs
/// that the schemas promise.
namespace scarp {
namespace {

void check_positions(const nlohmann::json& inputs) {
  for (const auto& [name, value] : inputs.items()) {
    const bool is_list = name == "observers";
    if (!is_list && name != "from" && name != "to" && name != "at" && name != "camera") continue;
    for (const nlohmann::json& one : is_list ? value : nlohmann::json::array({value})) {
      const TypedPosition position = position_of(one);
      if (!(std::abs(position.x) <= 360 && std::abs(position.y) <= 90 &&
            std::isfinite(position.height_m)))
        throw std::logic_error("a position off the Earth");
    }
  }
}

const std::vector<Process>& processes() {
  static const ServedScenes kNone({}, {});
  static const ServeLimits kLimits;
  static const std::vector<Process> kAll = all_processes(kNone, kLimits);
  return kAll;
}

void take(const std::string& text) {
  try {
    const nlohmann::json body = parse_json(text);
    if (!body.is_object() || !body.contains("inputs")) return;
    for (const Process& process : processes()) {
      if (process.id == "echo") continue;  // promises nothing
      nlohmann::json schema = process.inputs_schema();
      // Any scene: none is served.
      if (schema["properties"].contains("scene")) schema["properties"]["scene"].erase("enum");
      if (schema_fault(schema, body["inputs"], "inputs")) continue;
      check_positions(body["inputs"]);
      if (process.id == "viewshed" && body["inputs"]["observers"].size() > 32)
        throw std::logic_error("more observers than allowed");
    }
  } catch (const Error&) {
    // refused
  }
}

}  // namespace
}  // namespace scarp

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  scarp::take(text);
  for (const scarp::Process& process : scarp::processes())
    for (const auto& input : process.inputs.items())
      scarp::value_of_text(input.value()["schema"], text);
  try {
    scarp::position_of(text);
  } catch (const scarp::Error&) {
    // refused
  }
  return 0;
}

std::vector<std::vector<std::uint8_t>> fuzz_seeds() {
  std::vector<std::vector<std::uint8_t>> seeds;
  for (
      const std::string text :
      {R"({"inputs":{"scene":"alps","observers":["8.65,46.55,2",[8.6,46.5,1200]],"max_distance_m":15000,"azimuth":[300,60],"pitch":[-90,90],"mode":"count","refraction":0.13}})",
       R"({"inputs":{"scene":"alps","from":"8.65,46.55","to":"8.7,46.6,1200asl","frequency_hz":5.8e9}})",
       R"({"inputs":{"scene":"a","at":[1,2],"azimuths":360}})",
       R"({"inputs":{"scene":"a","camera":"1,2,3","heading_deg":-90}})", "8.65,46.55,1200asl",
       "-1.5e2,+3", R"({"inputs":{"x":[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]}})",
       R"("é \" 😀")", "[1e308,1e309,-0,NaN]"})
    seeds.emplace_back(text.begin(), text.end());
  return seeds;
}
