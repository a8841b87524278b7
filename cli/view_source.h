#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/ground_eye.h"
#include "cli/loaded_scene.h"
#include "cli/options.h"
#include "core/viewshed/viewshed.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// What viewsheds are taken over: DEMs, with obstacles above them or without, or a scene.
class ViewSource {
 public:
  /// Throws Error: what a scene or a DEM throws; kUsage where options for reading a DEM are given
  /// with a scene, or a scene is not alone; kInput where obstacles do not share the DEM's cells.
  ViewSource(const std::vector<std::string>& sources, const std::vector<std::string>& obstacles,
             const DemOptions& options, const Progress& progress);

  /// "grid" or "tin".
  const char* surface() const { return scene_ ? "tin" : "grid"; }
  bool has_obstacles() const { return obstacles_.has_value(); }

  /// The raster: of the DEM, or the one that the scene was made from.
  const Dem& dem() const { return ground_.dem; }
  /// Its samples, where targets stand.
  const GroundGrid& samples() const { return ground_.grid; }
  ViewGround ground() const;

  /// Throws as place_eye does.
  GroundEye place(const TypedPosition& typed, const std::string& crs) const;
  /// A point in the CRS of the data. @param text  the position as given, for messages
  GroundEye place(const MapPoint& point, bool above_datum, const std::string& text) const;

 private:
  void stand_on_scene();
  void read_obstacles(const std::vector<std::string>& files, const DemOptions& options);

  std::optional<LoadedScene> scene_;
  Ground ground_;
  std::optional<GroundGrid> obstacles_;
  std::optional<GroundTops> tops_;  // of a DEM
};

}  // namespace scarp
