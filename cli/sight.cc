#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/progress_bar.h"
#include "cli/sight_picture.h"
#include "cli/sight_surface.h"
#include "core/error/error.h"
#include "core/viewshed/sight_profile.h"
#include "core/viewshed/view_limits.h"
#include "tiles/store/part_file.h"

namespace scarp {
namespace {

using nlohmann::json;

constexpr double kSpeedOfLightMPerS = 299'792'458;

const char* word_of(Sight sight) {
  return sight == Sight::kVisible ? "visible" : sight == Sight::kHidden ? "hidden" : "unknown";
}

json or_null(const std::optional<double>& value) {
  return value ? json(*value) : json(nullptr);
}

/// The height above ground at which one end would be free, the other as it is.
template <class Judge>
std::optional<double> least_height_m(const SightSurface& surface, const SightEnd& end,
                                     Judge judge) {
  if (!end.ground_m) return {};
  return least_free_height_m([&](double height_m) {
    const MapPoint raised{end.map.x, end.map.y, *end.ground_m + height_m};
    return judge(surface.place(raised).position) != Sight::kHidden;
  });
}

/// Ground on the line that stands in the way.
struct SightBlocker {
  MapPoint map;
  double distance_m = 0;
  double clearance_m = 0;  ///< below 0
};

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
    surface_ = open_surface(options_.sources, dem, bar.stage("read"));
    from_ = surface_->place(options_.from, options_.crs);
    to_ = surface_->place(options_.to, options_.crs);
    if (from_.position.x_m == to_.position.x_m && from_.position.y_m == to_.position.y_m)
      throw Error(ErrorCode::kInput,
                  fmt::format("--from {} and --to {}: are the same place on the map; two places "
                              "were expected; move one of them",
                              options_.from.text, options_.to.text));
  }

  void measure() {
    const Position &a = from_.position, &b = to_.position;
    const auto earth = surface_->frame().earth_frame();
    sight_ = surface_->judge(a, b);
    const GroundAlong along = surface_->ground_along(a, b);
    void_at_end_ = along.void_at_end;
    wavelength_m_ = options_.frequency_hz ? kSpeedOfLightMPerS / *options_.frequency_hz : 0;
    profile_ = sight_profile(a, b, along, earth, wavelength_m_);
    const GeoFrame::Placer placer(surface_->frame());
    for (const ProfilePoint& point : profile_) ground_.push_back(placer.unplace(point.ground));
    const Bearing bearing = EyeBearings(a, earth).to(b);
    distance_m_ = bearing.distance_m;
    azimuth_deg_ = bearing.azimuth_rad * 180 / M_PI;
    find_blocker();
    least_from_m_ =
        least_height_m(*surface_, from_, [&](const Position& p) { return surface_->judge(p, b); });
    least_to_m_ =
        least_height_m(*surface_, to_, [&](const Position& p) { return surface_->judge(a, p); });
    draw_line(placer, EyeBearings(a, earth));
  }

  void find_blocker() {
    if (sight_ != Sight::kHidden) return;
    const auto under = [](const SightEnd& end, double distance_m) {
      const double ground_m = end.ground_m.value_or(end.map.height_m);
      return SightBlocker{
          {end.map.x, end.map.y, ground_m}, distance_m, end.map.height_m - ground_m};
    };
    if (surface_->starts_under_ground(from_.position, to_.position)) {
      blocker_ = under(from_, 0);
      return;
    }
    const auto first = std::find_if(profile_.begin(), profile_.end(),
                                    [](const ProfilePoint& p) { return p.blocks; });
    if (first == profile_.end()) {
      blocker_ = under(to_, distance_m_);
      return;
    }
    blocker_ = {ground_[static_cast<std::size_t>(first - profile_.begin())], first->distance_m,
                first->clearance_m};
  }

  /// The line as it runs over the ground, dense enough to look smooth.
  void draw_line(const GeoFrame::Placer& placer, const EyeBearings& bearings) {
    constexpr int kParts = 160;
    const Position &a = from_.position, &b = to_.position;
    GroundAlong parts;
    for (int i = 1; i < kParts; ++i)
      parts.crossings.push_back(
          {{i, kParts - i}, a.z_m + i * (b.z_m - a.z_m) / kParts, false, false});
    drawn_.line.push_back({0, from_.map.height_m, 0});
    for (const ProfilePoint& p :
         sight_profile(a, b, parts, surface_->frame().earth_frame(), wavelength_m_))
      drawn_.line.push_back(
          {bearings.to(p.line).distance_m, placer.unplace(p.line).height_m, p.fresnel_radius_m});
    drawn_.line.push_back({distance_m_, to_.map.height_m, 0});
  }

  std::optional<std::size_t> least(double (*of)(const ProfilePoint&)) const {
    if (profile_.empty()) return {};
    const auto found = std::min_element(
        profile_.begin(), profile_.end(),
        [&](const ProfilePoint& p, const ProfilePoint& q) { return of(p) < of(q); });
    return static_cast<std::size_t>(found - profile_.begin());
  }
  std::optional<std::size_t> least_clear() const {
    return least([](const ProfilePoint& p) { return p.clearance_m; });
  }
  std::optional<std::size_t> least_ratio() const {
    if (wavelength_m_ == 0) return {};
    return least([](const ProfilePoint& p) { return p.fresnel_ratio(); });
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
              {"from", end_json(from_, least_from_m_)},
              {"to", end_json(to_, least_to_m_)},
              {"distance_m", distance_m_},
              {"azimuth_deg", azimuth_deg_},
              {"sight", word_of(sight_)},
              {"first_blocker", nullptr},
              {"least_clearance", nullptr}};
    if (blocker_)
      r["first_blocker"] = {{"x", blocker_->map.x},
                            {"y", blocker_->map.y},
                            {"height_m", blocker_->map.height_m},
                            {"distance_m", blocker_->distance_m},
                            {"above_line_m", -blocker_->clearance_m}};
    if (const auto i = least_clear())
      r["least_clearance"] = {{"clearance_m", profile_[*i].clearance_m},
                              {"distance_m", profile_[*i].distance_m}};
    if (wavelength_m_ > 0) {
      r["fresnel"] = {{"frequency_hz", *options_.frequency_hz}, {"least_ratio", nullptr}};
      if (const auto i = least_ratio()) {
        r["fresnel"]["least_ratio"] = profile_[*i].fresnel_ratio();
        r["fresnel"]["distance_m"] = profile_[*i].distance_m;
      }
    }
    r["profile"] = profile_json();
    return r;
  }

  json profile_json() const {
    json points = json::array();
    for (std::size_t i = 0; i < profile_.size(); ++i) {
      const ProfilePoint& p = profile_[i];
      json point = {{"distance_m", p.distance_m},
                    {"x", ground_[i].x},
                    {"y", ground_[i].y},
                    {"ground_m", ground_[i].height_m},
                    {"clearance_m", p.clearance_m},
                    {"blocks", p.blocks},
                    {"void_before", p.void_before}};
      if (wavelength_m_ > 0) {
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
    if (!blocker_)
      return sight_ == Sight::kVisible ? "visible" : "unknown: void ground may be in the way";
    return fmt::format(
        "hidden: at {:.10g},{:.10g}, {:.1f} m from the eye, the ground ({:.1f} m) "
        "stands {:.2f} m above the line",
        blocker_->map.x, blocker_->map.y, blocker_->distance_m, blocker_->map.height_m,
        -blocker_->clearance_m);
  }
  std::string heights_text() const {
    return fmt::format("least height for a free line: of the eye {}; of the target {}",
                       height_text(from_, least_from_m_), height_text(to_, least_to_m_));
  }

  std::string picture() {
    if (from_.ground_m) drawn_.ground.push_back({0, *from_.ground_m, false});
    for (std::size_t i = 0; i < profile_.size(); ++i)
      drawn_.ground.push_back(
          {profile_[i].distance_m, ground_[i].height_m, profile_[i].void_before});
    if (to_.ground_m) drawn_.ground.push_back({distance_m_, *to_.ground_m, void_at_end_});
    drawn_.eye_foot_m = from_.ground_m;
    drawn_.target_foot_m = to_.ground_m;
    drawn_.sight = sight_;
    drawn_.flat_earth = !surface_->frame().earth_frame();
    if (blocker_)
      drawn_.blocker = {blocker_->distance_m, blocker_->map.height_m,
                        fmt::format("ground {:.2f} m above the line, {:.0f} m away",
                                    -blocker_->clearance_m, blocker_->distance_m)};
    const SurfaceNote note = note_of(*surface_);
    drawn_.title =
        fmt::format("{} \u2192 {}: {}", options_.from.text, options_.to.text, word_of(sight_));
    drawn_.notes = {heights_text(),
                    fmt::format("surface {}, earth {}, refraction {:g}, heights {}", note.surface,
                                note.earth, note.refraction, note.heights)};
    if (const auto i = least_ratio())
      drawn_.notes.back() +=
          fmt::format("; first Fresnel zone at {:g} GHz: {:.0f} % of its radius clear",
                      *options_.frequency_hz / 1e9, 100 * profile_[*i].fresnel_ratio());
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
    if (const auto i = least_clear())
      fmt::print("least clearance {:.2f} m, {:.1f} m from the eye\n", profile_[*i].clearance_m,
                 profile_[*i].distance_m);
    if (const auto i = least_ratio())
      fmt::print(
          "first Fresnel zone: {:.1f} % of its radius of {:.2f} m clear, {:.1f} m from the eye\n",
          100 * profile_[*i].fresnel_ratio(), profile_[*i].fresnel_radius_m,
          profile_[*i].distance_m);
  }

  const SightOptions& options_;
  bool as_picture_ = false;
  std::optional<PartFile> file_;
  std::unique_ptr<SightSurface> surface_;
  SightEnd from_, to_;
  Sight sight_ = Sight::kUnknown;
  std::vector<ProfilePoint> profile_;
  std::vector<MapPoint> ground_;  ///< of each point of the profile
  bool void_at_end_ = false;
  double wavelength_m_ = 0, distance_m_ = 0, azimuth_deg_ = 0;
  std::optional<SightBlocker> blocker_;
  std::optional<double> least_from_m_, least_to_m_;
  PictureProfile drawn_;
};

}  // namespace

int run_sight(const SightOptions& options) {
  return SightRun(options).run();
}

}  // namespace scarp
