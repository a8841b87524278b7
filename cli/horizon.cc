#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/place_horizon.h"
#include "cli/progress_bar.h"
#include "cli/sight_surface.h"
#include "core/error/error.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

using nlohmann::json;

constexpr int kAzimuthsOfPlace = 360;

json json_of(const SightSurface& surface, const SightEnd& eye,
             const std::vector<HorizonLine>& lines) {
  const SurfaceNote note = note_of(surface);
  const bool flat = !surface.frame().earth_frame();
  json r = {{"surface", note.surface},
            {"earth", note.earth},
            {"refraction", note.refraction},
            {"heights", note.heights},
            {"north", flat ? "grid" : "true"},
            {"at", {{"x", eye.map.x}, {"y", eye.map.y}, {"height_m", eye.map.height_m}}},
            {"horizon", json::array()}};
  for (const HorizonLine& line : lines) {
    json point = {{"azimuth_deg", line.azimuth_deg}, {"elevation_deg", nullptr}};
    if (line.found) {
      point["elevation_deg"] = line.elevation_deg;
      point["distance_m"] = line.distance_m;
      point[flat ? "x" : "longitude_deg"] = line.x;
      point[flat ? "y" : "latitude_deg"] = line.y;
      point["over_void"] = line.over_void;
    }
    r["horizon"].push_back(point);
  }
  return r;
}

std::string csv_of(const SightSurface& surface, const std::vector<HorizonLine>& lines) {
  const bool flat = !surface.frame().earth_frame();
  std::string csv = fmt::format("azimuth_deg,elevation_deg,distance_m,{},over_void\n",
                                flat ? "x,y" : "longitude_deg,latitude_deg");
  for (const HorizonLine& line : lines) {
    csv += fmt::format("{:.9g},", line.azimuth_deg);
    if (line.found)
      csv += fmt::format("{:.6f},{:.3f},{:.{}f},{:.{}f},{}\n", line.elevation_deg, line.distance_m,
                         line.x, flat ? 3 : 9, line.y, flat ? 3 : 9, line.over_void ? 1 : 0);
    else
      csv += ",,,,\n";
  }
  return csv;
}

/// What is for all points has no use for one.
void check_place_options(const HorizonOptions& options) {
  const auto refuse = [](bool is_given, const char* name) {
    if (is_given)
      throw Error(ErrorCode::kUsage,
                  fmt::format("{}: is for the horizons of all points; leave it or --at out", name));
  };
  refuse(options.eye_height_m > 0, "--eye-height");
  refuse(options.estimate_only, "--estimate-only");
  refuse(!options.distance_output.empty(), "--distance");
  refuse(!options.sky_view_output.empty(), "--sky-view");
  refuse(!options.openness_output.empty(), "--openness");
  refuse(!options.negative_openness_output.empty(), "--negative-openness");
  refuse(options.sun_days.has_value(), "--sun");
}

}  // namespace

int run_horizon(const HorizonOptions& options) {
  if (options.of_all_points()) return run_all_horizons(options);
  check_place_options(options);
  const std::string& path = options.output;
  if (!path.empty() && !path.ends_with(".csv") && !path.ends_with(".json"))
    throw Error(ErrorCode::kUsage,
                fmt::format("'{}': a name that ends in .csv or .json was expected", path));
  std::optional<PartFile> file;
  if (!path.empty()) file.emplace(path, existing(options.common));
  ProgressBar bar(!options.common.json);
  DemOptions dem = options.dem;
  dem.memory_budget_bytes = options.common.memory_budget_bytes;
  const auto surface = open_surface(options.sources, dem, bar.stage("read"));
  const SightEnd eye = surface->place(*options.at, options.crs);
  const auto lines = horizon_of(*surface, eye, options.azimuths.value_or(kAzimuthsOfPlace));
  bar.clear();
  const auto text = [&](bool as_json) {
    return as_json ? json_of(*surface, eye, lines).dump(2) + "\n" : csv_of(*surface, lines);
  };
  if (file) {
    const std::string bytes = text(path.ends_with(".json"));
    file->append(std::as_bytes(std::span(bytes)));
    file->commit();
  }
  if (options.common.json || !file)
    fmt::print("{}", text(options.common.json));
  else
    fmt::print("{}: horizon in {} directions\n", path, lines.size());
  return 0;
}

}  // namespace scarp
