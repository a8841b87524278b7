#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "cli/ground_eye.h"
#include "cli/options.h"
#include "cli/part_ground.h"
#include "core/viewshed/viewshed.h"
#include "ingest/dem/dem.h"

namespace scarp {

/// Eyes that are known before their ground is, and how far they see along the ground.
struct ViewReach {
  std::vector<TypedPosition> eyes;
  std::string crs;  ///< of the eyes; empty: the data's
  double distance_m = HUGE_VAL;
};

/// What viewsheds are taken over: DEMs, with obstacles above them or without, or a scene.
class ViewSource {
 public:
  /// Throws Error: what a scene or a DEM throws; kUsage where options for reading a DEM are given
  /// with a scene, or a scene is not alone; kInput where obstacles do not share the DEM's cells.
  /// @param reach  of a scene of several tiles only those that the eyes reach are read, those
  ///               between them with them, or all where void that these cut might matter
  ///               (PartGround); and the raster is the rectangle that the eyes reach, a little more
  ///               to the left and above, to whole blocks of GroundGrid's placement. What is seen
  ///               and what is void are those of the whole raster. None: all
  ViewSource(const std::vector<std::string>& sources, const std::vector<std::string>& obstacles,
             const DemOptions& options, const Progress& progress,
             const std::optional<ViewReach>& reach = {});

  /// "grid" or "tin".
  const char* surface() const { return scene_ ? "tin" : "grid"; }
  bool has_obstacles() const { return obstacles_.has_value(); }

  /// The raster: of the DEM, or the one that the scene was made from.
  const Dem& dem() const { return ground_.dem; }
  /// Its samples, where targets stand.
  const GroundGrid& samples() const { return ground_.grid; }
  /// Exact until it is approximated.
  ViewGround ground() const;
  /// How many of the samples are known; counted when first asked for. From any thread.
  std::uint64_t known_samples() const;
  /// From now on ground() is what an accuracy takes for it, and eyes are placed over that: the
  /// raster of a scene's heights in place of its mesh, bounds in place of exact decisions, and, if
  /// fast, every second sample.
  void approximate(Accuracy accuracy);

  /// Tiles of a scene, and how many of them were read; 0 of a DEM.
  std::size_t tiles() const { return scene_ ? scene_->tiles.size() : 0; }
  std::size_t tiles_read() const { return scene_ ? scene_->tiles.tiles_read() : 0; }

  /// What stands on its own: the DEM with its grid. Requires a DEM.
  const Ground& dem_ground() const { return ground_; }
  /// Of a scene, the tiles that were read; null of a DEM.
  const SceneTiles* scene_tiles() const { return scene_ ? &scene_->tiles : nullptr; }
  const TinIndex* tin_index() const { return scene_ ? &scene_->index() : nullptr; }
  std::uint64_t triangles() const { return scene_ ? scene_->tin().triangles.size() : 0; }
  std::uint64_t groups() const;  ///< leaves, of the tiles used
  /// The group of the scene that each sample lies in, kNone where it is in none. [rows * columns]
  /// Empty for a DEM. Reads the groups of all tiles used. Throws as read_tile_groups.
  std::vector<GroupIndex> group_of_samples() const;

  /// Throws as place_eye does.
  GroundEye place(const TypedPosition& typed, const std::string& crs) const;
  /// A point in the CRS of the data. @param text  the position as given, for messages
  GroundEye place(const MapPoint& point, bool above_datum, const std::string& text) const;

 private:
  /// Tiles of a scene as one surface.
  struct SceneGround {
    /// Throws Error{kResource} where its tiles take more than memory_bytes; 0: anything.
    SceneGround(const std::string& path, const std::optional<ViewReach>& reach,
                std::uint64_t memory_bytes);

    SceneTiles tiles;
    Dem dem;  ///< the scene's whole raster
    std::vector<ViewPlan> discs;
    PartPlacement part;  ///< of the raster's part that is looked at
    PartGround ground;

    const std::vector<std::size_t>& used() const { return ground.used(); }
    const Tin& tin() const { return ground.tin(); }
    const TinIndex& index() const { return ground.index(); }
  };

  void stand_on_scene();
  void read_obstacles(const std::vector<std::string>& files, const DemOptions& options);

  std::unique_ptr<const SceneGround> scene_;
  Ground ground_;
  std::optional<GroundGrid> obstacles_;
  std::optional<GroundTops> tops_;  // of a DEM
  mutable std::once_flag known_once_;
  mutable std::uint64_t known_ = 0;
  Accuracy accuracy_ = Accuracy::kExact;
  std::optional<ThinnedGround> thinned_;  // if fast
};

}  // namespace scarp
