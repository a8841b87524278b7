#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/progress_bar.h"
#include "cli/sight_line.h"
#include "cli/sight_picture.h"
#include "cli/sight_surface.h"
#include "core/error/error.h"
#include "core/viewshed/sight_profile.h"
#include "core/viewshed/view_limits.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

using nlohmann::json;

json or_null(const std::optional<double>& value) {
  return value ? json(*value) : json(nullptr);
}

class SightRun {
 public:
  explicit SightRun(const SightOptions& options) : options_(options) {}

  int run() {
    check_output();
    open();
    measure();
    write();
    print();
    return 0;
  }

 private:
  void check_output() {
    const std::string& path = options_.output;
    if (path.empty()) return;
    as_picture_ = path.ends_with(".svg");
    if (!as_picture_ && !path.ends_with(".json"))
      throw Error(ErrorCode::kUsage,
                  fmt::format("'{}': a name that ends in .svg or .json was expected", path));
    file_.emplace(path, existing(options_.common));
  }

  void open() {
    ProgressBar bar(!options_.common.json);
    DemOptions dem = options_.dem;
    dem.memory_budget_bytes = options_.common.memory_budget_bytes;
    surface_ = open_surface(options_.sources, dem, bar.stage("read"),
                            TypedLine{options_.from, options_.to, options_.crs});
  }

  void measure() {
    line_ = measure_sight(*surface_, surface_->place(options_.from, options_.crs),
                          surface_->place(options_.to, options_.crs), options_.frequency_hz,
                          options_.from.text, options_.to.text);
    draw_line(GeoFrame::Placer(surface_->frame()),
              EyeBearings(line_.from.position, surface_->frame().earth_frame()));
  }

  /// The line as it runs over the ground, dense enough to look smooth.
  void draw_line(const GeoFrame::Placer& placer, const EyeBearings& bearings) {
    constexpr int kParts = 160;
    const Position &a = line_.from.position, &b = line_.to.position;
    GroundAlong parts;
    for (int i = 1; i < kParts; ++i)
      parts.crossings.push_back(
          {{i, kParts - i}, a.z_m + i * (b.z_m - a.z_m) / kParts, false, false});
    drawn_.line.push_back({0, line_.from.map.height_m, 0});
    for (const ProfilePoint& p :
         sight_profile(a, b, parts, surface_->frame().earth_frame(), line_.wavelength_m))
      drawn_.line.push_back(
          {bearings.to(p.line).distance_m, placer.unplace(p.line).height_m, p.fresnel_radius_m});
    drawn_.line.push_back({line_.distance_m, line_.to.map.height_m, 0});
  }

  json end_json(const SightEnd& end, const std::optional<double>& least_m) const {
    return {{"x", end.map.x},
            {"y", end.map.y},
            {"height_m", end.map.height_m},
            {"above_ground_m", or_null(end.above_ground_m())},
            {"least_above_ground_m", or_null(least_m)}};
  }

  json result() const {
    const SurfaceNote note = note_of(*surface_);
    json r = {{"surface", note.surface},
              {"earth", note.earth},
              {"refraction", note.refraction},
              {"heights", note.heights},
              {"from", end_json(line_.from, line_.least_from_m)},
              {"to", end_json(line_.to, line_.least_to_m)},
              {"distance_m", line_.distance_m},
              {"azimuth_deg", line_.azimuth_deg},
              {"sight", word_of(line_.sight)},
              {"tiles", surface_->tiles()},
              {"tiles_read", surface_->tiles_read()},
              {"first_blocker", nullptr},
              {"least_clearance", nullptr}};
    if (line_.blocker)
      r["first_blocker"] = {{"x", line_.blocker->map.x},
                            {"y", line_.blocker->map.y},
                            {"height_m", line_.blocker->map.height_m},
                            {"distance_m", line_.blocker->distance_m},
                            {"above_line_m", -line_.blocker->clearance_m}};
    if (const auto i = line_.least_clear())
      r["least_clearance"] = {{"clearance_m", line_.profile[*i].clearance_m},
                              {"distance_m", line_.profile[*i].distance_m}};
    if (line_.wavelength_m > 0) {
      r["fresnel"] = {{"frequency_hz", *options_.frequency_hz}, {"least_ratio", nullptr}};
      if (const auto i = line_.least_ratio()) {
        r["fresnel"]["least_ratio"] = line_.profile[*i].fresnel_ratio();
        r["fresnel"]["distance_m"] = line_.profile[*i].distance_m;
      }
    }
    r["profile"] = profile_json();
    return r;
  }

  json profile_json() const {
    json points = json::array();
    for (std::size_t i = 0; i < line_.profile.size(); ++i) {
      const ProfilePoint& p = line_.profile[i];
      json point = {{"distance_m", p.distance_m},   {"x", line_.ground[i].x},
                    {"y", line_.ground[i].y},       {"ground_m", line_.ground[i].height_m},
                    {"clearance_m", p.clearance_m}, {"blocks", p.blocks},
                    {"void_before", p.void_before}};
      if (line_.wavelength_m > 0) {
        point["fresnel_radius_m"] = p.fresnel_radius_m;
        point["fresnel_ratio"] = p.fresnel_ratio();
      }
      points.push_back(point);
    }
    return points;
  }

  static std::string height_text(const SightEnd& end, const std::optional<double>& least_m) {
    if (!end.ground_m) return "not known, no ground there";
    return least_m ? fmt::format("{:.2f} m above ground", *least_m)
                   : fmt::format("none up to {:.0f} m", kGreatestFreeHeightM);
  }

  std::string verdict() const {
    if (!line_.blocker)
      return line_.sight == Sight::kVisible ? "visible" : "unknown: void ground may be in the way";
    return fmt::format(
        "hidden: at {:.10g},{:.10g}, {:.1f} m from the eye, the ground ({:.1f} m) "
        "stands {:.2f} m above the line",
        line_.blocker->map.x, line_.blocker->map.y, line_.blocker->distance_m,
        line_.blocker->map.height_m, -line_.blocker->clearance_m);
  }
  std::string heights_text() const {
    return fmt::format("least height for a free line: of the eye {}; of the target {}",
                       height_text(line_.from, line_.least_from_m),
                       height_text(line_.to, line_.least_to_m));
  }

  std::string picture() {
    if (line_.from.ground_m) drawn_.ground.push_back({0, *line_.from.ground_m, false});
    for (std::size_t i = 0; i < line_.profile.size(); ++i)
      drawn_.ground.push_back(
          {line_.profile[i].distance_m, line_.ground[i].height_m, line_.profile[i].void_before});
    if (line_.to.ground_m)
      drawn_.ground.push_back({line_.distance_m, *line_.to.ground_m, line_.void_at_end});
    drawn_.eye_foot_m = line_.from.ground_m;
    drawn_.target_foot_m = line_.to.ground_m;
    drawn_.sight = line_.sight;
    drawn_.flat_earth = !surface_->frame().earth_frame();
    if (line_.blocker)
      drawn_.blocker = {line_.blocker->distance_m, line_.blocker->map.height_m,
                        fmt::format("ground {:.2f} m above the line, {:.0f} m away",
                                    -line_.blocker->clearance_m, line_.blocker->distance_m)};
    const SurfaceNote note = note_of(*surface_);
    drawn_.title =
        fmt::format("{} \u2192 {}: {}", options_.from.text, options_.to.text, word_of(line_.sight));
    drawn_.notes = {heights_text(),
                    fmt::format("surface {}, earth {}, refraction {:g}, heights {}", note.surface,
                                note.earth, note.refraction, note.heights)};
    if (const auto i = line_.least_ratio())
      drawn_.notes.back() +=
          fmt::format("; first Fresnel zone at {:g} GHz: {:.0f} % of its radius clear",
                      *options_.frequency_hz / 1e9, 100 * line_.profile[*i].fresnel_ratio());
    return draw_profile(drawn_);
  }

  void write() {
    if (!file_) return;
    const std::string text = as_picture_ ? picture() : result().dump(2) + "\n";
    file_->append(std::as_bytes(std::span(text)));
    file_->commit();
  }

  void print() const {
    if (options_.common.json) {
      fmt::print("{}\n", result().dump(2));
      return;
    }
    fmt::print("{}\n{}\n", verdict(), heights_text());
    if (const auto i = line_.least_clear())
      fmt::print("least clearance {:.2f} m, {:.1f} m from the eye\n", line_.profile[*i].clearance_m,
                 line_.profile[*i].distance_m);
    if (const auto i = line_.least_ratio())
      fmt::print(
          "first Fresnel zone: {:.1f} % of its radius of {:.2f} m clear, {:.1f} m from the eye\n",
          100 * line_.profile[*i].fresnel_ratio(), line_.profile[*i].fresnel_radius_m,
          line_.profile[*i].distance_m);
  }

  const SightOptions& options_;
  bool as_picture_ = false;
  std::optional<PartFile> file_;
  std::unique_ptr<SightSurface> surface_;
  SightLine line_;
  PictureProfile drawn_;
};

}  // namespace

int run_sight(const SightOptions& options) {
  return SightRun(options).run();
}

}  // namespace scarp
