#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scarp {

/// The path and the query of a request, decoded.
struct RequestTarget {
  std::vector<std::string> segments;  ///< of the path; "/" has none, "/a/" has "a" and ""
  std::vector<std::pair<std::string, std::string>> query;
};

/// Reads an origin-form target such as "/scenes/alps/height?at=8.6,46.5". Each part is decoded
/// once, after it was cut out, so that an encoded slash or ampersand is a letter of its part.
///
/// Nothing where the target is anything else: no leading slash, a broken or cut escape, a control
/// character (a NUL above all), text that is not UTF-8, a segment "." or ".." however it is
/// written, a slash or backslash within a segment, more than 32 segments or 64 parameters.
std::optional<RequestTarget> parse_target(std::string_view target);

/// Whether bytes are UTF-8 as Unicode has it: shortest forms, no surrogates.
bool is_utf8(std::string_view text);

/// Text as one segment of a path.
std::string encode_segment(std::string_view text);

}  // namespace scarp
