#include "cli/eyes_raster.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "cli/accuracy.h"
#include "cli/build/layers.h"
#include "cli/outputs.h"
#include "core/threads/parallel_for.h"

namespace scarp {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

double azimuth_rad(double degrees) {
  const double turn = std::fmod(degrees, 360);
  return (turn < 0 ? turn + 360 : turn) * kRadiansPerDegree;
}

const char* name_of_mode(ViewshedMode mode) {
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

std::size_t samples_of(const GroundGrid& grid) {
  return static_cast<std::size_t>(grid.columns()) * static_cast<std::size_t>(grid.rows());
}

bool is_empty(const SampleWindow& window) {
  return window.last_column < window.first_column || window.last_row < window.first_row;
}

SampleWindow united(const SampleWindow& a, const SampleWindow& b) {
  if (is_empty(a)) return b;
  if (is_empty(b)) return a;
  return {std::min(a.first_column, b.first_column), std::min(a.first_row, b.first_row),
          std::max(a.last_column, b.last_column), std::max(a.last_row, b.last_row)};
}

std::span<const std::uint8_t> bytes_of(std::span<const Seen> sight) {
  return {reinterpret_cast<const std::uint8_t*>(sight.data()), sight.size()};
}

}  // namespace

ViewLimits view_limits(double min_distance_m, std::optional<double> max_distance_m,
                       const DegreeRange& azimuth_deg, const DegreeRange& pitch_deg) {
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

RunEye eye_at(const TypedPosition& typed, const ViewshedOptions& options,
              const ViewSource& source) {
  return {source.place(typed, options.crs), options.target_height_m,
          view_limits(options.min_distance_m, options.max_distance_m, options.azimuth_deg,
                      options.pitch_deg),
          ""};
}

void describe_view(const ViewSource& source, const ViewshedOptions& options,
                   std::span<const RunEye> eyes, std::map<std::string, std::string>& metadata) {
  const FrameDescription& frame = source.dem().frame->description();
  // --total says how exact it is by itself.
  if (!options.total) metadata["ACCURACY"] = name_of(options.accuracy);
  metadata["MODE"] = options.total ? "total" : name_of_mode(options.mode);
  write_note(note_of(source.surface(), frame), metadata);
  metadata["HEIGHT_UNIT_OF_DEM"] = source.dem().height_unit;
  if (!options.total) {
    constexpr std::size_t kMostNamed = 32;
    std::string observers;
    for (std::size_t i = 0; i < std::min(eyes.size(), kMostNamed); ++i)
      observers += fmt::format("{}{:.10g},{:.10g},{:.3f}asl", i > 0 ? " " : "", eyes[i].at.map.x,
                               eyes[i].at.map.y, eyes[i].at.map.height_m);
    metadata["OBSERVERS"] = std::to_string(eyes.size());
    metadata["OBSERVER"] = observers;
  }
  const auto file_name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  if (source.has_obstacles()) metadata["OBSTACLES"] = file_name(options.obstacles.front());
  if (!options.observers_file.empty())
    metadata["OBSERVERS_FILE"] = file_name(options.observers_file);
  if (options.mode != ViewshedMode::kGround && options.mode != ViewshedMode::kDem)
    metadata["TARGET_HEIGHT_M"] = fmt::format("{:g}", options.target_height_m);
  if (options.min_distance_m > 0)
    metadata["MIN_DISTANCE_M"] = fmt::format("{:g}", options.min_distance_m);
  if (options.max_distance_m)
    metadata["MAX_DISTANCE_M"] = fmt::format("{:g}", *options.max_distance_m);
  if (options.azimuth_deg)
    metadata["AZIMUTH_DEG"] =
        fmt::format("{:g},{:g} clockwise from {} north", options.azimuth_deg->first,
                    options.azimuth_deg->second, frame.earth == Earth::kFlat ? "grid" : "true");
  if (options.pitch_deg)
    metadata["PITCH_DEG"] =
        fmt::format("{:g},{:g}", options.pitch_deg->first, options.pitch_deg->second);
}

EyesRaster::EyesRaster(const ViewSource& source, const ViewshedOptions& options)
    : source_(source), options_(options) {}

void EyesRaster::see(std::vector<RunEye> eyes, const Progress& progress,
                     const std::function<void(std::size_t)>& each) {
  eyes_ = std::move(eyes);
  const GroundGrid& grid = source_.samples();
  if (measures_heights()) {
    least_.emplace(grid);
    if (each) eye_heights_m_ = LargeArray<float>(samples_of(grid));
  } else {
    sight_ = LargeArray<Seen>(samples_of(grid));
  }
  if (options_.mode == ViewshedMode::kCount) count_.emplace(grid);
  // One eye that looks everywhere leaves nothing to be put together.
  const bool alone = eyes_.size() == 1 &&
                     !(eyes_[0].limits.max_distance_m < std::numeric_limits<double>::infinity());
  if (options_.mode == ViewshedMode::kVisible && !alone) any_.emplace(grid);
  const auto count = static_cast<double>(eyes_.size());
  double done = 0;
  for (const std::size_t i : order_of_eyes()) {
    see_from(eyes_[i], [&](double part) {
      if (progress) progress((done + part) / count);
    });
    if (each) each(i);
    ++done;
    if (progress) progress(done / count);
  }
  if (options_.mode == ViewshedMode::kDem) add_ground(least_->heights_m());
  // Whoever keeps the result keeps no room that is done with.
  if (any_ || count_) sight_ = LargeArray<Seen>();
  eye_heights_m_ = LargeArray<float>();
}

/// For heights the highest eyes first: they see most, and what is seen is not measured again. The
/// answer is the same in any order.
std::vector<std::size_t> EyesRaster::order_of_eyes() const {
  std::vector<std::size_t> order(eyes_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (least_)
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return eyes_[a].at.position.z_m > eyes_[b].at.position.z_m;
    });
  return order;
}

void EyesRaster::see_from(const RunEye& from, const Progress& progress) {
  const auto earth = source_.dem().frame->earth_frame();
  const ViewshedEye eye{from.at.position, from.target_height_m, from.limits};
  SweepCounts counts;
  if (least_ && eye_heights_m_.size() == 0) {
    least_->lower(source_.ground(), earth, eye, &counts);
    window_ = whole_window(source_.samples());
  } else if (least_) {
    window_ = heights_from(source_.ground(), earth, eye, eye_heights_m_.span(), &counts);
    least_->add(window_, eye_heights_m_.span());
  } else {
    window_ = view_from(source_.ground(), earth, eye, sight_.span(), &counts, progress);
    if (count_) count_->add(window_, sight_.span());
    if (any_) any_->add(window_, sight_.span());
  }
  all_window_ = united(all_window_, window_);
  decided_.add(counts);
}

std::span<const Seen> EyesRaster::seen() const {
  if (any_) return any_->seen();
  return count_ ? std::span<const Seen>() : sight_.span();
}

std::span<const std::uint32_t> EyesRaster::counts() const {
  return count_ ? count_->counts() : std::span<const std::uint32_t>();
}

std::span<const float> EyesRaster::heights_m() const {
  return least_ ? least_->heights_m() : std::span<const float>();
}

nlohmann::json EyesRaster::summary() const {
  nlohmann::json result = {{"columns", source_.samples().columns()},
                           {"rows", source_.samples().rows()},
                           {"observers", eyes_.size()}};
  if (least_) {
    const auto heights = heights_m();
    result["unknown_samples"] =
        std::count_if(heights.begin(), heights.end(), [](float h) { return std::isnan(h); });
  } else if (count_) {
    const auto is_void = [](std::uint32_t n) { return n == EyeCount::kVoid; };
    result["void_samples"] = std::count_if(counts().begin(), counts().end(), is_void);
    result["seen_samples"] = std::count_if(counts().begin(), counts().end(),
                                           [&](std::uint32_t n) { return n > 0 && !is_void(n); });
  } else {
    const SeenTotals totals = count_seen(seen());
    result["visible_samples"] = totals.visible;
    result["hidden_samples"] = totals.hidden;
    result["unknown_samples"] = totals.unknown;
  }
  return result;
}

void EyesRaster::write(const std::string& path, bool saves_memory, Existing existing) const {
  RasterLayer layer;
  LargeArray<std::uint8_t> room;
  if (least_) {
    layer = layer_of(heights_m());
  } else if (count_) {
    layer = layer_over(source_.dem(), counts(), "eyes that see it");
    layer.nodata = EyeCount::kVoid;
    layer.metadata["VALUES"] = "number of eyes that see it; 4294967295 void";
  } else {
    layer = layer_of(seen(), room);
  }
  write_layer(path, layer, eyes_, saves_memory, existing);
}

void EyesRaster::write_each(std::size_t eye, const std::string& path, bool saves_memory,
                            Existing existing) const {
  const std::span<const RunEye> eyes(&eyes_[eye], 1);
  if (least_) {
    LeastHeight alone(source_.samples());
    alone.add(window_, eye_heights_m_.span());
    if (options_.mode == ViewshedMode::kDem) add_ground(alone.heights_m());
    RasterLayer layer = layer_of(std::as_const(alone).heights_m());
    write_layer(path, layer, eyes, saves_memory, existing);
  } else {
    AnyEye alone(source_.samples());
    alone.add(window_, sight_.span());
    LargeArray<std::uint8_t> room;
    RasterLayer layer = layer_of(alone.seen(), room);
    write_layer(path, layer, eyes, saves_memory, existing);
  }
}

RasterLayer EyesRaster::areas() const {
  RasterLayer layer;
  if (count_) {
    layer = layer_over(source_.dem(), counts(), "eyes");
    layer.nodata = EyeCount::kVoid;
  } else {
    layer = layer_over(source_.dem(), bytes_of(seen()), "visible");
    layer.nodata = static_cast<double>(Seen::kUnknown);
  }
  return layer;
}

void EyesRaster::write_layer(const std::string& path, RasterLayer& layer,
                             std::span<const RunEye> eyes, bool saves_memory,
                             Existing existing) const {
  describe_view(source_, options_, eyes, layer.metadata);
  layer.saves_memory = saves_memory;
  write_geotiff_cog(path, layer, existing);
}

RasterLayer EyesRaster::layer_of(std::span<const Seen> sight,
                                 LargeArray<std::uint8_t>& room) const {
  RasterLayer layer;
  if (options_.gdal_values) {
    room = LargeArray<std::uint8_t>(sight.size());
    std::transform(sight.begin(), sight.end(), room.span().begin(),
                   [](Seen s) { return static_cast<std::uint8_t>(s == Seen::kVisible ? 255 : 0); });
    layer = layer_over(source_.dem(), std::span<const std::uint8_t>(room.span()), "visible");
    layer.metadata["VALUES"] = "255 visible, 0 hidden or unknown";
    return layer;
  }
  layer = layer_over(source_.dem(), bytes_of(sight), "visible");
  layer.nodata = 255;
  layer.colours = {{{70, 80, 96, 255}, {250, 196, 60, 255}}};
  layer.metadata["VALUES"] = "1 visible, 0 hidden, 255 unknown";
  return layer;
}

RasterLayer EyesRaster::layer_of(std::span<const float> least_m) const {
  const bool as_elevation = options_.mode == ViewshedMode::kDem;
  RasterLayer layer = layer_over(source_.dem(), least_m,
                                 as_elevation ? "least elevation seen" : "least height seen");
  layer.unit = "m";
  layer.nodata = std::numeric_limits<double>::quiet_NaN();
  layer.metadata["VALUES"] =
      as_elevation ? "least elevation at which a target is seen, rounded up; NaN unknown or out "
                     "of the limits"
                   : "least height above ground at which a target is seen, rounded up; NaN "
                     "unknown or out of the limits";
  return layer;
}

/// Heights above ground become heights above the datum of the data, rounded up.
void EyesRaster::add_ground(std::span<float> least_m) const {
  const GroundGrid& grid = source_.samples();
  const Dem& dem = source_.dem();
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

}  // namespace scarp
