#include "cli/serve/negotiation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace scarp {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Cuts off what comes before a mark, which quoted strings hide.
std::string_view take_until(std::string_view& text, char mark) {
  bool quoted = false;
  std::size_t end = 0;
  for (; end < text.size(); ++end) {
    if (quoted && text[end] == '\\') {
      ++end;
      continue;
    }
    if (text[end] == '"') quoted = !quoted;
    if (!quoted && text[end] == mark) break;
  }
  end = std::min(end, text.size());
  const std::string_view part = trimmed(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

char small_letter(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool same_text(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return small_letter(x) == small_letter(y); });
}

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return {};
  return value;
}

/// How precisely a range such as "image/*" names a type: 3 wholly, 2 by its kind, 1 as anything.
int precision_of(std::string_view range, std::string_view type) {
  if (range == "*/*" || range == "*") return 1;
  if (same_text(range, type)) return 3;
  if (range.ends_with("/*") && type.size() >= range.size() &&
      same_text(range.substr(0, range.size() - 1), type.substr(0, range.size() - 1)))
    return 2;
  return 0;
}

struct Liking {
  int precision = 0;
  double quality = 0;
};

/// The most precise range that names a type has its say.
Liking liking_of(std::string_view accept, std::string_view type) {
  Liking liking;
  while (!accept.empty()) {
    std::string_view part = take_until(accept, ',');
    const std::string_view range = take_until(part, ';');
    double quality = 1;
    while (!part.empty()) {
      std::string_view parameter = take_until(part, ';');
      const std::string_view name = take_until(parameter, '=');
      if (same_text(name, "q")) quality = std::clamp(number_in(parameter).value_or(0), 0.0, 1.0);
    }
    const int precision = precision_of(range, type);
    if (precision > liking.precision) liking = {precision, quality};
  }
  return liking;
}

}  // namespace

std::optional<std::size_t> choose_media_type(std::string_view accept,
                                             std::span<const std::string> offers) {
  if (offers.empty()) return {};
  if (trimmed(accept).empty()) return 0;
  std::optional<std::size_t> best;
  Liking best_liking;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const std::string_view offer = offers[i];
    const Liking liking = liking_of(accept, trimmed(offer.substr(0, offer.find(';'))));
    if (liking.precision == 0 || liking.quality <= 0) continue;
    const bool better =
        liking.quality > best_liking.quality ||
        (liking.quality == best_liking.quality && liking.precision > best_liking.precision);
    if (best && !better) continue;
    best = i;
    best_liking = liking;
  }
  return best;
}

Preference parse_prefer(std::string_view prefer) {
  Preference preference;
  while (!prefer.empty()) {
    std::string_view part = take_until(prefer, ',');
    std::string_view own = take_until(part, ';');
    const std::string_view name = take_until(own, '=');
    std::string_view value = trimmed(own);
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"')
      value = value.substr(1, value.size() - 2);
    if (same_text(name, "respond-async")) preference.respond_async = true;
    if (same_text(name, "return") && same_text(value, "minimal")) preference.return_minimal = true;
    if (same_text(name, "wait")) {
      const auto seconds = number_in(value);
      if (seconds && *seconds >= 0) preference.wait_s = seconds;
    }
  }
  return preference;
}

RangeAnswer parse_range_header(std::string_view range, std::uint64_t size, ByteRange& part) {
  constexpr std::string_view kUnit = "bytes=";
  if (!range.starts_with(kUnit)) return RangeAnswer::kWhole;
  range.remove_prefix(kUnit.size());
  const auto count_in = [](std::string_view text, std::uint64_t& value) {
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    return !text.empty() && failure == std::errc() && end == text.data() + text.size();
  };
  const std::size_t dash = range.find('-');
  if (dash == std::string_view::npos) return RangeAnswer::kWhole;
  const std::string_view from = trimmed(range.substr(0, dash)),
                         to = trimmed(range.substr(dash + 1));
  std::uint64_t first = 0, last = 0;
  if (from.empty()) {
    if (!count_in(to, last)) return RangeAnswer::kWhole;
    if (last == 0 || size == 0) return RangeAnswer::kUnsatisfiable;
    part.bytes = std::min(last, size);
    part.first = size - part.bytes;
    return RangeAnswer::kPart;
  }
  if (!count_in(from, first)) return RangeAnswer::kWhole;
  if (to.empty())
    last = size == 0 ? 0 : size - 1;
  else if (!count_in(to, last) || last < first)
    return RangeAnswer::kWhole;
  if (first >= size) return RangeAnswer::kUnsatisfiable;
  part.first = first;
  part.bytes = std::min(last, size - 1) - first + 1;
  return RangeAnswer::kPart;
}

bool matches_etag(std::string_view if_none_match, std::string_view etag) {
  while (!if_none_match.empty()) {
    std::string_view one = take_until(if_none_match, ',');
    if (one == "*") return true;
    if (one.starts_with("W/")) one.remove_prefix(2);
    if (one == etag) return true;
  }
  return false;
}

}  // namespace scarp
