#include "cli/serve/served_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/outputs.h"
#include "cli/serve/request_target.h"
#include "core/error/error.h"
#include "core/threads/stop.h"

namespace scarp {
namespace {

constexpr char kLonLat[] = "OGC:CRS84";

/// Pixels of a map around the data, so that its border is drawn whole.
constexpr double kCellsAround = 2;

/// What the file or folder is called, for commands that clients are shown; never where it lies.
std::string file_name_of(const std::string& source, const std::string& name) {
  std::filesystem::path path(source);
  if (path.filename().empty()) path = path.parent_path();
  const std::string file = path.filename().string();
  return is_utf8(file) ? file : name;
}

/// Of a cell in the middle, in the frame's plane, which is close to the ground there.
double cell_size_m(const GroundGrid& grid) {
  const std::int32_t c = grid.columns() / 2, r = grid.rows() / 2;
  const Position here = grid.at(c, r), left = grid.at(c - 1, r), above = grid.at(c, r - 1);
  const double across_m = std::hypot(here.x_m - left.x_m, here.y_m - left.y_m);
  const double down_m = std::hypot(here.x_m - above.x_m, here.y_m - above.y_m);
  return std::sqrt(across_m * down_m);
}

}  // namespace

ServedScene::ServedScene(std::string name, const std::string& path, const DemOptions& dem)
    : name_(std::move(name)), path_(path), is_scene_(scarp::is_scene(path)), dem_options_(dem) {
  source_ = std::make_shared<const ViewSource>(std::vector{path}, std::vector<std::string>(),
                                               is_scene_ ? DemOptions() : dem, Progress());
  const FrameDescription& frame = source_->dem().frame->description();
  if (frame.crs_wkt.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': has no coordinate system; a map needs one; assign it with "
                            "gdal_edit.py -a_srs",
                            path));
  dem_options_.refraction = frame.refraction;
  from_lon_lat_.emplace(kLonLat, frame.crs_wkt);
  cell_m_ = cell_size_m(source_->samples());
  find_bounds();
  const double around_m = kCellsAround * cell_m_ *
                          std::max(std::cosh(to_mercator({0, bounds_[1]}).y_m / kMercatorRadiusM),
                                   std::cosh(to_mercator({0, bounds_[3]}).y_m / kMercatorRadiusM));
  const MercatorPoint low = to_mercator({bounds_[0], bounds_[1]});
  const MercatorPoint high = to_mercator({bounds_[2], bounds_[3]});
  map_.emplace(
      MercatorBox{low.x_m - around_m, low.y_m - around_m, high.x_m + around_m, high.y_m + around_m},
      cell_m_, [&](const LonLat& at) { return place_of(at); });
  heights_.emplace(*source_);
}

/// From the border of the raster, looked at in many places.
void ServedScene::find_bounds() {
  constexpr int kParts = 32;
  // Beyond, the map has no tiles.
  constexpr double kMostLatitude = 85;
  const Dem& dem = source_->dem();
  bounds_ = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (int i = 0; i <= kParts; ++i) {
    for (int k = 0; k <= kParts; ++k) {
      const double x = dem.geotransform[0] + dem.geotransform[1] * dem.columns * i / kParts;
      const double y = dem.geotransform[3] + dem.geotransform[5] * dem.rows * k / kParts;
      const auto at = lon_lat_of(x, y);
      if (!at) continue;
      const double latitude = std::clamp(at->latitude_deg, -kMostLatitude, kMostLatitude);
      bounds_ = {std::min(bounds_[0], at->longitude_deg), std::min(bounds_[1], latitude),
                 std::max(bounds_[2], at->longitude_deg), std::max(bounds_[3], latitude)};
    }
  }
  if (!(bounds_[0] < bounds_[2] && bounds_[1] < bounds_[3]))
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': its coordinate system cannot be converted to longitude and "
                            "latitude; a map needs that; warp it with gdalwarp -t_srs",
                            path_));
}

std::shared_ptr<const ViewSource> ServedScene::source(std::optional<double> asked,
                                                      Accuracy accuracy) const {
  const double refraction = asked.value_or(dem_options_.refraction);
  if (is_scene_ && refraction != dem_options_.refraction)
    throw Error(ErrorCode::kInput,
                fmt::format("refraction {:g}: scene '{}' was built with {:g}, which holds for all "
                            "that is asked of it; leave refraction out, or ask its DEM",
                            refraction, name_, dem_options_.refraction));
  if (refraction == dem_options_.refraction && accuracy == Accuracy::kExact) return source_;
  const std::scoped_lock lock(frames_mutex_);
  const auto found = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) {
    return frame.refraction == refraction && frame.accuracy == accuracy;
  });
  if (found != frames_.end()) {
    frames_.splice(frames_.begin(), frames_, found);
    return frames_.front().source;
  }
  // Others will use it as well: no matter who leaves meanwhile, it is read to its end.
  const StopAsked never;
  const StopScope scope(never);
  DemOptions options = is_scene_ ? DemOptions() : dem_options_;
  if (!is_scene_) options.refraction = refraction;
  const auto source = std::make_shared<ViewSource>(std::vector{path_}, std::vector<std::string>(),
                                                   options, Progress());
  source->approximate(accuracy);
  frames_.push_front({refraction, accuracy, source});
  if (frames_.size() > kFrames) frames_.pop_back();
  return source;
}

TypedPosition ServedScene::in_data(const TypedPosition& lon_lat) const {
  std::optional<MapPoint> at;
  {
    const std::scoped_lock lock(conversion_mutex_);
    at = from_lon_lat_->forwards({lon_lat.x, lon_lat.y, 0});
  }
  if (!at)
    throw Error(ErrorCode::kInput,
                fmt::format("position '{}': has no place in the coordinate system of '{}'; "
                            "longitude and latitude in degrees were expected, in this order",
                            lon_lat.text, name_));
  TypedPosition position = lon_lat;
  position.x = at->x;
  position.y = at->y;
  return position;
}

std::optional<LonLat> ServedScene::lon_lat_of(double x, double y) const {
  const std::scoped_lock lock(conversion_mutex_);
  const auto at = from_lon_lat_->back({x, y, 0});
  if (!at) return {};
  return LonLat{at->x, at->y};
}

std::optional<std::pair<double, double>> ServedScene::place_of(const LonLat& at) const {
  std::optional<MapPoint> point;
  {
    const std::scoped_lock lock(conversion_mutex_);
    point = from_lon_lat_->forwards({at.longitude_deg, at.latitude_deg, 0});
  }
  if (!point) return {};
  const Dem& dem = source_->dem();
  double x = point->x;
  if (dem.frame->is_geographic()) {
    // The data may count longitudes on the other side of the antimeridian.
    const double middle = dem.x_of(dem.columns / 2.0);
    x += 360 * std::round((middle - x) / 360);
  }
  return std::pair((x - dem.geotransform[0]) / dem.geotransform[1] - 0.5,
                   (point->y - dem.geotransform[3]) / dem.geotransform[5] - 0.5);
}

std::optional<double> ServedScene::ground_m(const LonLat& at) const {
  const auto place = place_of(at);
  if (!place) return {};
  const HeightPyramid::Level& level = heights_->levels()[0];
  const auto [column, row] = *place;
  if (!(column >= 0 && row >= 0 && column <= level.columns - 1 && row <= level.rows - 1)) return {};
  const auto c = static_cast<std::int32_t>(column), r = static_cast<std::int32_t>(row);
  double height_m = 0;
  for (const std::int32_t down : {0, 1}) {
    for (const std::int32_t right : {0, 1}) {
      const double share =
          (right ? column - c : 1 - (column - c)) * (down ? row - r : 1 - (row - r));
      if (share == 0) continue;
      height_m += share * static_cast<double>(level.at(c + right, r + down));
    }
  }
  if (std::isnan(height_m)) return {};
  return height_m;
}

const std::vector<std::uint32_t>& ServedScene::group_of_samples() const {
  std::call_once(groups_once_, [&] {
    const StopAsked never;
    const StopScope scope(never);
    group_of_samples_ = source_->group_of_samples();
  });
  return group_of_samples_;
}

nlohmann::json ServedScene::description() const {
  const FrameDescription& frame = source_->dem().frame->description();
  const SurfaceNote note = note_of(source_->surface(), frame);
  const bool any = heights_->highest_m() > heights_->lowest_m() || heights_->lowest_m() != 0;
  nlohmann::json r = {{"name", name_},
                      {"title", name_},
                      {"file", file_name_of(path_, name_)},
                      {"kind", is_scene_ ? "scene" : "dem"},
                      {"bounds", bounds_},
                      {"centre", {(bounds_[0] + bounds_[2]) / 2, (bounds_[1] + bounds_[3]) / 2}},
                      {"crs", frame.crs_wkt},
                      {"cell_m", cell_m_},
                      {"columns", source_->dem().columns},
                      {"rows", source_->dem().rows},
                      {"surface", note.surface},
                      {"earth", note.earth},
                      {"refraction", note.refraction},
                      {"heights",
                       {{"min_m", any ? nlohmann::json(heights_->lowest_m()) : nlohmann::json()},
                        {"max_m", any ? nlohmann::json(heights_->highest_m()) : nlohmann::json()},
                        {"datum", note.heights}}},
                      {"groups", nullptr},
                      {"triangles", nullptr}};
  if (is_scene_) {
    r["groups"] = source_->groups();
    r["triangles"] = source_->triangles();
  }
  return r;
}

}  // namespace scarp
