#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cli/options.h"
#include "cli/view_source.h"
#include "core/threads/progress.h"
#include "core/viewshed/viewshed.h"
#include "tiles/layers/geotiff.h"

namespace scarp {

/// One eye of a viewshed.
struct RunEye {
  GroundEye at;
  double target_height_m = 0;
  ViewLimits limits;
  std::string name;  ///< empty: none
};

using DegreeRange = std::optional<std::pair<double, double>>;

/// Limits as they are typed. A range of azimuths of a whole turn is no limit.
ViewLimits view_limits(double min_distance_m, std::optional<double> max_distance_m,
                       const DegreeRange& azimuth_deg, const DegreeRange& pitch_deg);

/// An eye with the limits and the target height of the options. Throws as ViewSource::place.
RunEye eye_at(const TypedPosition& typed, const ViewshedOptions& options, const ViewSource& source);

/// What a viewshed was, for whoever opens its raster.
void describe_view(const ViewSource& source, const ViewshedOptions& options,
                   std::span<const RunEye> eyes, std::map<std::string, std::string>& metadata);

/// What eyes see of a source together, in the mode of the options: the work of `scarp viewshed` and
/// of the server. Source and options must outlive it.
class EyesRaster {
 public:
  EyesRaster(const ViewSource& source, const ViewshedOptions& options);

  /// Looks from all eyes; once. @param each  called after every eye with its index, when write_each
  /// may be; may be empty
  void see(std::vector<RunEye> eyes, const Progress& progress,
           const std::function<void(std::size_t)>& each);

  const std::vector<RunEye>& eyes() const { return eyes_; }
  const SweepCounts& decided() const { return decided_; }
  /// Outside it no eye sees anything.
  const SampleWindow& window() const { return all_window_; }

  // Of the mode asked for, the others are empty. All [rows * columns].
  std::span<const Seen> seen() const;             ///< visible
  std::span<const std::uint32_t> counts() const;  ///< count
  std::span<const float> heights_m() const;       ///< ground, dem; NaN unknown

  /// Whether heights_m() are above the datum of the data (mode dem), not above the ground.
  bool are_elevations() const { return options_.mode == ViewshedMode::kDem; }

  /// "visible_samples", "hidden_samples", "unknown_samples" and their like in the other modes.
  nlohmann::json summary() const;

  /// A cloud-optimised GeoTIFF of all eyes, or of the eye last looked from. Errors as
  /// write_geotiff_cog.
  void write(const std::string& path, bool saves_memory, Existing existing) const;
  void write_each(std::size_t eye, const std::string& path, bool saves_memory,
                  Existing existing) const;
  /// What is seen, or by how many eyes, as whole numbers over the DEM: for outlines. Requires mode
  /// visible or count. The layer borrows.
  RasterLayer areas() const;
  const char* areas_field() const { return count_ ? "eyes" : "visible"; }

 private:
  bool measures_heights() const {
    return options_.mode == ViewshedMode::kGround || options_.mode == ViewshedMode::kDem;
  }
  std::vector<std::size_t> order_of_eyes() const;
  void see_from(const RunEye& from, const Progress& progress);
  void add_ground(std::span<float> least_m) const;
  /// @param room  for values that are not the samples' own; must outlive the layer
  RasterLayer layer_of(std::span<const Seen> sight, LargeArray<std::uint8_t>& room) const;
  RasterLayer layer_of(std::span<const float> least_m) const;
  void write_layer(const std::string& path, RasterLayer& layer, std::span<const RunEye> eyes,
                   bool saves_memory, Existing existing) const;

  const ViewSource& source_;
  const ViewshedOptions& options_;
  std::vector<RunEye> eyes_;
  LargeArray<Seen> sight_;
  std::optional<AnyEye> any_;
  std::optional<EyeCount> count_;
  std::optional<LeastHeight> least_;
  LargeArray<float> eye_heights_m_;
  SampleWindow window_;      // of the eye last seen from
  SampleWindow all_window_;  // of all eyes
  SweepCounts decided_;
};

}  // namespace scarp
