#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/build/layers.h"
#include "cli/commands.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/stages.h"
#include "core/error/error.h"
#include "core/geodesy/sun.h"
#include "core/skyline/crossing_kernels.h"
#include "core/skyline/sky_view.h"
#include "core/skyline/skyline.h"
#include "tiles/layers/block_raster.h"
#include "tiles/layers/geotiff.h"

namespace scarp {
namespace {

static_assert(Skyline::kPartSide == BlockRaster::kSide);

constexpr int kAzimuthsOfAll = 16;
constexpr double kRadiansPerDegree = std::numbers::pi / 180;

/// Bytes a sample: the ground twice and its strips, with the padding of small ones.
constexpr double kGroundBytes = 9.5;
/// Of a band in work: its first overview.
constexpr double kOverviewShare = 0.25;
/// Of a raster of one band, which is packed in memory.
constexpr double kPackedShare = 1.4;

/// Wrong use shows before any work.
void check_options(const HorizonOptions& options) {
  for (const std::string& source : options.sources)
    if (is_scene(source))
      throw Error(ErrorCode::kUsage,
                  fmt::format("'{}': is a scene; DEM files were expected for the horizons of all "
                              "points; for one place give --at X,Y",
                              source));
  const bool wants_more = !options.distance_output.empty() || !options.sky_view_output.empty() ||
                          !options.openness_output.empty() ||
                          !options.negative_openness_output.empty();
  if (options.output.empty() && !wants_more)
    throw Error(ErrorCode::kUsage,
                "neither a place nor an output: --at X,Y[,H], or -o OUT.tif for all points, was "
                "expected");
  if (!options.output.empty() && !options.output.ends_with(".tif") &&
      !options.output.ends_with(".tiff"))
    throw Error(ErrorCode::kUsage,
                fmt::format("'{}': a name that ends in .tif was expected for the horizons of all "
                            "points; for one place give --at X,Y",
                            options.output));
  if (!options.crs.empty())
    throw Error(ErrorCode::kUsage, "--crs is for --at; leave it out, or give a place");
  if (options.sun_days && (wants_more || options.azimuths || options.eye_height_m > 0 ||
                           options.estimate_only || options.output.empty()))
    throw Error(ErrorCode::kUsage,
                "--sun makes the raster of -o and goes with --overwrite, --json and the options of "
                "the surface; leave the others out");
  std::vector<std::string> outputs = {options.output, options.distance_output,
                                      options.sky_view_output, options.openness_output,
                                      options.negative_openness_output};
  std::erase_if(outputs, [](const std::string& path) { return path.empty(); });
  std::sort(outputs.begin(), outputs.end());
  if (const auto twice = std::adjacent_find(outputs.begin(), outputs.end()); twice != outputs.end())
    throw Error(
        ErrorCode::kUsage,
        fmt::format("'{}': is asked for twice; each output needs a name of its own", *twice));
  for (const std::string& path : outputs) check_new_file(path, options.common);
}

/// TIFF counts bands in 16 bits.
constexpr std::size_t kMostBands = 65'535;

/// One run from options to finished rasters, a member function a stage.
class AllHorizonsRun {
 public:
  explicit AllHorizonsRun(const HorizonOptions& options)
      : options_(options),
        azimuths_(options.azimuths.value_or(kAzimuthsOfAll)),
        stages_(!options.common.json) {}

  int run() {
    check_options(options_);
    check_bands();
    stages_.run("read", [&](const Progress& progress) { read(progress); });
    if (options_.sun_days) {
      stages_.run("shadow", [&](const Progress&) { shade(); });
      stages_.run("write", [&](const Progress&) { write_shadow(); });
    } else {
      check_memory();
      open_outputs();
      stages_.run("look", [&](const Progress& progress) { look(progress); });
      stages_.run("write", [&](const Progress&) { write(); });
    }
    stages_.finish();
    print();
    return 0;
  }

 private:
  void read(const Progress& progress) {
    DemOptions dem = options_.dem;
    dem.memory_budget_bytes = options_.common.memory_budget_bytes;
    ground_ = read_ground(options_.sources, dem, progress);
    samples_ = static_cast<std::size_t>(ground_.grid.columns()) *
               static_cast<std::size_t>(ground_.grid.rows());
    earth_ = ground_.dem.frame->earth_frame();
    if (const double side_m = cell_side_m(ground_.grid); side_m < kLeastCellM)
      throw Error(ErrorCode::kInput,
                  fmt::format("'{}': cells are {:.2g} m wide; at least {} m were expected; if they "
                              "are in degrees, give the data a CRS",
                              options_.sources.front(), side_m, kLeastCellM));
    if (options_.sun_days && !earth_)
      throw Error(
          ErrorCode::kInput,
          fmt::format("'{}': --sun wants data with a CRS and --earth ellipsoid, because the "
                      "sun's place depends on where they are",
                      options_.sources.front()));
  }

  bool has_bounds() const {
    return !options_.estimate_only && horizon_accuracy(options_.accuracy).has_bounds;
  }
  std::size_t bands_per_azimuth() const { return has_bounds() ? 3 : 1; }
  double tolerance_deg() const {
    return options_.tolerance_deg.value_or(horizon_accuracy(options_.accuracy).tolerance_deg);
  }

  void check_bands() const {
    const std::size_t bands =
        static_cast<std::size_t>(azimuths_) * (options_.output.empty() ? 1 : bands_per_azimuth());
    const bool has_bands = !options_.output.empty() || !options_.distance_output.empty();
    if (has_bands && bands > kMostBands)
      throw Error(
          ErrorCode::kUsage,
          fmt::format("--azimuths {}: {} bands; at most {} were expected, which is what TIFF "
                      "can hold; give fewer",
                      azimuths_, bands, kMostBands));
  }

  void check_memory() const {
    double bytes = kGroundBytes;
    if (!options_.output.empty())
      bytes += kOverviewShare * static_cast<double>(bands_per_azimuth()) * sizeof(std::int16_t);
    if (!options_.distance_output.empty()) bytes += kOverviewShare * sizeof(float);
    if (!options_.sky_view_output.empty()) bytes += kPackedShare * sizeof(float);
    if (!options_.openness_output.empty() || !options_.negative_openness_output.empty())
      bytes += kPackedShare * sizeof(float) + sizeof(std::uint16_t);
    bytes *= static_cast<double>(samples_);
    const auto budget = static_cast<double>(options_.common.memory_budget_bytes);
    if (bytes > budget)
      throw Error(ErrorCode::kResource,
                  fmt::format("{} samples: about {:.2f} GiB of memory were needed, {:.2f} GiB are "
                              "allowed; give fewer outputs, a part of the DEM or more --memory",
                              samples_, bytes / 0x1p30, budget / 0x1p30));
  }

  double azimuth_deg(std::size_t i) const { return 360.0 * static_cast<double>(i) / azimuths_; }

  /// What grows on the disk. Missing folders and too little room show here.
  void open_outputs() {
    if (!options_.output.empty())
      horizons_.emplace(options_.output, horizon_layer(), existing(options_.common));
    if (!options_.distance_output.empty())
      distances_.emplace(options_.distance_output, distance_layer(), existing(options_.common));
  }

  void look(const Progress& progress) {
    const bool wants_down = !options_.negative_openness_output.empty();
    const bool wants_up = !options_.output.empty() || !options_.distance_output.empty() ||
                          !options_.sky_view_output.empty() || !options_.openness_output.empty();
    const double passes = (wants_up ? 1 : 0) + (wants_down ? 1 : 0);
    const auto part_of = [&](double from) {
      return [&progress, from, passes](double share) {
        if (progress) progress((from + share) / passes);
      };
    };
    if (wants_up) {
      if (!options_.sky_view_output.empty() || !options_.openness_output.empty())
        sky_.emplace(ground_.grid.columns(), ground_.grid.rows(), !options_.sky_view_output.empty(),
                     !options_.openness_output.empty());
      look_up(part_of(0));
    }
    if (!wants_down) return;
    nadir_.emplace(ground_.grid.columns(), ground_.grid.rows(), false, true);
    look_down(part_of(wants_up ? 1 : 0));
  }

  SkylineOptions skyline_options(Sight sight) const {
    SkylineOptions look;
    look.eye_height_m = options_.eye_height_m;
    look.tolerance_rad = tolerance_deg() * kRadiansPerDegree;
    look.sight = sight;
    return look;
  }

  /// Azimuth by azimuth; parts go to their places in the outputs as they are found.
  void look_up(const Progress& progress) {
    Skyline skyline(ground_.grid, earth_, skyline_options(Sight::kUp));
    double done = 0;
    for (const std::size_t i : in_order(skyline)) {
      const std::size_t kinds = horizons_ ? bands_per_azimuth() : 0;
      for (std::size_t kind = 0; kind < kinds; ++kind) horizons_->begin(i * kinds + kind);
      if (distances_) distances_->begin(i);
      if (sky_) sky_->begin_azimuth();
      skyline.look(azimuth(i), distances_.has_value(), [&](const SkylinePart& part) {
        const auto write = [&](BlockRaster& to, std::size_t band, const auto& samples) {
          to.write(band, part.first_column, part.first_row, part.columns, part.rows,
                   std::as_bytes(samples));
        };
        const std::array kind_samples = {part.estimate, part.lower, part.upper};
        for (std::size_t kind = 0; kind < kinds; ++kind)
          write(*horizons_, i * kinds + kind, kind_samples[kind]);
        if (distances_) write(*distances_, i, part.distance_m);
        if (sky_) sky_->add(part);
      });
      if (horizons_) horizons_->finish(i * kinds, kinds);
      if (distances_) distances_->finish(i, 1);
      progress(++done / azimuths_);
    }
  }

  void look_down(const Progress& progress) {
    Skyline skyline(ground_.grid, earth_, skyline_options(Sight::kDown));
    double done = 0;
    for (const std::size_t i : in_order(skyline)) {
      nadir_->begin_azimuth();
      skyline.look(azimuth(i), false, [&](const SkylinePart& part) { nadir_->add(part); });
      progress(++done / azimuths_);
    }
  }

  AzimuthAt azimuth(std::size_t i) const {
    return fixed_azimuth(azimuth_deg(i) * kRadiansPerDegree);
  }

  /// Azimuths that march alike one after the other.
  std::vector<std::size_t> in_order(const Skyline& skyline) const {
    std::vector<std::size_t> order, later;
    for (std::size_t i = 0; i < static_cast<std::size_t>(azimuths_); ++i) {
      const March march = skyline.march_for(azimuth(i));
      (march == March::kOverRows ? order : later).push_back(i);
    }
    order.insert(order.end(), later.begin(), later.end());
    return order;
  }

  void shade() {
    light_.resize(samples_);
    judged_ = cast_shadow(ground_.grid, earth_, sun_direction(*options_.sun_days), light_);
  }

  RasterLayer horizon_layer() const {
    static constexpr std::array<const char*, 3> kKinds = {"estimate", "lower", "upper"};
    const auto name = [&](std::size_t i) {
      return fmt::format("azimuth {:.10g} {}", azimuth_deg(i / bands_per_azimuth()),
                         kKinds[i % bands_per_azimuth()]);
    };
    const std::span<const std::int16_t> none;
    RasterLayer layer = layer_over(ground_.dem, none, name(0));
    const std::size_t bands = static_cast<std::size_t>(azimuths_) * bands_per_azimuth();
    for (std::size_t i = 1; i < bands; ++i) layer.more_bands.push_back({name(i), none});
    layer.unit = "degree";
    layer.scale = 0.01;
    layer.nodata = kUnknownElevation;
    layer.metadata["VALUES"] =
        "elevation of the horizon above the level plane of the eye, steps of 0.01 degree; -9000 "
        "no ground that way; -32768 unknown";
    add_metadata(layer);
    return layer;
  }

  RasterLayer distance_layer() const {
    const auto name = [&](std::size_t i) { return fmt::format("azimuth {:.10g}", azimuth_deg(i)); };
    const std::span<const float> none;
    RasterLayer layer = layer_over(ground_.dem, none, name(0));
    for (std::size_t i = 1; i < static_cast<std::size_t>(azimuths_); ++i)
      layer.more_bands.push_back({name(i), none});
    layer.unit = "m";
    layer.nodata = std::numeric_limits<double>::quiet_NaN();
    layer.metadata["VALUES"] = "distance of the estimated horizon along the ground; NaN unknown";
    add_metadata(layer);
    return layer;
  }

  void write() {
    if (horizons_) horizons_->commit();
    if (distances_) distances_->commit();
    if (!options_.sky_view_output.empty()) {
      RasterLayer layer = layer_over(ground_.dem, sky_->sky_view(), "sky view factor");
      write_floats(options_.sky_view_output, layer,
                   "sky view factor of a level surface: mean of cos^2 of the horizon's elevation, "
                   "at least 0 (Dozier and Frew 1990)");
    }
    if (!options_.openness_output.empty()) {
      RasterLayer layer = layer_over(ground_.dem, sky_->openness_deg(), "positive openness");
      layer.unit = "degree";
      write_floats(options_.openness_output, layer,
                   "positive openness: mean zenith angle of the horizon (Yokoyama et al. 2002), no "
                   "limit of distance");
    }
    if (nadir_) {
      RasterLayer layer = layer_over(ground_.dem, nadir_->openness_deg(), "negative openness");
      layer.unit = "degree";
      write_floats(options_.negative_openness_output, layer,
                   "negative openness: mean nadir angle of the ground seen lowest (Yokoyama et al. "
                   "2002), no limit of distance");
    }
  }

  void write_floats(const std::string& path, RasterLayer& layer, const std::string& values) {
    layer.nodata = std::numeric_limits<double>::quiet_NaN();
    layer.metadata["VALUES"] = values + "; NaN unknown";
    write_layer(path, layer);
  }

  void write_shadow() {
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(light_.data()),
                                              light_.size());
    RasterLayer layer = layer_over(ground_.dem, bytes, "lit");
    layer.nodata = 255;
    layer.colours = {{{48, 56, 78, 255}, {255, 226, 140, 255}}};
    layer.metadata["VALUES"] =
        "1 lit, 0 in the shadow of other ground or of the Earth, 255 unknown";
    layer.metadata["SUN"] = options_.sun_text;
    layer.metadata["SUN_MODEL"] =
        "a point without parallax (Meeus 1998, 0.01 degree), raised by refraction as at 10 degrees "
        "Celsius and 1010 hPa (Saemundsson 1986)";
    const Position middle = ground_.grid.at(ground_.grid.columns() / 2, ground_.grid.rows() / 2);
    const Bearing sun = EyeBearings(middle, earth_).to_far(sun_direction(*options_.sun_days));
    layer.metadata["SUN_AZIMUTH_DEG"] = fmt::format("{:.4f}", sun.azimuth_rad / kRadiansPerDegree);
    layer.metadata["SUN_ELEVATION_DEG"] =
        fmt::format("{:.4f}", refracted_elevation_rad(sun.pitch_rad) / kRadiansPerDegree);
    write_layer(options_.output, layer);
  }

  /// With what the run was, for whoever opens the raster.
  void write_layer(const std::string& path, RasterLayer& layer) const {
    add_metadata(layer);
    write_geotiff_cog(path, layer, existing(options_.common));
  }

  void add_metadata(RasterLayer& layer) const {
    const FrameDescription& frame = ground_.dem.frame->description();
    std::map<std::string, std::string>& metadata = layer.metadata;
    write_note(note_of("grid", frame), metadata);
    metadata["HEIGHT_UNIT_OF_DEM"] = ground_.dem.height_unit;
    if (!options_.sun_days) {
      metadata["AZIMUTHS"] = fmt::format("{} from {} north clockwise", azimuths_,
                                         frame.earth == Earth::kFlat ? "grid" : "true");
      metadata["EYE_HEIGHT_M"] = fmt::format("{:g}", options_.eye_height_m);
      metadata["TOLERANCE_DEG"] = fmt::format("{:g}", tolerance_deg());
      metadata["ACCURACY"] = name_of(options_.accuracy);
    }
  }

  nlohmann::json summary() const {
    nlohmann::json result = {{"columns", ground_.grid.columns()},
                             {"rows", ground_.grid.rows()},
                             {"warnings", ground_.dem.warnings}};
    if (options_.sun_days) {
      const auto samples_with = [&](Sunlight value) {
        return std::count(light_.begin(), light_.end(), value);
      };
      result["lit_samples"] = samples_with(Sunlight::kLit);
      result["shadow_samples"] = samples_with(Sunlight::kShadow);
      result["unknown_samples"] = samples_with(Sunlight::kUnknown);
      result["judged_samples"] = judged_;
    } else {
      result["azimuths"] = azimuths_;
      result["accuracy"] = name_of(options_.accuracy);
    }
    for (const auto& [name, path] :
         {std::pair("output", options_.output), std::pair("distance", options_.distance_output),
          std::pair("sky_view", options_.sky_view_output),
          std::pair("openness", options_.openness_output),
          std::pair("negative_openness", options_.negative_openness_output)})
      if (!path.empty()) result[name] = path;
    result["stages"] = stages_json(stages_);
    return result;
  }

  void print() const {
    for (const std::string& warning : ground_.dem.warnings)
      fmt::print(stderr, "scarp: warning: {}\n", warning);
    const nlohmann::json result = summary();
    if (options_.common.json) {
      fmt::print("{}\n", result.dump(2));
      return;
    }
    if (options_.sun_days) {
      fmt::print("{}: {} samples lit, {} in shadow, {} unknown\n", options_.output,
                 result["lit_samples"].get<std::size_t>(),
                 result["shadow_samples"].get<std::size_t>(),
                 result["unknown_samples"].get<std::size_t>());
      return;
    }
    for (const auto& [path, what] :
         {std::pair(options_.output, "horizons"), std::pair(options_.distance_output, "distances"),
          std::pair(options_.sky_view_output, "sky view factors"),
          std::pair(options_.openness_output, "openness"),
          std::pair(options_.negative_openness_output, "negative openness")})
      if (!path.empty())
        fmt::print("{}: {} of {} samples in {} directions\n", path, what, samples_, azimuths_);
  }

  const HorizonOptions& options_;
  const int azimuths_;
  Stages stages_;
  Ground ground_;
  std::size_t samples_ = 0;
  std::optional<EarthFrame> earth_;
  std::optional<BlockRaster> horizons_;  ///< azimuth by azimuth: estimate, lower, upper
  std::optional<BlockRaster> distances_;
  std::optional<SkyView> sky_, nadir_;
  std::vector<Sunlight> light_;
  std::size_t judged_ = 0;
};

}  // namespace

int run_all_horizons(const HorizonOptions& options) {
  return AllHorizonsRun(options).run();
}

}  // namespace scarp
