#include "core/viewshed/viewshed.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/build/layers.h"
#include "cli/commands.h"
#include "cli/ground_eye.h"
#include "cli/progress_bar.h"
#include "cli/stage_clock.h"
#include "core/error/error.h"
#include "tiles/layers/geotiff.h"

namespace scarp {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

double azimuth_rad(double degrees) {
  const double turn = std::fmod(degrees, 360);
  return (turn < 0 ? turn + 360 : turn) * kRadiansPerDegree;
}

ViewLimits limits_of(const ViewshedOptions& options) {
  ViewLimits limits;
  limits.min_distance_m = options.min_distance_m;
  if (options.max_distance_m) limits.max_distance_m = *options.max_distance_m;
  // A range of a whole turn has no limit; otherwise its ends would fall on each other.
  if (options.azimuth_deg &&
      std::abs(options.azimuth_deg->second - options.azimuth_deg->first) < 360) {
    limits.azimuth_begin_rad = azimuth_rad(options.azimuth_deg->first);
    limits.azimuth_end_rad = azimuth_rad(options.azimuth_deg->second);
  }
  if (options.pitch_deg) {
    limits.min_pitch_rad = options.pitch_deg->first * kRadiansPerDegree;
    limits.max_pitch_rad = options.pitch_deg->second * kRadiansPerDegree;
  }
  return limits;
}

/// Wrong use shows before any work.
void check_options(const ViewshedOptions& options) {
  if (options.observers.empty())
    throw Error(ErrorCode::kUsage, "no eye: --observer X,Y[,H] was expected");
  if (options.max_distance_m && options.min_distance_m > *options.max_distance_m)
    throw Error(ErrorCode::kUsage,
                fmt::format("--min-distance {} is greater than --max-distance {}; nothing lies "
                            "between; exchange them",
                            options.min_distance_m, *options.max_distance_m));
  if (options.pitch_deg && options.pitch_deg->first > options.pitch_deg->second)
    throw Error(ErrorCode::kUsage,
                fmt::format("--pitch {},{}: the lowest comes first", options.pitch_deg->first,
                            options.pitch_deg->second));
  if (options.gdal_values && options.mode != ViewshedMode::kVisible)
    throw Error(ErrorCode::kUsage, "--gdal-values is for --mode visible; leave one of them out");
  if (!options.common.overwrite && std::filesystem::exists(options.output))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': exists; a new file was expected; give --overwrite to replace it",
                            options.output));
}

/// One run from options to a finished raster, a member function a stage.
class ViewshedRun {
 public:
  explicit ViewshedRun(const ViewshedOptions& options)
      : options_(options), bar_(!options.common.json) {}

  int run() {
    check_options(options_);
    stage("read", [&](const Progress& progress) { read(progress); });
    stage("see", [&](const Progress& progress) { see(progress); });
    stage("write", [&](const Progress&) { write(); });
    bar_.clear();
    print();
    return 0;
  }

 private:
  template <class Body>
  void stage(const std::string& name, Body body) {
    const Progress progress = bar_.stage(name);
    clock_.begin(name);
    body(progress);
    clock_.end();
  }

  void read(const Progress& progress) {
    DemOptions dem = options_.dem;
    dem.memory_budget_bytes = options_.common.memory_budget_bytes;
    ground_ = read_ground(options_.dem_files, dem, progress);
    for (const TypedPosition& typed : options_.observers)
      eyes_.push_back(place_eye(typed, options_.crs, ground_));
  }

  void see(const Progress& progress) {
    const GroundGrid& grid = ground_.grid;
    const auto earth = ground_.dem.frame->earth_frame();
    sight_.resize(static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows()));
    const bool counting = options_.mode == ViewshedMode::kCount;
    if (counting) count_.emplace(grid);
    // One eye that looks everywhere leaves nothing to be put together.
    const bool alone = eyes_.size() == 1 && !options_.max_distance_m && !counting;
    if (!alone && !counting) any_.emplace(grid);
    for (std::size_t i = 0; i < eyes_.size(); ++i) {
      const ViewshedEye eye{eyes_[i].position, options_.target_height_m, limits_of(options_)};
      SweepCounts counts;
      const SampleWindow window = view_from(grid, earth, eye, sight_, &counts);
      decided_.add(counts);
      if (count_) count_->add(window, sight_);
      if (any_) any_->add(window, sight_);
      if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(eyes_.size()));
    }
  }

  std::span<const Seen> seen() const {
    return any_ ? any_->sight() : std::span<const Seen>(sight_);
  }

  void write() {
    RasterLayer layer;
    if (count_) {
      layer = layer_over(ground_.dem, count_->counts(), "eyes that see it");
      layer.nodata = EyeCount::kVoid;
    } else {
      write_values(layer);
    }
    describe(layer.metadata);
    write_geotiff_cog(options_.output, layer,
                      options_.common.overwrite ? Existing::kReplace : Existing::kRefuse);
  }

  void write_values(RasterLayer& layer) {
    const std::span<const Seen> sight = seen();
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(sight.data()),
                                              sight.size());
    if (!options_.gdal_values) {
      layer = layer_over(ground_.dem, bytes, "visible");
      layer.nodata = 255;
      layer.colours = {{{70, 80, 96, 255}, {250, 196, 60, 255}}};
      layer.metadata["VALUES"] = "1 visible, 0 hidden, 255 unknown";
      return;
    }
    gdal_values_.resize(bytes.size());
    std::transform(sight.begin(), sight.end(), gdal_values_.begin(),
                   [](Seen s) { return static_cast<std::uint8_t>(s == Seen::kVisible ? 255 : 0); });
    layer = layer_over(ground_.dem, std::span<const std::uint8_t>(gdal_values_), "visible");
    layer.metadata["VALUES"] = "255 visible, 0 hidden or unknown";
  }

  /// What the run was, for whoever opens the raster.
  void describe(std::map<std::string, std::string>& metadata) const {
    const FrameDescription& frame = ground_.dem.frame->description();
    constexpr std::size_t kMostNamed = 32;
    std::string observers;
    for (std::size_t i = 0; i < std::min(eyes_.size(), kMostNamed); ++i)
      observers += fmt::format("{}{:.10g},{:.10g},{:.3f}asl", i ? " " : "", eyes_[i].map.x,
                               eyes_[i].map.y, eyes_[i].map.height_m);
    metadata["MODE"] = count_ ? "count" : "visible";
    metadata["SURFACE"] = "grid";
    metadata["EARTH"] = frame.earth == Earth::kFlat ? "flat" : "ellipsoid";
    metadata["REFRACTION"] = fmt::format("{:g}", frame.refraction);
    metadata["HEIGHTS"] = frame.earth == Earth::kFlat ? "above the map plane"
                          : frame.geoid_file.empty()  ? "taken as ellipsoidal"
                                                      : "geoid added";
    metadata["HEIGHT_UNIT_OF_DEM"] = ground_.dem.height_unit;
    metadata["OBSERVERS"] = std::to_string(eyes_.size());
    metadata["OBSERVER"] = observers;
    metadata["TARGET_HEIGHT_M"] = fmt::format("{:g}", options_.target_height_m);
    if (options_.min_distance_m > 0)
      metadata["MIN_DISTANCE_M"] = fmt::format("{:g}", options_.min_distance_m);
    if (options_.max_distance_m)
      metadata["MAX_DISTANCE_M"] = fmt::format("{:g}", *options_.max_distance_m);
    if (options_.azimuth_deg)
      metadata["AZIMUTH_DEG"] =
          fmt::format("{:g},{:g} clockwise from {} north", options_.azimuth_deg->first,
                      options_.azimuth_deg->second, frame.earth == Earth::kFlat ? "grid" : "true");
    if (options_.pitch_deg)
      metadata["PITCH_DEG"] =
          fmt::format("{:g},{:g}", options_.pitch_deg->first, options_.pitch_deg->second);
  }

  nlohmann::json summary() const {
    nlohmann::json result = {{"output", options_.output},
                             {"columns", ground_.grid.columns()},
                             {"rows", ground_.grid.rows()},
                             {"observers", eyes_.size()}};
    if (count_) {
      const auto counts = count_->counts();
      const auto is_void = [](std::uint32_t n) { return n == EyeCount::kVoid; };
      result["void_samples"] = std::count_if(counts.begin(), counts.end(), is_void);
      result["seen_samples"] = std::count_if(counts.begin(), counts.end(),
                                             [&](std::uint32_t n) { return n > 0 && !is_void(n); });
    } else {
      const std::span<const Seen> sight = seen();
      const auto samples_with = [&](Seen value) {
        return std::count(sight.begin(), sight.end(), value);
      };
      result["visible_samples"] = samples_with(Seen::kVisible);
      result["hidden_samples"] = samples_with(Seen::kHidden);
      result["unknown_samples"] = samples_with(Seen::kUnknown);
    }
    return result;
  }

  void print() const {
    for (const std::string& warning : ground_.dem.warnings)
      fmt::print(stderr, "scarp: warning: {}\n", warning);
    nlohmann::json result = summary();
    if (options_.common.json) {
      result["warnings"] = ground_.dem.warnings;
      result["decided"] = {{"targets", decided_.targets},
                           {"compared_with_part", decided_.traced_part},
                           {"judged_whole", decided_.traced_whole}};
      for (const StageCost& cost : clock_.costs())
        result["stages"].push_back(
            {{"name", cost.name}, {"seconds", cost.seconds}, {"peak_bytes", cost.peak_bytes}});
      fmt::print("{}\n", result.dump(2));
      return;
    }
    if (count_) {
      fmt::print("{}: {} of {} samples seen by {} eyes\n", options_.output,
                 result["seen_samples"].get<std::size_t>(), count_->counts().size(), eyes_.size());
    } else {
      fmt::print("{}: {} samples visible, {} hidden, {} unknown\n", options_.output,
                 result["visible_samples"].get<std::size_t>(),
                 result["hidden_samples"].get<std::size_t>(),
                 result["unknown_samples"].get<std::size_t>());
    }
  }

  const ViewshedOptions& options_;
  ProgressBar bar_;
  StageClock clock_;
  Ground ground_;
  std::vector<GroundEye> eyes_;
  std::vector<Seen> sight_;
  std::optional<AnyEye> any_;
  std::optional<EyeCount> count_;
  std::vector<std::uint8_t> gdal_values_;
  SweepCounts decided_;
};

}  // namespace

int run_viewshed(const ViewshedOptions& options) {
  return ViewshedRun(options).run();
}

}  // namespace scarp
