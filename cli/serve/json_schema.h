#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace scarp {

/// Reads a JSON text from outside: UTF-8, numbers that double holds, nested no deeper than
/// kDeepestJson. Throws Refusal{400} that says where it ends to be understood.
nlohmann::json parse_json(std::string_view text);
inline constexpr int kDeepestJson = 24;

/// What is wrong with a value by a schema, in one line that begins with the place
/// ("inputs.observers[2]:
/// ..."), or nothing.
///
/// The part of JSON Schema (as in OpenAPI 3.0) that the server's own schemas use, and all of it
/// that they use: type, nullable, enum, const, properties, required, additionalProperties (false or
/// a schema), items, minItems, maxItems, minLength, maxLength, minimum, maximum, exclusiveMinimum
/// (number or true), oneOf and anyOf (both: one at least fits). Other keywords describe only; a
/// test holds the published schemas to this list.
std::optional<std::string> schema_fault(const nlohmann::json& schema, const nlohmann::json& value,
                                        const std::string& place);

/// A value of a query as the type that its schema asks for: "5" as 5 for a number, "true" as true,
/// "1,2" as [1, 2] for an array of such. Text that does not fit stays text, which the schema then
/// refuses.
nlohmann::json value_of_text(const nlohmann::json& schema, const std::string& text);

/// Whether schema_fault looks at a keyword.
bool is_checked_keyword(std::string_view keyword);

}  // namespace scarp
