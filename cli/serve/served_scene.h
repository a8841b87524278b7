#pragma once

#include <array>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/serve/height_pyramid.h"
#include "cli/serve/mercator.h"
#include "cli/sight_surface.h"
#include "cli/view_source.h"

namespace scarp {

/// A DEM or a scene that stays open and placed, under the name that clients know it by.
/// Thread safety: all members from any thread.
class ServedScene {
 public:
  /// @param dem  how DEMs are read; refraction is what requests take that name none
  /// Throws Error: what ViewSource throws; kInput where the data have no coordinate system.
  ServedScene(std::string name, const std::string& path, const DemOptions& dem);

  const std::string& name() const { return name_; }
  const std::string& path() const { return path_; }
  bool is_scene() const { return is_scene_; }
  double refraction() const { return dem_options_.refraction; }

  /// The source in its own frame, for maps.
  const ViewSource& source() const { return *source_; }
  /// The source as rays of this refraction see it, and as an accuracy takes it (ViewSource): its
  /// own, or another one that is read once and kept while it is among the last kFrames. Throws
  /// Error{kInput} for another refraction of a scene.
  static constexpr std::size_t kFrames = 3;
  std::shared_ptr<const ViewSource> source(std::optional<double> refraction,
                                           Accuracy accuracy = Accuracy::kExact) const;

  /// A typed position in lon, lat as one of the CRS of the data. Throws Error{kInput} where it has
  /// no place there.
  TypedPosition in_data(const TypedPosition& lon_lat) const;
  /// Map coordinates of the data in lon, lat. Nothing where they have no place there.
  std::optional<LonLat> lon_lat_of(double x, double y) const;

  const MercatorMap& map() const { return *map_; }
  const HeightPyramid& heights() const { return *heights_; }
  double cell_m() const { return cell_m_; }
  /// West, south, east, north in degrees.
  const std::array<double, 4>& bounds() const { return bounds_; }
  /// Height above the datum at a place, bilinear between samples; nothing over void.
  std::optional<double> ground_m(const LonLat& at) const;

  /// The group of each sample of a scene, kNone; empty for a DEM. Made when first asked for.
  const std::vector<std::uint32_t>& group_of_samples() const;

  /// As GET /scenes/{name} has it, but for links.
  nlohmann::json description() const;

 private:
  std::optional<std::pair<double, double>> place_of(const LonLat& at) const;
  void find_bounds();

  std::string name_, path_;
  bool is_scene_ = false;
  DemOptions dem_options_;
  std::shared_ptr<const ViewSource> source_;
  mutable std::mutex conversion_mutex_;
  std::optional<CoordinateConversion> from_lon_lat_;
  std::array<double, 4> bounds_{};
  double cell_m_ = 1;
  std::optional<MercatorMap> map_;
  std::optional<HeightPyramid> heights_;
  mutable std::mutex frames_mutex_;
  struct Frame {
    double refraction;
    Accuracy accuracy;
    std::shared_ptr<const ViewSource> source;
  };
  mutable std::list<Frame> frames_;  // but for the own one; the last asked for first
  mutable std::once_flag groups_once_;
  mutable std::vector<std::uint32_t> group_of_samples_;
};

}  // namespace scarp
