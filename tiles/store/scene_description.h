#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/terrain/tile_scheme.h"
#include "tiles/store/checksum.h"

/// What scene.json says, as plain data. docs/formats.md has the file's members.
namespace scarp {

/// Version of scene.json and of the folder's layout that this program reads and writes.
inline constexpr int kSceneVersion = 1;

inline constexpr char kSceneJson[] = "scene.json";

enum class EarthShape { kEllipsoid, kFlat };

struct EarthModel {
  EarthShape shape = EarthShape::kEllipsoid;
  double refraction = 0;  ///< coefficient k, 0 to 1
  std::string geoid;      ///< file whose undulation was added; empty: heights taken as ellipsoidal
  /// Centre of the scene's frame. Ellipsoid: a point on its radial line, ECEF, metres. Flat: x and
  /// y in units of the CRS, and the height that is taken as 0, metres.
  std::array<double, 3> centre{};

  friend bool operator==(const EarthModel&, const EarthModel&) = default;
};

/// The raster that the scene was made from; its samples are pixel centres.
struct RasterGeometry {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  /// x = g[0] + column g[1] + row g[2], y = g[3] + column g[4] + row g[5], of pixel corners, in
  /// units of the CRS.
  std::array<double, 6> geotransform = {0, 1, 0, 0, 0, -1};

  friend bool operator==(const RasterGeometry&, const RasterGeometry&) = default;
};

/// A file that the scene was made from; not part of it.
struct SourceFile {
  std::string name;
  std::uint64_t size = 0;  ///< bytes
  Checksum checksum;

  friend bool operator==(const SourceFile&, const SourceFile&) = default;
};

/// A file of the scene.
struct StoredFile {
  std::string name;        ///< below the scene's folder, parts separated by '/'
  std::string kind;        ///< "tin", "horizon", "groups"; of layers "cog", "gpkg", "png", "json"
  std::uint64_t size = 0;  ///< bytes
  Checksum checksum;

  friend bool operator==(const StoredFile&, const StoredFile&) = default;
};

/// What a tile holds, so that readers open only those that they need.
struct TileContents {
  std::array<double, 3> low{}, high{};  ///< bounds of the vertices, flattened, metres
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t groups = 0;  ///< leaves; 0 where the tile has none

  friend bool operator==(const TileContents&, const TileContents&) = default;
};

struct SceneTile {
  std::string id;  ///< "level/column/row", such as "0/0/0"
  std::vector<StoredFile> files;
  std::optional<TileContents> contents = {};  ///< none in scenes of an earlier version

  friend bool operator==(const SceneTile&, const SceneTile&) = default;
};

using ParameterValue = std::variant<bool, std::int64_t, double, std::string>;

struct SceneDescription {
  std::string made_by;  ///< such as "scarp 0.1.0"
  std::string crs_wkt;  ///< WKT2, or empty where the data name no CRS
  EarthModel earth;
  RasterGeometry raster;
  std::map<std::string, ParameterValue> parameters;  ///< every option that shaped the scene
  std::vector<SourceFile> sources;
  std::vector<SceneTile> tiles;
  std::vector<StoredFile> layers;

  friend bool operator==(const SceneDescription&, const SceneDescription&) = default;
};

/// The place of a tile. Requires a proper id (asserted).
TileId tile_id(const SceneTile& tile);

/// Tiles of the finest level that has any, which cover the scene: by rising row, then column.
/// Groups of a scene are counted on from one to the next in this order. Indices into scene.tiles.
std::vector<std::size_t> finest_tiles(const SceneDescription& scene);

/// Names what is wrong with a description, or nothing: numbers finite and in range, tile ids and
/// file names proper and unique. A proper file name is relative and never leaves the folder.
std::optional<std::string> check_description(const SceneDescription& scene);

/// The text of scene.json. Same description, same bytes. Text that is not UTF-8 (a file name) is
/// written with replacement characters.
/// Requires check_description to find nothing (asserted).
std::string scene_to_json(const SceneDescription& scene);

/// The inverse. `name` is what messages call the text. Every byte is under the text's own checksum,
/// so a scene.json edited by hand is refused too.
/// Errors: kCorrupt for any text that scene_to_json would not have written.
SceneDescription scene_from_json(std::string_view text, const std::string& name);

}  // namespace scarp
