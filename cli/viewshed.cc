#include "core/viewshed/viewshed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <set>

#include "cli/build/layers.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/scratch_memory.h"
#include "cli/stages.h"
#include "cli/view_source.h"
#include "core/error/error.h"
#include "core/memory/large_array.h"
#include "core/threads/parallel_for.h"
#include "core/viewshed/seen_ground.h"
#include "ingest/observers/observers.h"
#include "tiles/layers/geopackage.h"
#include "tiles/layers/geotiff.h"

namespace scarp {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

double azimuth_rad(double degrees) {
  const double turn = std::fmod(degrees, 360);
  return (turn < 0 ? turn + 360 : turn) * kRadiansPerDegree;
}

/// One eye of the run.
struct RunEye {
  GroundEye at;
  double target_height_m = 0;
  ViewLimits limits;
  std::string name;
};

using Range = std::optional<std::pair<double, double>>;

ViewLimits limits_of(double min_distance_m, std::optional<double> max_distance_m,
                     const Range& azimuth_deg, const Range& pitch_deg) {
  ViewLimits limits;
  limits.min_distance_m = min_distance_m;
  if (max_distance_m) limits.max_distance_m = *max_distance_m;
  // A range of a whole turn has no limit; otherwise its ends would fall on each other.
  if (azimuth_deg && std::abs(azimuth_deg->second - azimuth_deg->first) < 360) {
    limits.azimuth_begin_rad = azimuth_rad(azimuth_deg->first);
    limits.azimuth_end_rad = azimuth_rad(azimuth_deg->second);
  }
  if (pitch_deg) {
    limits.min_pitch_rad = pitch_deg->first * kRadiansPerDegree;
    limits.max_pitch_rad = pitch_deg->second * kRadiansPerDegree;
  }
  return limits;
}

/// An eye from a file; the options hold for what it leaves out.
RunEye eye_of(const ObserverRecord& record, const ViewshedOptions& options,
              const ViewSource& source) {
  RunEye eye;
  const double height_m = record.height_m.value_or(TypedPosition().height_m);
  eye.at = source.place({record.x, record.y, record.elevation_m.value_or(height_m)},
                        record.elevation_m.has_value(),
                        fmt::format("{}{}{:.10g},{:.10g}", record.name,
                                    record.name.empty() ? "" : " ", record.x, record.y));
  eye.target_height_m = record.target_height_m.value_or(options.target_height_m);
  Range azimuth_deg = options.azimuth_deg, pitch_deg = options.pitch_deg;
  if (record.azimuth_from_deg)
    azimuth_deg = std::pair(*record.azimuth_from_deg, *record.azimuth_to_deg);
  if (record.pitch_lowest_deg || record.pitch_highest_deg) {
    const auto otherwise = pitch_deg.value_or(std::pair(-90.0, 90.0));
    pitch_deg = std::pair(record.pitch_lowest_deg.value_or(otherwise.first),
                          record.pitch_highest_deg.value_or(otherwise.second));
  }
  eye.limits = limits_of(record.min_distance_m.value_or(options.min_distance_m),
                         record.max_distance_m ? record.max_distance_m : options.max_distance_m,
                         azimuth_deg, pitch_deg);
  eye.name = record.name;
  return eye;
}

const char* name_of(ViewshedMode mode) {
  switch (mode) {
    case ViewshedMode::kCount:
      return "count";
    case ViewshedMode::kGround:
      return "ground";
    case ViewshedMode::kDem:
      return "dem";
    default:
      return "visible";
  }
}

/// What asks for a single eye has no place in a run for all.
void check_total(const ViewshedOptions& options) {
  const char* single = !options.observers.empty()               ? "--observer"
                       : !options.observers_file.empty()        ? "--observers"
                       : !options.each_folder.empty()           ? "--each"
                       : options.azimuth_deg                    ? "--azimuth"
                       : options.pitch_deg                      ? "--pitch"
                       : !options.polygons.empty()              ? "--polygons"
                       : options.gdal_values                    ? "--gdal-values"
                       : options.accuracy != Accuracy::kExact   ? "--accuracy"
                       : options.mode != ViewshedMode::kVisible ? "--mode"
                                                                : nullptr;
  if (single)
    throw Error(ErrorCode::kUsage,
                fmt::format("{} does not go with --total, which looks from every sample all "
                            "around; leave one of them out",
                            single));
}

/// No output may take the place of an input, or of another output.
void check_names(const ViewshedOptions& options) {
  std::vector<std::string> taken = options.sources;
  taken.insert(taken.end(), options.obstacles.begin(), options.obstacles.end());
  if (!options.observers_file.empty()) taken.push_back(options.observers_file);
  for (const std::string& file : {options.output, options.polygons}) {
    if (file.empty()) continue;
    for (const std::string& other : taken) {
      std::error_code no_file;
      if (file == other || std::filesystem::equivalent(file, other, no_file))
        throw Error(ErrorCode::kUsage,
                    fmt::format("'{}': is named twice; an output needs a name of its own", file));
    }
    taken.push_back(file);
  }
}

/// Wrong use shows before any work.
void check_options(const ViewshedOptions& options) {
  if (options.total) {
    check_total(options);
  } else if (options.observers.empty() && options.observers_file.empty()) {
    throw Error(ErrorCode::kUsage, "no eye: --observer X,Y[,H] or --observers FILE was expected");
  }
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
  if (!options.polygons.empty() &&
      (options.mode == ViewshedMode::kGround || options.mode == ViewshedMode::kDem))
    throw Error(ErrorCode::kUsage,
                "--polygons is for --mode visible and count; leave one of them out");
  check_names(options);
  for (const std::string& file : {options.output, options.polygons})
    check_new_file(file, options.common);
  if (!options.each_folder.empty() && !std::filesystem::is_directory(options.each_folder))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': is no folder; one for the rasters of --each was expected; make "
                            "it first",
                            options.each_folder));
}

/// What a run takes for each sample beyond kBytesPerGroundSample (docs/viewshed.md, "Memory").
double more_bytes_per_sample(const ViewshedOptions& options) {
  double bytes = 0;
  if (options.total) {
    bytes = 9;
  } else if (options.mode == ViewshedMode::kCount) {
    bytes = 3;
  } else if (options.mode != ViewshedMode::kVisible) {
    bytes = options.each_folder.empty() ? 2 : 6;
  }
  if (!options.obstacles.empty()) bytes += 8;  // both models are read before they are joined
  if (!options.polygons.empty()) bytes += 9;
  return bytes;
}

/// One run from options to a finished raster, a member function a stage.
class ViewshedRun {
 public:
  explicit ViewshedRun(const ViewshedOptions& options)
      : options_(options), stages_(!options.common.json) {}

  int run() {
    check_options(options_);
    stages_.run("read", [&](const Progress& progress) { read(progress); });
    stages_.run("see", [&](const Progress& progress) {
      if (options_.total)
        see_back(progress);
      else
        see(progress);
    });
    stages_.run("write", [&](const Progress&) { write(); });
    stages_.finish();
    print();
    return 0;
  }

 private:
  void read(const Progress& progress) {
    DemOptions dem = options_.dem;
    dem.memory_budget_bytes = options_.common.memory_budget_bytes;
    dem.more_bytes_per_sample = more_bytes_per_sample(options_);
    dem.make_room = [&](double samples, double reading_bytes) {
      return make_room(samples, reading_bytes);
    };
    std::optional<ViewReach> reach;
    if (options_.max_distance_m && options_.observers_file.empty() && !options_.total)
      reach = ViewReach{options_.observers, options_.crs, *options_.max_distance_m};
    source_.emplace(options_.sources, options_.obstacles, dem, progress, reach);
    source_->approximate(options_.accuracy);
    for (const TypedPosition& typed : options_.observers)
      eyes_.push_back({source_->place(typed, options_.crs), options_.target_height_m,
                       limits_of(options_.min_distance_m, options_.max_distance_m,
                                 options_.azimuth_deg, options_.pitch_deg),
                       ""});
    if (!options_.observers_file.empty()) {
      const std::string& wkt = source_->dem().frame->description().crs_wkt;
      for (const ObserverRecord& record :
           read_observers(options_.observers_file, wkt, options_.crs))
        eyes_.push_back(eye_of(record, options_, *source_));
    }
    if (!options_.each_folder.empty()) name_each();
  }

  /// Gives the raster of each eye a name of its own.
  void name_each() {
    std::set<std::string> taken;
    for (std::size_t i = 0; i < eyes_.size(); ++i) {
      std::string name = eyes_[i].name;
      for (char& c : name)
        if (c == '/' || c == '\\' || c == '\0') c = '_';
      if (name.empty() || name.front() == '.') name = fmt::format("{:04}", i + 1);
      std::string own = name;
      for (int again = 2; !taken.insert(own).second; ++again)
        own = fmt::format("{}_{}", name, again);
      each_paths_.push_back(fmt::format("{}/{}.tif", options_.each_folder, own));
      check_new_file(each_paths_.back(), options_.common);
    }
  }

  /// Puts the large arrays on the disk where memory is tight but enough for blocks.
  bool make_room(double samples, double reading_bytes) {
    if (!options_.polygons.empty()) return false;  // outlines are traced in memory
    // For each thread the history of a part, with room to spare; and what comes and goes, such as
    // pages between two reliefs and blocks that are packed.
    constexpr double kHistoryBytesPerSample = 0.15, kWorkBytes = 32e6;
    const auto budget_bytes = static_cast<double>(options_.common.memory_budget_bytes);
    const double work_bytes =
        reading_bytes + kWorkBytes + thread_count() * kHistoryBytesPerSample * samples;
    if (static_cast<double>(resident_now_bytes()) + work_bytes > budget_bytes) return false;
    scratch_.emplace(folder_of(options_.output),
                     static_cast<std::uint64_t>(budget_bytes - kWorkBytes));
    return true;
  }

  bool measures_heights() const {
    return options_.mode == ViewshedMode::kGround || options_.mode == ViewshedMode::kDem;
  }

  void see(const Progress& progress) {
    const GroundGrid& grid = source_->samples();
    const std::size_t samples =
        static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows());
    if (measures_heights()) {
      least_.emplace(grid);
      if (!options_.each_folder.empty()) eye_heights_m_ = LargeArray<float>(samples);
    } else {
      sight_ = LargeArray<Seen>(samples);
    }
    if (options_.mode == ViewshedMode::kCount) count_.emplace(grid);
    // One eye that looks everywhere leaves nothing to be put together.
    const bool alone = eyes_.size() == 1 &&
                       !(eyes_[0].limits.max_distance_m < std::numeric_limits<double>::infinity());
    if (options_.mode == ViewshedMode::kVisible && !alone) any_.emplace(grid);
    std::size_t done = 0;
    for (const std::size_t i : order_of_eyes()) {
      see_from(eyes_[i]);
      if (!options_.each_folder.empty()) write_each(i);
      if (progress) progress(static_cast<double>(++done) / static_cast<double>(eyes_.size()));
    }
  }

  /// For heights the highest eyes first: they see most, and what is seen is not measured again. The
  /// answer is the same in any order.
  std::vector<std::size_t> order_of_eyes() const {
    std::vector<std::size_t> order(eyes_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    if (least_)
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return eyes_[a].at.position.z_m > eyes_[b].at.position.z_m;
      });
    return order;
  }

  /// Looks from samples of the ground back at all places: sight is symmetric.
  void see_back(const Progress& progress) {
    const GroundGrid& grid = source_->samples();
    const auto earth = source_->dem().frame->earth_frame();
    const std::uint64_t known = count_known(grid);
    if (known == 0)
      throw Error(ErrorCode::kInput, fmt::format("'{}': no sample is known; ground was expected; "
                                                 "check --nodata and --obstacles",
                                                 options_.sources.front()));
    const std::vector<SamplePlace> places = choose_samples(grid, options_.samples, options_.seed);
    looks_ = places.size();
    looks_share_ = static_cast<double>(looks_) / static_cast<double>(known);
    sight_ = LargeArray<Seen>(static_cast<std::size_t>(grid.columns()) *
                              static_cast<std::size_t>(grid.rows()));
    SeenGround& seen = seen_ground_.emplace(grid);
    const ViewLimits limits = limits_of(options_.min_distance_m, options_.max_distance_m, {}, {});
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Position ground =
          grid.raised(places[i].column, places[i].row, options_.target_height_m);
      SweepCounts counts;
      const SampleWindow window =
          view_from(source_->ground(), earth, {ground, options_.eye_height_m, limits},
                    sight_.span(), &counts);
      seen.add(window, sight_.span(), cell_area_m2(grid, earth, places[i]));
      decided_.add(counts);
      if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(places.size()));
    }
    sight_ = LargeArray<Seen>();
    areas_km2_ = seen.finish_km2(looks_share_);
  }

  void write_total() {
    RasterLayer layer = layer_over(source_->dem(), areas_km2_, "ground seen");
    layer.unit = "km2";
    layer.nodata = std::numeric_limits<double>::quiet_NaN();
    layer.metadata["VALUES"] = "ground that is seen from here, square kilometres; NaN void";
    layer.metadata["EYE_HEIGHT_M"] = fmt::format("{:g}", options_.eye_height_m);
    layer.metadata["SAMPLES"] = std::to_string(looks_);
    layer.metadata["ACCURACY"] =
        looks_share_ == 1
            ? "exact: every known sample was looked for"
            : fmt::format(
                  "estimated from {} of {:.0f} known samples drawn at random with seed {}; "
                  "standard error at most {:.3g} % of all known ground",
                  looks_, std::round(static_cast<double>(looks_) / looks_share_), options_.seed,
                  50 / std::sqrt(static_cast<double>(looks_)));
    write_layer(options_.output, layer, 0, 0);
  }

  void see_from(const RunEye& from) {
    const auto earth = source_->dem().frame->earth_frame();
    const ViewshedEye eye{from.at.position, from.target_height_m, from.limits};
    SweepCounts counts;
    if (least_ && options_.each_folder.empty()) {
      least_->lower(source_->ground(), earth, eye, &counts);
    } else if (least_) {
      window_ = heights_from(source_->ground(), earth, eye, eye_heights_m_.span(), &counts);
      least_->add(window_, eye_heights_m_.span());
    } else {
      window_ = view_from(source_->ground(), earth, eye, sight_.span(), &counts);
      if (count_) count_->add(window_, sight_.span());
      if (any_) any_->add(window_, sight_.span());
    }
    decided_.add(counts);
  }

  /// The raster of the eye that was last seen from.
  void write_each(std::size_t i) {
    const std::string& path = each_paths_[i];
    if (least_) {
      LeastHeight alone(source_->samples());
      alone.add(window_, eye_heights_m_.span());
      write_heights(path, alone.heights_m(), i, i + 1);
    } else {
      AnyEye alone(source_->samples());
      alone.add(window_, sight_.span());
      write_values(path, alone.seen(), i, i + 1);
    }
  }

  std::span<const Seen> seen() const { return any_ ? any_->seen() : sight_.span(); }

  void write() {
    if (options_.total) {
      write_total();
    } else if (least_) {
      write_heights(options_.output, least_->heights_m(), 0, eyes_.size());
    } else if (count_) {
      RasterLayer layer = layer_over(source_->dem(), count_->counts(), "eyes that see it");
      layer.nodata = EyeCount::kVoid;
      layer.metadata["VALUES"] = "number of eyes that see it; 4294967295 void";
      write_layer(options_.output, layer, 0, eyes_.size());
    } else {
      write_values(options_.output, seen(), 0, eyes_.size());
    }
    if (!options_.polygons.empty()) write_polygons();
  }

  void write_polygons() const {
    RasterLayer layer;
    if (count_) {
      layer = layer_over(source_->dem(), count_->counts(), "eyes");
      layer.nodata = EyeCount::kVoid;
    } else {
      const std::span<const Seen> sight = seen();
      layer = layer_over(source_->dem(),
                         std::span<const std::uint8_t>(
                             reinterpret_cast<const std::uint8_t*>(sight.data()), sight.size()),
                         "visible");
      layer.nodata = static_cast<double>(Seen::kUnknown);
    }
    write_area_polygons(options_.polygons, layer, count_ ? "eyes" : "visible",
                        existing(options_.common));
  }

  void write_layer(const std::string& path, RasterLayer& layer, std::size_t first,
                   std::size_t end) const {
    describe(layer.metadata, first, end);
    layer.saves_memory = scratch_.has_value();
    write_geotiff_cog(path, layer, existing(options_.common));
  }

  /// @param first, end  the eyes that the raster is of
  void write_values(const std::string& path, std::span<const Seen> sight, std::size_t first,
                    std::size_t end) {
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(sight.data()),
                                              sight.size());
    RasterLayer layer;
    if (options_.gdal_values) {
      gdal_values_ = LargeArray<std::uint8_t>(bytes.size());
      std::transform(sight.begin(), sight.end(), gdal_values_.span().begin(), [](Seen s) {
        return static_cast<std::uint8_t>(s == Seen::kVisible ? 255 : 0);
      });
      layer =
          layer_over(source_->dem(), std::span<const std::uint8_t>(gdal_values_.span()), "visible");
      layer.metadata["VALUES"] = "255 visible, 0 hidden or unknown";
    } else {
      layer = layer_over(source_->dem(), bytes, "visible");
      layer.nodata = 255;
      layer.colours = {{{70, 80, 96, 255}, {250, 196, 60, 255}}};
      layer.metadata["VALUES"] = "1 visible, 0 hidden, 255 unknown";
    }
    write_layer(path, layer, first, end);
  }

  void write_heights(const std::string& path, std::span<float> least_m, std::size_t first,
                     std::size_t end) {
    const bool as_elevation = options_.mode == ViewshedMode::kDem;
    if (as_elevation) add_ground(least_m);
    RasterLayer layer = layer_over(source_->dem(), std::span<const float>(least_m),
                                   as_elevation ? "least elevation seen" : "least height seen");
    layer.unit = "m";
    layer.nodata = std::numeric_limits<double>::quiet_NaN();
    layer.metadata["VALUES"] =
        as_elevation ? "least elevation at which a target is seen, rounded up; NaN unknown or out "
                       "of the limits"
                     : "least height above ground at which a target is seen, rounded up; NaN "
                       "unknown or out of the limits";
    write_layer(path, layer, first, end);
  }

  /// Heights above ground become heights above the datum of the data, rounded up.
  void add_ground(std::span<float> least_m) const {
    const GroundGrid& grid = source_->samples();
    const Dem& dem = source_->dem();
    const bool has_geoid = !dem.frame->description().geoid_file.empty();
    parallel_for(static_cast<std::size_t>(grid.rows()), [&](std::size_t r) {
      const auto row = static_cast<std::int32_t>(r);
      const std::optional<GeoFrame::Placer> placer =
          has_geoid ? std::optional<GeoFrame::Placer>(std::in_place, *dem.frame) : std::nullopt;
      for (std::int32_t c = 0; c < grid.columns(); ++c) {
        float& at =
            least_m[r * static_cast<std::size_t>(grid.columns()) + static_cast<std::size_t>(c)];
        if (std::isnan(at)) continue;
        const double elevation_m = grid.height_m(c, row) + at -
                                   (placer ? placer->undulation_m(dem.x_of(c), dem.y_of(row)) : 0);
        const auto rounded = static_cast<float>(elevation_m);
        at = rounded < elevation_m ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                                   : rounded;
      }
    });
  }

  /// What the run was, for whoever opens the raster.
  void describe(std::map<std::string, std::string>& metadata, std::size_t first,
                std::size_t end) const {
    const FrameDescription& frame = source_->dem().frame->description();
    constexpr std::size_t kMostNamed = 32;
    std::string observers;
    for (std::size_t i = first; i < std::min(end, first + kMostNamed); ++i)
      observers += fmt::format("{}{:.10g},{:.10g},{:.3f}asl", i > first ? " " : "",
                               eyes_[i].at.map.x, eyes_[i].at.map.y, eyes_[i].at.map.height_m);
    // --total says how exact it is by itself.
    if (!options_.total) metadata["ACCURACY"] = name_of(options_.accuracy);
    metadata["MODE"] = options_.total ? "total" : name_of(options_.mode);
    write_note(note_of(source_->surface(), frame), metadata);
    metadata["HEIGHT_UNIT_OF_DEM"] = source_->dem().height_unit;
    if (!options_.total) {
      metadata["OBSERVERS"] = std::to_string(end - first);
      metadata["OBSERVER"] = observers;
    }
    if (source_->has_obstacles())
      metadata["OBSTACLES"] = std::filesystem::path(options_.obstacles.front()).filename().string();
    if (!options_.observers_file.empty())
      metadata["OBSERVERS_FILE"] =
          std::filesystem::path(options_.observers_file).filename().string();
    if (!measures_heights())
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
                             {"tiles", source_->tiles()},
                             {"tiles_read", source_->tiles_read()},
                             {"columns", source_->samples().columns()},
                             {"rows", source_->samples().rows()},
                             {"observers", eyes_.size()},
                             {"accuracy", name_of(options_.accuracy)}};
    if (!options_.polygons.empty()) result["polygons"] = options_.polygons;
    if (options_.total) {
      result["looks"] = looks_;
      result["exact"] = looks_share_ == 1;
    } else if (least_) {
      const auto heights_m = least_->heights_m();
      result["unknown_samples"] =
          std::count_if(heights_m.begin(), heights_m.end(), [](float h) { return std::isnan(h); });
    } else if (count_) {
      const auto counts = count_->counts();
      const auto is_void = [](std::uint32_t n) { return n == EyeCount::kVoid; };
      result["void_samples"] = std::count_if(counts.begin(), counts.end(), is_void);
      result["seen_samples"] = std::count_if(counts.begin(), counts.end(),
                                             [&](std::uint32_t n) { return n > 0 && !is_void(n); });
    } else {
      const SeenTotals totals = count_seen(seen());
      result["visible_samples"] = totals.visible;
      result["hidden_samples"] = totals.hidden;
      result["unknown_samples"] = totals.unknown;
    }
    return result;
  }

  void print() const {
    for (const std::string& warning : source_->dem().warnings)
      fmt::print(stderr, "scarp: warning: {}\n", warning);
    nlohmann::json result = summary();
    if (options_.common.json) {
      result["warnings"] = source_->dem().warnings;
      result["decided"] = {{"targets", decided_.targets},
                           {"compared_with_part", decided_.traced_part},
                           {"judged_whole", decided_.traced_whole}};
      result["stages"] = stages_json(stages_);
      fmt::print("{}\n", result.dump(2));
      return;
    }
    if (options_.total) {
      fmt::print("{}: ground seen from {} samples, {}\n", options_.output, areas_km2_.size(),
                 looks_share_ == 1 ? "exact" : fmt::format("from {} looks", looks_));
    } else if (least_) {
      fmt::print("{}: heights of {} samples, {} unknown or out of the limits\n", options_.output,
                 least_->heights_m().size(), result["unknown_samples"].get<std::size_t>());
    } else if (count_) {
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
  Stages stages_;
  std::optional<ScratchMemory> scratch_;  // holds what follows, where it is used
  std::optional<ViewSource> source_;
  std::vector<RunEye> eyes_;
  std::vector<std::string> each_paths_;  // of --each, an eye each
  LargeArray<Seen> sight_;
  std::optional<AnyEye> any_;
  std::optional<EyeCount> count_;
  std::optional<LeastHeight> least_;
  std::optional<SeenGround> seen_ground_;  // of --total
  std::span<const float> areas_km2_;       // in it
  std::size_t looks_ = 0;
  double looks_share_ = 1;  // of the known samples
  LargeArray<float> eye_heights_m_;
  SampleWindow window_;  // of the eye last seen from
  LargeArray<std::uint8_t> gdal_values_;
  SweepCounts decided_;
};

}  // namespace

int run_viewshed(const ViewshedOptions& options) {
  return ViewshedRun(options).run();
}

}  // namespace scarp
