#include "cli/serve/json_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "cli/serve/problem.h"
#include "cli/serve/request_target.h"

namespace scarp {
namespace {

using nlohmann::json;

/// Nested deeper than allowed? Looks at brackets outside of strings only.
bool is_too_deep(std::string_view text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepestJson) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

bool has_type(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "number") return value.is_number();
  if (type == "integer")
    return value.is_number_integer() ||
           (value.is_number() && std::floor(value.get<double>()) == value.get<double>());
  return true;
}

/// A value for a message, short.
std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  constexpr std::size_t kMost = 60;
  if (text.size() <= kMost) return text;
  std::size_t end = kMost;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

std::string fault(const std::string& place, const std::string& text) {
  return fmt::format("{}: {}", place.empty() ? "the value" : place, text);
}

std::size_t letters_in(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::optional<std::string> number_fault(const json& schema, const json& value,
                                        const std::string& place) {
  const auto number = value.get<double>();
  if (!std::isfinite(number)) return fault(place, "a finite number was expected");
  const auto limit = [&](const char* name) -> std::optional<double> {
    const auto found = schema.find(name);
    if (found == schema.end() || !found->is_number()) return {};
    return found->get<double>();
  };
  const auto least = limit("minimum"), most = limit("maximum"), above = limit("exclusiveMinimum");
  if (least && number < *least)
    return fault(place, fmt::format("{} is below the least allowed, {:g}", shown(value), *least));
  if (most && number > *most)
    return fault(place, fmt::format("{} is above the most allowed, {:g}", shown(value), *most));
  const bool open = schema.contains("exclusiveMinimum") && schema["exclusiveMinimum"] == true;
  if ((above && number <= *above) || (open && least && number <= *least))
    return fault(place, fmt::format("{} is too small: more than {:g} was expected", shown(value),
                                    above.value_or(least.value_or(0))));
  return {};
}

std::optional<std::string> array_fault(const json& schema, const json& value,
                                       const std::string& place) {
  const auto count = [&](const char* name, std::size_t otherwise) {
    return schema.contains(name) ? schema[name].get<std::size_t>() : otherwise;
  };
  const std::size_t least = count("minItems", 0), most = count("maxItems", SIZE_MAX);
  if (value.size() < least || value.size() > most)
    return fault(place, fmt::format("has {} items; {} were expected", value.size(),
                                    most == SIZE_MAX ? fmt::format("{} or more", least)
                                    : least == most  ? std::to_string(least)
                                                     : fmt::format("{} to {}", least, most)));
  if (!schema.contains("items")) return {};
  for (std::size_t i = 0; i < value.size(); ++i)
    if (auto found = schema_fault(schema["items"], value[i], fmt::format("{}[{}]", place, i)))
      return found;
  return {};
}

std::optional<std::string> object_fault(const json& schema, const json& value,
                                        const std::string& place) {
  const auto below = [&](const std::string& name) {
    return place.empty() ? name : place + "." + name;
  };
  if (schema.contains("required"))
    for (const auto& name : schema["required"])
      if (!value.contains(name.get<std::string>()))
        return fault(below(name.get<std::string>()), "is missing");
  const json none = json::object();
  const json& properties = schema.contains("properties") ? schema["properties"] : none;
  const json more = schema.value("additionalProperties", json(true));
  for (const auto& [name, member] : value.items()) {
    const auto own = properties.find(name);
    std::optional<std::string> found;
    if (own != properties.end()) {
      found = schema_fault(*own, member, below(name));
    } else if (more.is_object()) {
      found = schema_fault(more, member, below(name));
    } else if (more == false) {
      std::string known;
      for (const auto& property : properties.items())
        known += (known.empty() ? "" : ", ") + property.key();
      found = fault(below(shown(name)), fmt::format("is not known; known are {}", known));
    }
    if (found) return found;
  }
  return {};
}

std::optional<std::string> choice_fault(const json& schemas, const json& value,
                                        const std::string& place) {
  std::string why;
  for (const json& schema : schemas) {
    const auto found = schema_fault(schema, value, place);
    if (!found) return {};
    if (!why.empty()) why += "; or ";
    why += *found;
  }
  return why;
}

}  // namespace

json parse_json(std::string_view text) {
  if (!is_utf8(text)) throw Refusal(400, "the body is not UTF-8; JSON in UTF-8 was expected");
  if (is_too_deep(text))
    throw Refusal(400, fmt::format("the body is nested deeper than {} levels; flatter JSON was "
                                   "expected",
                                   kDeepestJson));
  try {
    return json::parse(text);
  } catch (const json::exception& error) {
    const std::string what = error.what();
    // What comes before "] " is the library's own number.
    const std::size_t begin = what.find("] ");
    throw Refusal(400, "the body is not JSON: " +
                           (begin == std::string::npos ? what : what.substr(begin + 2)));
  }
}

std::optional<std::string> schema_fault(const json& schema, const json& value,
                                        const std::string& place) {
  if (!schema.is_object()) return {};
  if (value.is_null() && schema.value("nullable", false)) return {};
  if (schema.contains("type")) {
    const auto type = schema["type"].get<std::string>();
    if (!has_type(value, type)) return fault(place, fmt::format("{} is no {}", shown(value), type));
  }
  if (schema.contains("const") && value != schema["const"])
    return fault(place, fmt::format("{} is not {}", shown(value), shown(schema["const"])));
  if (schema.contains("enum")) {
    const json& values = schema["enum"];
    if (std::find(values.begin(), values.end(), value) == values.end())
      return fault(place, fmt::format("{} is none of {}", shown(value), shown(values)));
  }
  for (const char* choice : {"oneOf", "anyOf"})
    if (schema.contains(choice))
      if (auto found = choice_fault(schema[choice], value, place)) return found;
  if (value.is_number()) return number_fault(schema, value, place);
  if (value.is_array()) return array_fault(schema, value, place);
  if (value.is_object()) return object_fault(schema, value, place);
  if (value.is_string()) {
    const std::size_t letters = letters_in(value.get_ref<const std::string&>());
    if (schema.contains("minLength") && letters < schema["minLength"].get<std::size_t>())
      return fault(place, "is too short");
    if (schema.contains("maxLength") && letters > schema["maxLength"].get<std::size_t>())
      return fault(place, fmt::format("has {} letters; {} were expected at most", letters,
                                      schema["maxLength"].get<std::size_t>()));
  }
  return {};
}

json value_of_text(const json& schema, const std::string& text) {
  const std::string type = schema.value("type", std::string());
  if (type == "number" || type == "integer") {
    double value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
      return text;
    if (type == "integer" && std::floor(value) == value && std::abs(value) < 0x1p53)
      return static_cast<std::int64_t>(value);
    return value;
  }
  if (type == "boolean" && (text == "true" || text == "false")) return text == "true";
  if (type == "array") {
    json values = json::array();
    const json items = schema.value("items", json::object());
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      values.push_back(value_of_text(items, text.substr(begin, end - begin)));
      begin = end + 1;
    }
    return values;
  }
  return text;
}

bool is_checked_keyword(std::string_view keyword) {
  static constexpr std::array<std::string_view, 18> kChecked = {"type",
                                                                "nullable",
                                                                "enum",
                                                                "const",
                                                                "properties",
                                                                "required",
                                                                "items",
                                                                "minItems",
                                                                "maxItems",
                                                                "minLength",
                                                                "maxLength",
                                                                "minimum",
                                                                "maximum",
                                                                "oneOf",
                                                                "anyOf",
                                                                "exclusiveMinimum",
                                                                "additionalProperties",
                                                                "default"};
  return std::find(kChecked.begin(), kChecked.end(), keyword) != kChecked.end();
}

}  // namespace scarp
