#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace scarp {

/// The offer that an Accept header (RFC 9110) likes best: the greatest quality, of equal ones the
/// more precisely named, then the first offered. An empty header takes the first. Parts that are
/// not understood are passed over. Nothing where none of the offers is acceptable.
/// @param offers  media types in small letters; parameters after ";" are not compared
std::optional<std::size_t> choose_media_type(std::string_view accept,
                                             std::span<const std::string> offers);

/// What a Prefer header (RFC 7240) asks of an execution.
struct Preference {
  bool respond_async = false;
  std::optional<double> wait_s;
  bool return_minimal = false;
};
Preference parse_prefer(std::string_view prefer);

/// A single range of bytes, such as "bytes=0-99", "bytes=100-", "bytes=-50", within a body.
struct ByteRange {
  std::uint64_t first = 0, bytes = 0;
};
enum class RangeAnswer { kWhole, kPart, kUnsatisfiable };
/// Anything that is not one well-formed range asks for the whole.
RangeAnswer parse_range_header(std::string_view range, std::uint64_t size, ByteRange& part);

/// Whether an If-None-Match header names an entity tag (weakly compared), or is "*".
bool matches_etag(std::string_view if_none_match, std::string_view etag);

}  // namespace scarp
