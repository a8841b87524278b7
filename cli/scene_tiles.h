#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/loaded_scene.h"
#include "core/culling/camera.h"

namespace scarp {

/// A disc in the plane around an eye, or a part of it.
struct ViewPlan {
  Position eye;
  double radius_m = HUGE_VAL;
  std::optional<ViewRange> view;  ///< none: all around
};

/// Whether a tile may have ground in a part of the plane. Side: never false where it has.
bool may_meet(const TileContents& contents, const ViewPlan& plan);

/// Whether a tile may have ground within a distance of a line in the plane. Side: never false where
/// it has.
bool may_meet_line(const TileContents& contents, const Position& from, const Position& to,
                   double beside_m);

/// The part of the plane that lines from an eye to a tile's ground lie in.
ViewPlan view_towards(const Position& eye, const TileContents& contents);

/// The finest tiles of a scene, opened when they are asked for. Reads scene.json only, until then.
class SceneTiles {
 public:
  /// Throws as open_scene.
  explicit SceneTiles(const std::string& path);

  const Scene& scene() const { return scene_; }
  const GeoFrame& frame() const { return frame_; }

  /// How many have a mesh, by rising row, then column.
  std::size_t size() const { return tiles_.size(); }
  const SceneTile& tile(std::size_t i) const { return scene_.description().tiles[tiles_[i]]; }
  /// The number in the scene of a tile's group 0. Requires that all tiles before it tell their
  /// contents, or that there is one tile.
  GroupIndex first_group(std::size_t i) const { return first_group_[i]; }

  /// Whether a tile may have ground in a part of the plane; true where it does not tell its bounds.
  /// Side: never false where it has.
  bool meets(std::size_t i, const ViewPlan& plan) const;

  /// The mesh of a tile.
  Tin read_tin(std::size_t i);
  /// Its groups.
  Groups read_groups(std::size_t i);
  /// The tiles that meet a plan.
  std::vector<std::size_t> tiles_in(const ViewPlan& plan) const;
  /// The tiles that may have ground within a distance of a line in the plane.
  std::vector<std::size_t> tiles_along(const Position& from, const Position& to,
                                       double beside_m) const;
  /// Tiles as one surface.
  Tin read_ground(const std::vector<std::size_t>& tiles);
  /// The same, but Error{kResource}, before the work, where that takes more than is allowed.
  /// @param memory_bytes  0: anything
  /// @param remedy        for the message
  Tin read_within(const std::vector<std::size_t>& tiles, std::uint64_t memory_bytes,
                  const std::string& remedy);
  /// The rectangle of the raster that holds the samples of tiles; all of it where the scene does
  /// not tell how large tiles are.
  TileWindow window_of(const std::vector<std::size_t>& tiles) const;

  /// Which tiles have no group that a camera could see, by the tree across tiles: no tile need be
  /// read to know it. None in scenes without such a tree.
  struct HiddenFrom {
    std::vector<bool> tiles;  ///< [size()]
    std::size_t nodes_tested = 0;
  };
  HiddenFrom hidden_from(const Position& eye);

  /// The tiles that have a cell of a rectangle of the raster; all where the scene does not tell how
  /// large tiles are.
  std::vector<std::size_t> tiles_over(const TileWindow& rectangle) const;

  /// How many different ones were read so far.
  std::size_t tiles_read() const { return read_.size(); }
  /// How many files of the scene were read so far, scene.json and the tree included.
  std::size_t files_read() const { return files_read_; }

  /// As resolve of a whole scene, by the mesh of the tiles at the place.
  MapPoint resolve(const TypedPosition& typed, const std::string& crs);

 private:
  std::optional<TileScheme> tile_scheme() const;

  Scene scene_;
  GeoFrame frame_;
  std::vector<std::size_t> tiles_;  // into the description
  std::vector<GroupIndex> first_group_;
  std::set<std::size_t> read_;
  std::size_t files_read_ = 1;
};

}  // namespace scarp
