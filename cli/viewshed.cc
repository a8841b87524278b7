#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/build/layers.h"
#include "cli/commands.h"
#include "cli/eyes_raster.h"
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
  DegreeRange azimuth_deg = options.azimuth_deg, pitch_deg = options.pitch_deg;
  if (record.azimuth_from_deg)
    azimuth_deg = std::pair(*record.azimuth_from_deg, *record.azimuth_to_deg);
  if (record.pitch_lowest_deg || record.pitch_highest_deg) {
    const auto otherwise = pitch_deg.value_or(std::pair(-90.0, 90.0));
    pitch_deg = std::pair(record.pitch_lowest_deg.value_or(otherwise.first),
                          record.pitch_highest_deg.value_or(otherwise.second));
  }
  eye.limits = view_limits(record.min_distance_m.value_or(options.min_distance_m),
                           record.max_distance_m ? record.max_distance_m : options.max_distance_m,
                           azimuth_deg, pitch_deg);
  eye.name = record.name;
  return eye;
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
      eyes_.push_back(eye_at(typed, options_, *source_));
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
    constexpr double kHistoryBytesPerSample = 0.15, kWorkBytes = 60e6;
    const auto budget_bytes = static_cast<double>(options_.common.memory_budget_bytes);
    const double work_bytes =
        reading_bytes + kWorkBytes + thread_count() * kHistoryBytesPerSample * samples;
    if (static_cast<double>(resident_now_bytes()) + work_bytes > budget_bytes) return false;
    scratch_.emplace(folder_of(options_.output),
                     static_cast<std::uint64_t>(budget_bytes - kWorkBytes));
    return true;
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
    const ViewLimits limits = view_limits(options_.min_distance_m, options_.max_distance_m, {}, {});
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
    describe_view(*source_, options_, {}, layer.metadata);
    layer.saves_memory = scratch_.has_value();
    write_geotiff_cog(options_.output, layer, existing(options_.common));
  }

  void see(const Progress& progress) {
    std::function<void(std::size_t)> each;
    if (!options_.each_folder.empty())
      each = [&](std::size_t i) {
        raster_->write_each(i, each_paths_[i], scratch_.has_value(), existing(options_.common));
      };
    raster_.emplace(*source_, options_).see(std::move(eyes_), progress, each);
  }

  void write() {
    if (options_.total)
      write_total();
    else
      raster_->write(options_.output, scratch_.has_value(), existing(options_.common));
    if (!options_.polygons.empty())
      write_area_polygons(options_.polygons, raster_->areas(), raster_->areas_field(),
                          existing(options_.common));
  }

  nlohmann::json summary() const {
    nlohmann::json result;
    if (options_.total) {
      result = {{"columns", source_->samples().columns()},
                {"rows", source_->samples().rows()},
                {"observers", 0},
                {"looks", looks_},
                {"exact", looks_share_ == 1}};
    } else {
      result = raster_->summary();
    }
    result["accuracy"] = name_of(options_.accuracy);
    result["output"] = options_.output;
    result["tiles"] = source_->tiles();
    result["tiles_read"] = source_->tiles_read();
    if (!options_.polygons.empty()) result["polygons"] = options_.polygons;
    return result;
  }

  void print() const {
    for (const std::string& warning : source_->dem().warnings)
      fmt::print(stderr, "scarp: warning: {}\n", warning);
    nlohmann::json result = summary();
    if (options_.common.json) {
      result["warnings"] = source_->dem().warnings;
      const SweepCounts& decided = raster_ ? raster_->decided() : decided_;
      result["decided"] = {{"targets", decided.targets},
                           {"compared_with_part", decided.traced_part},
                           {"judged_whole", decided.traced_whole}};
      result["stages"] = stages_json(stages_);
      fmt::print("{}\n", result.dump(2));
      return;
    }
    if (options_.total) {
      fmt::print("{}: ground seen from {} samples, {}\n", options_.output, areas_km2_.size(),
                 looks_share_ == 1 ? "exact" : fmt::format("from {} looks", looks_));
    } else if (!raster_->heights_m().empty()) {
      fmt::print("{}: heights of {} samples, {} unknown or out of the limits\n", options_.output,
                 raster_->heights_m().size(), result["unknown_samples"].get<std::size_t>());
    } else if (!raster_->counts().empty()) {
      fmt::print("{}: {} of {} samples seen by {} eyes\n", options_.output,
                 result["seen_samples"].get<std::size_t>(), raster_->counts().size(),
                 raster_->eyes().size());
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
  std::vector<std::string> each_paths_;    // of --each, an eye each
  LargeArray<Seen> sight_;                 // of --total, of one look
  std::optional<EyesRaster> raster_;       // of all but --total
  std::optional<SeenGround> seen_ground_;  // of --total
  std::span<const float> areas_km2_;       // in it
  std::size_t looks_ = 0;
  double looks_share_ = 1;  // of the known samples
  SweepCounts decided_;
};

}  // namespace

int run_viewshed(const ViewshedOptions& options) {
  return ViewshedRun(options).run();
}

}  // namespace scarp
