#include "cli/options.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "core/error/error.h"

namespace scarp {
namespace {

/// The number that text begins with, finite; text is left with what follows it.
std::optional<double> take_number(std::string_view& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return {};
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, std::string_view start) {
  if (!text.starts_with(start)) return false;
  text.remove_prefix(start.size());
  return true;
}

/// What the unit that text begins with stands for, the first of several; nothing where it is none.
std::optional<double> take_unit(std::string_view& text,
                                std::initializer_list<std::pair<std::string_view, double>> units) {
  for (const auto& [unit, factor] : units)
    if (take(text, unit)) return factor;
  return {};
}

}  // namespace

TypedPosition parse_position(const std::string& text) {
  TypedPosition position;
  position.text = text;
  std::string_view rest = text;
  const auto x = take_number(rest);
  const bool comma = take(rest, ",");
  const auto y = take_number(rest);
  bool understood = x && comma && y;
  if (understood && take(rest, ",")) {
    const auto height_m = take_number(rest);
    understood = height_m.has_value();
    position.height_m = height_m.value_or(0);
    position.above_datum = take(rest, "asl");
  }
  if (!understood || !rest.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("position '{}': not understood; X,Y or X,Y,H was expected, H in metres "
                            "above ground or as 1200asl",
                            text));
  position.x = *x;
  position.y = *y;
  return position;
}

std::pair<double, double> parse_range(const std::string& option, const std::string& text) {
  std::string_view rest = text;
  const auto from = take_number(rest);
  const bool comma = take(rest, ",");
  const auto to = take_number(rest);
  if (!from || !comma || !to || !rest.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("{} {}: not understood; two numbers A,B were expected", option, text));
  return {*from, *to};
}

double parse_frequency(const std::string& text) {
  std::string_view rest = text;
  const auto value = take_number(rest);
  const double factor = take_unit(rest, {{"k", 1e3}, {"M", 1e6}, {"G", 1e9}}).value_or(1);
  take(rest, "Hz");
  // From long waves to light; beyond it is a slip.
  if (!value || !rest.empty() || *value * factor < 1e3 || *value * factor > 1e15)
    throw Error(ErrorCode::kUsage,
                fmt::format("--frequency {}: not understood; hertz between 1e3 and 1e15 were "
                            "expected, such as 5.8GHz or 868MHz",
                            text));
  return *value * factor;
}

double parse_moment(const std::string& text) {
  const auto refuse = [&] {
    throw Error(ErrorCode::kUsage,
                fmt::format("--sun {}: not understood; a date and a time with its zone were "
                            "expected, such as 2026-06-21T12:00Z or 2026-06-21T14:00+02:00",
                            text));
  };
  std::string_view rest = text;
  const auto take_digits = [&](std::size_t count, int least, int most) {
    int value = 0;
    if (rest.size() < count) refuse();
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + count, value);
    if (error != std::errc() || end != rest.data() + count || value < least || value > most)
      refuse();
    rest.remove_prefix(count);
    return value;
  };
  const auto expect = [&](std::string_view mark) {
    if (!take(rest, mark)) refuse();
  };
  const int year = take_digits(4, 1900, 2200);
  expect("-");
  const int month = take_digits(2, 1, 12);
  expect("-");
  const std::chrono::year_month_day date{
      std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
      std::chrono::day(static_cast<unsigned>(take_digits(2, 1, 31)))};
  if (!date.ok()) refuse();
  expect("T");
  double seconds = take_digits(2, 0, 23) * 3600;
  expect(":");
  seconds += take_digits(2, 0, 59) * 60;
  if (take(rest, ":")) seconds += take_digits(2, 0, 60);
  if (!take(rest, "Z")) {
    const double sign = take(rest, "-") ? 1 : -1;
    if (sign < 0) expect("+");
    seconds += sign * take_digits(2, 0, 14) * 3600;
    expect(":");
    seconds += sign * take_digits(2, 0, 59) * 60;
  }
  if (!rest.empty()) refuse();
  constexpr std::chrono::sys_days kEpoch =
      std::chrono::year(2000) / std::chrono::January / std::chrono::day(1);
  const auto days = static_cast<double>((std::chrono::sys_days(date) - kEpoch).count());
  return days + seconds / 86'400 - 0.5;
}

MapPoint to_map_point(const TypedPosition& typed, const std::string& crs, const GeoFrame& frame) {
  const MapPoint point{typed.x, typed.y, typed.height_m};
  if (crs.empty()) return point;
  if (frame.description().crs_wkt.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("--crs {}: the data have no coordinate system to convert to; give "
                            "positions in the units of the data and leave --crs out",
                            crs));
  return convert_coordinates(crs, frame.description().crs_wkt, point);
}

std::optional<double> parse_duration(const std::string& text) {
  std::string_view rest = text;
  const auto value = take_number(rest);
  const auto unit_s = take_unit(rest, {{"s", 1}, {"min", 60}, {"h", 3600}});
  if (!value || !unit_s || !rest.empty() || !(*value > 0)) return {};
  return *value * *unit_s;
}

void take_budget(const std::string& text, Budget& budget) {
  if (const auto seconds = parse_duration(text)) {
    budget.seconds = seconds;
    return;
  }
  std::string_view rest = text;
  const auto value = take_number(rest);
  if (!value || !(*value > 0) || rest != "B/triangle")
    throw Error(ErrorCode::kUsage,
                fmt::format("--budget {}: not understood; a time such as 10s, 5min or 1h, or bytes "
                            "such as 4B/triangle were expected",
                            text));
  budget.bytes_per_triangle = value;
}

std::uint64_t parse_bytes(const std::string& text) {
  std::string_view rest = text;
  const auto value = take_number(rest);
  const auto unit =
      take_unit(rest, {{"K", 0x1p10}, {"k", 0x1p10}, {"M", 0x1p20}, {"G", 0x1p30}, {"T", 0x1p40}});
  const double factor = unit.value_or(1);
  if (unit) take(rest, "i");
  take(rest, "B");
  if (!value || !rest.empty() || *value * factor < 1 || *value * factor > 0x1p62)
    throw Error(ErrorCode::kUsage,
                fmt::format("size '{}': not understood; a number with K, M, G or T was expected, "
                            "such as 2GiB",
                            text));
  return static_cast<std::uint64_t>(*value * factor);
}

}  // namespace scarp
