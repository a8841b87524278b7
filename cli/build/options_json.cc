#include "cli/build/options_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/error/error.h"

namespace scarp {
namespace {

using nlohmann::json;

/// Members of an object and where they live, read and written by one list.
class Members {
 public:
  Members(json& object, bool reads) : object_(object), reads_(reads) {}

  template <class T>
  void member(const char* name, T& value) {
    if (!reads_)
      object_[name] = value;
    else if (object_.contains(name))
      value = object_[name].get<T>();
  }

  template <class T>
  void member(const char* name, std::optional<T>& value) {
    if (!reads_ && value)
      object_[name] = *value;
    else if (reads_ && object_.contains(name))
      value = object_[name].get<T>();
  }

  /// A member that is a word; `values` in the order of their `words`.
  template <class T, std::size_t n>
  void word(const char* name, T& value, const std::array<const char*, n>& words) {
    if (!reads_) {
      object_[name] = words[static_cast<std::size_t>(value)];
      return;
    }
    if (!object_.contains(name)) return;
    const auto text = object_[name].get<std::string>();
    const auto found = std::find(words.begin(), words.end(), text);
    if (found == words.end())
      throw Error(ErrorCode::kUsage, fmt::format("{} \"{}\": not known; one of {} was expected",
                                                 name, text, fmt::join(words, ", ")));
    value = static_cast<T>(found - words.begin());
  }

 private:
  json& object_;
  bool reads_;
};

constexpr std::array<const char*, 3> kHorizons = {"certified", "stewart", "both"};
constexpr std::array<const char*, 3> kAccuracies = {"exact", "high", "fast"};
constexpr std::array<const char*, 2> kGrowths = {"hidden-together", "breadth-first"};
constexpr std::array<const char*, 2> kEarths = {"ellipsoid", "flat"};
static_assert(static_cast<int>(Earth::kEllipsoid) == 0 && static_cast<int>(Earth::kFlat) == 1);

void visit(Members& members, BuildOptions& options) {
  DemOptions& dem = options.dem;
  members.member("refraction", dem.refraction);
  members.member("geoid", dem.geoid_file);
  members.member("height_unit", dem.height_unit);
  members.member("nodata", dem.nodata);
  members.word("accuracy", options.accuracy, kAccuracies);
  members.member("max_error_m", options.max_error_m);
  members.member("vertices", options.vertices);
  members.member("footprints", options.footprints_file);
  members.member("height_field", options.footprints_height_field);
  members.word("horizon", options.horizon, kHorizons);
  members.member("sectors", options.sectors);
  members.member("subsectors", options.subsectors);
  members.member("fans", options.fans);
  members.member("patch", options.patch);
  members.member("budget_s", options.budget.seconds);
  members.member("budget_bytes_per_triangle", options.budget.bytes_per_triangle);
  members.word("growth", options.growth, kGrowths);
  members.member("group_triangles", options.group_triangles);
  members.member("min_group_triangles", options.min_group_triangles);
  members.member("seeds", options.seeds);
  members.member("max_groups", options.max_groups);
  members.member("seed", options.seed);
  members.member("crs", options.crs);
  members.member("tile_samples", options.tile_samples);
  members.member("outlines", options.outlines);
}

}  // namespace

std::string growth_name(Growth growth) {
  return kGrowths[static_cast<std::size_t>(growth)];
}

std::string horizon_name(Hiding horizon) {
  return kHorizons[static_cast<std::size_t>(horizon)];
}

json to_json(const BuildOptions& options) {
  json object = json::object();
  BuildOptions copy = options;
  Members members(object, false);
  visit(members, copy);
  if (options.dem.earth) members.word("earth", *copy.dem.earth, kEarths);
  if (options.observer) object["observer"] = options.observer->text;
  return object;
}

BuildOptions build_options_from(const json& object) {
  json copy = object;
  BuildOptions options;
  Members members(copy, true);
  visit(members, options);
  if (object.contains("earth")) {
    options.dem.earth.emplace();
    members.word("earth", *options.dem.earth, kEarths);
  }
  if (object.contains("observer"))
    options.observer = parse_position(object["observer"].get<std::string>());
  return options;
}

}  // namespace scarp
