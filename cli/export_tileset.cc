#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/export.h"
#include "cli/scene_report.h"
#include "cli/scene_tiles.h"
#include "cli/stages.h"
#include "core/error/error.h"
#include "core/geodesy/horizon_point.h"
#include "core/threads/parallel_for.h"
#include "ingest/crs/globe.h"
#include "tiles/store/tin_file.h"
#include "tiles/tileset/tileset_files.h"

namespace scarp {
namespace {

using nlohmann::json;

/// What a tile takes while it is written, for each triangle: mesh, positions, glTF. Measured: 200.
constexpr std::uint64_t kBytesPerTriangle = 300;

/// Less than any distance from a frame's origin to the ellipsoid, metres.
constexpr double kEarthM = 6.35e6;

/// The scene's tiles as a quadtree.
struct ScenePyramid {
  std::int32_t finest_level = 0;
  std::map<TileId, const SceneTile*> with_mesh;

  explicit ScenePyramid(const SceneDescription& scene) {
    for (const SceneTile& tile : scene.tiles) {
      const bool has_mesh = std::any_of(tile.files.begin(), tile.files.end(),
                                        [](const StoredFile& f) { return f.kind == "tin"; });
      if (!has_mesh) continue;
      if (!tile.contents)
        throw Error(ErrorCode::kCorrupt,
                    fmt::format("tile {} of the scene does not tell its bounds, as those of an "
                                "earlier version; build the scene again",
                                tile.id));
      with_mesh[tile_id(tile)] = &tile;
      finest_level = std::max(finest_level, tile_id(tile).level);
    }
  }

  std::vector<TileId> level(std::int32_t number) const {
    std::vector<TileId> ids;
    for (const auto& [id, tile] : with_mesh)
      if (id.level == number) ids.push_back(id);
    return ids;
  }

  static TileId parent(const TileId& id) { return {id.level - 1, id.column / 2, id.row / 2}; }
};

/// Circle and height in the frame of a tile and all below it, for its certified horizon.
TileHorizon empty_horizon(const TileContents& bounds) {
  const double x = (bounds.low[0] + bounds.high[0]) / 2, y = (bounds.low[1] + bounds.high[1]) / 2;
  const double radius_m = std::hypot(bounds.high[0] - x, bounds.high[1] - y) * (1 + 1e-9) + 1e-3;
  return horizon_of_nothing(kTilesetHorizon, x, y, bounds.high[2], radius_m);
}

class TilesetExport {
 public:
  TilesetExport(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder)
      : options_(options),
        scene_(scene),
        folder_(folder),
        pyramid_(scene.scene().description()),
        errors_m_(SceneReport(scene.scene()).level_errors_m(pyramid_.finest_level)),
        globe_(scene.frame()),
        frame_(tileset_frame()),
        steps_m_(steps_of_levels()) {
    for (std::size_t i = 0; i < scene.size(); ++i) number_of_tile_[tile_id(scene.tile(i))] = i;
    has_horizons_ = has_certified();
    for (const auto& [id, tile] : pyramid_.with_mesh) hold_bounds(id, *tile->contents);
    for (const auto& [id, bounds] : bounds_)
      if (has_horizons_) horizons_[id] = empty_horizon(bounds);
  }

  void write(Stages& stages, json& result) {
    stages.run("tiles", [&](const Progress& progress) {
      for (std::int32_t level = pyramid_.finest_level; level >= 0; --level)
        write_level(level, progress);
    });
    stages.run("tileset", [&](const Progress&) {
      join_levels();
      write_tileset();
    });
    result["tiles"] = pyramid_.with_mesh.size();
    result["levels"] = pyramid_.finest_level + 1;
    result["triangles"] = triangles_;
    result["content_bytes"] = content_bytes_;
    result["position_error_m"] = steps_m_.back() / 2;
  }

 private:
  /// What one tile leaves for the tileset's own files.
  struct TileResult {
    TileFacts facts;
    std::vector<EcefPoint> hull;  // of the tile's ground, for its horizon point
    std::map<TileId, TileHorizon> horizons;
    std::uint64_t triangles = 0, bytes = 0;
  };

  TilesetFrame tileset_frame() const {
    const SceneDescription& scene = scene_.scene().description();
    const Globe::Placer globe(globe_);
    const GeoFrame::Placer placer(scene_.frame());
    // Level 0 of the raster's middle row, from one column to the next.
    const double column = scene.raster.columns / 2.0, row = scene.raster.rows / 2.0;
    return {globe.ecef(Position{}), [&] {
              const Position here = placer.place_unrounded(map_point(column, row));
              const Position next = placer.place_unrounded(map_point(column + 1, row));
              return globe.ecef({next.x_m - here.x_m, next.y_m - here.y_m, 0});
            }()};
  }

  MapPoint map_point(double column, double row) const {
    const auto& g = scene_.scene().description().raster.geotransform;
    return {g[0] + column * g[1] + row * g[2], g[3] + column * g[4] + row * g[5], 0};
  }

  bool has_certified() const {
    if (scene_.size() == 0) return false;
    const auto& parameters = scene_.scene().description().parameters;
    const auto horizon = parameters.find("horizon");
    return horizon != parameters.end() && std::get<std::string>(horizon->second) != "stewart";
  }

  /// Bounds of a tile count for all above it.
  void hold_bounds(TileId id, const TileContents& contents) {
    for (;; id = ScenePyramid::parent(id)) {
      const auto [at, is_new] = bounds_.try_emplace(id, contents);
      for (std::size_t i = 0; i < 3; ++i) {
        at->second.low[i] = std::min(at->second.low[i], contents.low[i]);
        at->second.high[i] = std::max(at->second.high[i], contents.high[i]);
      }
      if (id.level == 0) return;
    }
  }

  /// Of each level, by its largest tile.
  std::vector<double> steps_of_levels() const {
    const Globe::Placer globe(globe_);
    std::vector<double> reach_m(static_cast<std::size_t>(pyramid_.finest_level) + 1, 0);
    for (const auto& [id, tile] : pyramid_.with_mesh) {
      double& most_m = reach_m[static_cast<std::size_t>(id.level)];
      most_m = std::max(most_m, half_size_m(globe, *tile->contents));
    }
    std::vector<double> steps_m;
    for (const double reach : reach_m) steps_m.push_back(step_for(reach));
    return steps_m;
  }

  /// Half of the largest side of a tile in the tileset's axes, by the corners of its bounds.
  double half_size_m(const Globe::Placer& globe, const TileContents& bounds) const {
    TilePoint low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const double x : {bounds.low[0], bounds.high[0]}) {
      for (const double y : {bounds.low[1], bounds.high[1]}) {
        for (const double z : {bounds.low[2], bounds.high[2]}) {
          const TilePoint p = frame_.from_ecef(globe.ecef({x, y, z}));
          for (std::size_t i = 0; i < 3; ++i) {
            low[i] = std::min(low[i], p[i]);
            high[i] = std::max(high[i], p[i]);
          }
        }
      }
    }
    constexpr double kRoomM = 1;
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}) / 2 + kRoomM;
  }

  /// As many tiles at once as memory and threads allow.
  std::size_t tiles_at_once() const {
    std::uint64_t most = 0;
    for (const auto& [id, tile] : pyramid_.with_mesh)
      most = std::max(most, tile->contents->triangles);
    const std::uint64_t bytes = most * kBytesPerTriangle;
    const std::uint64_t budget = options_.common.memory_budget_bytes;
    if (bytes > budget)
      throw Error(ErrorCode::kResource,
                  fmt::format("'{}': its largest tile takes {} MiB to export, and --memory is {} "
                              "MiB; give more memory, or build the scene with smaller "
                              "--tile-samples",
                              options_.scene, bytes >> 20, budget >> 20));
    return static_cast<std::size_t>(std::clamp<std::uint64_t>(
        budget / std::max<std::uint64_t>(1, bytes), 1, static_cast<std::uint64_t>(thread_count())));
  }

  void write_level(std::int32_t level, const Progress& progress) {
    const std::vector<TileId> ids = pyramid_.level(level);
    const std::size_t at_once = tiles_at_once();
    const double step = steps_m_[static_cast<std::size_t>(level)];
    const BorderNormals around =
        ids.size() > 1 ? normals_between(ids, at_once, step) : BorderNormals{};
    for (std::size_t begin = 0; begin < ids.size(); begin += at_once) {
      std::vector<TileResult> results(std::min(at_once, ids.size() - begin));
      parallel_for(results.size(),
                   [&](std::size_t i) { results[i] = write_tile(ids[begin + i], step, around); });
      for (std::size_t i = 0; i < results.size(); ++i) take(ids[begin + i], results[i]);
      if (progress)
        progress(static_cast<double>(tiles_.size()) /
                 static_cast<double>(pyramid_.with_mesh.size()));
    }
  }

  std::vector<EcefPoint> ecef_of(const Tin& tin) const {
    std::vector<EcefPoint> ecef(tin.vertices.size());
    constexpr std::size_t kBlock = 65'536;
    parallel_for((ecef.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
      const Globe::Placer globe(globe_);
      const std::size_t end = std::min(ecef.size(), (block + 1) * kBlock);
      for (std::size_t v = block * kBlock; v < end; ++v) ecef[v] = globe.ecef(tin.vertices[v]);
    });
    return ecef;
  }

  Tin read_mesh(const TileId& id) const {
    const Scene& scene = scene_.scene();
    return read_tin(scene.open(scene.require(pyramid_.with_mesh.at(id)->id, "tin")));
  }

  /// Normals on the borders of a level's tiles, which neighbours have to agree in.
  BorderNormals normals_between(const std::vector<TileId>& ids, std::size_t at_once,
                                double step) const {
    BorderNormals all;
    for (std::size_t begin = 0; begin < ids.size(); begin += at_once) {
      std::vector<BorderNormals> parts(std::min(at_once, ids.size() - begin));
      parallel_for(parts.size(), [&](std::size_t i) {
        const Tin tin = read_mesh(ids[begin + i]);
        parts[i] = border_normals(tin, ecef_of(tin), frame_, step);
      });
      for (const BorderNormals& part : parts)
        for (const auto& [place, sum] : part)
          for (std::size_t i = 0; i < 3; ++i) all[place][i] += sum[i];
    }
    return all;
  }

  TileResult write_tile(const TileId& id, double step, const BorderNormals& around) const {
    const Scene& scene = scene_.scene();
    const SceneTile& tile = *pyramid_.with_mesh.at(id);
    const Tin tin = read_mesh(id);
    const std::vector<EcefPoint> ecef = ecef_of(tin);
    TileResult result;
    result.facts = tile_facts(tin, ecef, frame_, step);
    result.hull = corners_of(result.facts.box);
    result.triangles = tin.triangles.size();
    std::optional<Groups> groups;
    if (id.level == pyramid_.finest_level)
      groups = read_tile_groups(scene, tile, tin.triangles.size());
    const GroupIndex first_group = groups ? scene_.first_group(number_of_tile_.at(id)) : 0;
    const TerrainMesh mesh =
        tile_ground(tin, ecef, frame_, groups ? &*groups : nullptr, first_group, step, around);
    const std::vector<std::byte> glb =
        terrain_glb(mesh, options_.compress ? GlbCompression::kMeshopt : GlbCompression::kPlain);
    result.bytes = glb.size();
    folder_.write(content_name(implicit_place(id, rows_fall())), glb);
    if (has_horizons_ && groups) result.horizons = horizons_over(id, *groups);
    return result;
  }

  std::vector<EcefPoint> corners_of(const TileBox& box) const {
    std::vector<EcefPoint> corners;
    for (const TilePoint& corner : box.corners()) corners.push_back(frame_.to_ecef(corner));
    return corners;
  }

  /// What the groups of a tile allow the horizons of it and of all tiles above it.
  std::map<TileId, TileHorizon> horizons_over(TileId id, const Groups& groups) const {
    const bool all_certified =
        groups.has_certified() &&
        std::find(groups.group_of_triangle.begin(), groups.group_of_triangle.end(), kNone) ==
            groups.group_of_triangle.end();
    std::map<TileId, TileHorizon> horizons;
    for (;; id = ScenePyramid::parent(id)) {
      TileHorizon& horizon = horizons.emplace(id, horizons_.at(id)).first->second;
      if (all_certified)
        cover_groups(groups.certified, horizon);
      else
        cover_uncertified(horizon);
      if (id.level == 0) return horizons;
    }
  }

  void take(const TileId& id, TileResult& result) {
    TilesetTile& tile = tiles_[id];
    tile.has_content = true;
    tile.facts = result.facts;
    hulls_[id] = std::move(result.hull);
    for (const auto& [above, horizon] : result.horizons) cover(horizon, horizons_.at(above));
    triangles_ += result.triangles;
    content_bytes_ += result.bytes;
  }

  /// From the finest level to the root: a tile holds what is below it, whether it has a mesh of its
  /// own or not.
  void join_levels() {
    for (std::int32_t level = pyramid_.finest_level; level >= 0; --level) {
      std::map<TileId, std::vector<TileId>> children;
      for (const auto& [id, tile] : tiles_)
        if (id.level == level + 1) children[ScenePyramid::parent(id)].push_back(id);
      for (const auto& [id, below] : children) {
        std::vector<TileFacts> facts;
        if (tiles_.contains(id)) facts.push_back(tiles_.at(id).facts);
        for (const TileId& child : below) facts.push_back(tiles_.at(child).facts);
        TilesetTile& tile = tiles_[id];
        tile.facts = facts_of_all(frame_, facts);
        std::vector<EcefPoint>& hull = hulls_[id];
        for (const TileId& child : below)
          hull.insert(hull.end(), hulls_.at(child).begin(), hulls_.at(child).end());
      }
    }
    const double lowest_m = tiles_.at({}).facts.least_height_m;
    for (auto& [id, tile] : tiles_) {
      tile.geometric_error_m =
          errors_m_[static_cast<std::size_t>(id.level)] * height_scale(tile.facts);
      tile.horizon_point = horizon_point(hulls_.at(id), frame_.to_ecef(tile.facts.box.centre),
                                         kWgs84, std::max(0.0, -lowest_m));
      if (has_horizons_) tile.horizon = horizons_.at(id);
    }
  }

  /// True lengths along the frame's verticals are at most this many times those in the frame:
  /// (1 + h / D)^2, see Flattening.
  static double height_scale(const TileFacts& facts) {
    const double factor = 1 + std::max(0.0, facts.greatest_height_m) / kEarthM;
    return factor * factor;
  }

  /// Whether the raster's rows run against the tileset's y axis.
  bool rows_fall() const {
    const auto& g = scene_.scene().description().raster.geotransform;
    return g[1] * g[5] - g[2] * g[4] < 0;
  }

  /// The square of cells that the quadtree halves, as a box, made to hold all ground. A scene of
  /// one tile is never halved and has its own box.
  TileBox root_box() const {
    const TileBox own = tiles_.at({}).facts.box;
    const auto side = scene_.scene().description().parameters.find("tile_samples");
    if (pyramid_.finest_level == 0 || side == scene_.scene().description().parameters.end())
      return own;
    const double cells = std::ldexp(static_cast<double>(std::get<std::int64_t>(side->second)),
                                    pyramid_.finest_level);
    const GeoFrame::Placer placer(scene_.frame());
    const Globe::Placer globe(globe_);
    const auto sample = [&](double column, double row) {
      return frame_.from_ecef(
          globe.ecef(placer.place_unrounded(map_point(column + 0.5, row + 0.5))));
    };
    const auto& raster = scene_.scene().description().raster;
    const double last_column = raster.columns - 1, last_row = raster.rows - 1;
    const TilePoint first = sample(0, 0), right = sample(last_column, 0),
                    below = sample(0, last_row);
    TilePoint low = own.centre, high = own.centre;
    const auto hold = [&](std::size_t i, double value) {
      low[i] = std::min(low[i], value);
      high[i] = std::max(high[i], value);
    };
    for (std::size_t i = 0; i < 2; ++i) {
      hold(i, first[i]);
      hold(i, first[i] + (right[i] - first[i]) * cells / last_column);
      hold(i, first[i] + (below[i] - first[i]) * cells / last_row);
    }
    for (const TilePoint& corner : own.corners())
      for (std::size_t i = 0; i < 3; ++i) hold(i, corner[i]);
    TileBox box;
    for (std::size_t i = 0; i < 3; ++i) {
      box.centre[i] = (low[i] + high[i]) / 2;
      box.half_axes[i][i] = (high[i] - low[i]) / 2;
    }
    return box;
  }

  void write_tileset() const {
    TilesetTiles tiles;
    for (const auto& [id, tile] : tiles_) tiles[implicit_place(id, rows_fall())] = tile;
    const FrameDescription& frame = scene_.frame().description();
    const EarthFrame earth = *scene_.frame().earth_frame();
    TilesetDescription tileset;
    tileset.transform = frame_.transform();
    tileset.root_box = root_box();
    tileset.geometric_error_m =
        std::max(tiles_.at({}).geometric_error_m, size_of(tileset.root_box));
    tileset.has_horizons = has_horizons_;
    tileset.heights = frame.geoid_file.empty()
                          ? "taken as ellipsoidal"
                          : "undulation of the geoid " + frame.geoid_file + " added";
    tileset.datum_shift =
        globe_.datum_shift().empty()
            ? "none"
            : fmt::format("{}, {}", globe_.datum_shift(),
                          globe_.datum_shift_accuracy_m() < 0
                              ? "accuracy unknown"
                              : fmt::format("accurate to {:g} m", globe_.datum_shift_accuracy_m()));
    tileset.position_error_m = steps_m_.back() / 2;
    tileset.refraction = frame.refraction;
    tileset.frame_origin = earth.frame.origin();
    tileset.frame_centre = earth.frame.unflatten({});
    folder_.write("tileset.json", tileset_json(tileset, tiles));
    for (const auto& [name, bytes] : subtree_files(tiles, has_horizons_))
      folder_.write(name, bytes);
  }

  /// Half the diagonal: what is missing where nothing is drawn.
  static double size_of(const TileBox& box) {
    const TilePoint corner = box.corners()[7];
    return std::hypot(corner[0] - box.centre[0], corner[1] - box.centre[1],
                      corner[2] - box.centre[2]);
  }

  const ExportOptions& options_;
  const SceneTiles& scene_;
  const PartFolder& folder_;
  const ScenePyramid pyramid_;
  const std::vector<double> errors_m_;  // of levels
  const Globe globe_;
  const TilesetFrame frame_;
  const std::vector<double> steps_m_;  // of levels
  bool has_horizons_ = false;
  std::map<TileId, std::size_t> number_of_tile_;
  std::map<TileId, TileContents> bounds_;
  std::map<TileId, TileHorizon> horizons_;
  std::map<TileId, TilesetTile> tiles_;
  std::map<TileId, std::vector<EcefPoint>> hulls_;
  std::uint64_t triangles_ = 0, content_bytes_ = 0;
};

}  // namespace

void export_tileset(const ExportOptions& options, SceneTiles& scene, const PartFolder& folder,
                    Stages& stages, nlohmann::json& result) {
  TilesetExport(options, scene, folder).write(stages, result);
}

}  // namespace scarp
