#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/build/finest_tiles.h"
#include "cli/build/layers.h"
#include "cli/build/options_json.h"
#include "cli/build/report.h"
#include "cli/build/step_run.h"
#include "cli/loaded_scene.h"
#include "cli/picture_size.h"
#include "cli/scene_culling.h"
#include "cli/verify.h"
#include "core/occlusion/certified/tile_tree.h"
#include "core/raster/preview.h"
#include "core/terrain/weld.h"
#include "ingest/dem/ground_placement.h"
#include "tiles/layers/png_image.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/tile_raster_file.h"
#include "tiles/store/tin_file.h"
#include "tiles/store/tree_file.h"

namespace scarp {
namespace {

using nlohmann::json;

/// The last step: from finished tiles to a scene under its name.
class Finish {
 public:
  explicit Finish(StepRun& run)
      : run_(run), plan_(run.plan()), source_(run.open_source()), frame_(*source_.dem().frame) {}

  void finish() {
    if (plan_.has_one_tile()) {
      open_raster();
      run_.part("verify", [&](const Progress& p) { verify(p); });
      run_.part("layers", [&](const Progress& p) {
        write_groups_layer();
        write_viewshed_layer(p);
        write_polygons();
      });
      run_.part("preview", [&](const Progress&) { draw(tin_, groups_); });
      run_.check_sources();
    } else {
      tiles_.emplace(run_);
      run_.part("tree", [&](const Progress&) { write_tree_over_tiles(); });
      run_.part("verify", [&](const Progress& p) { verify_blocks(p); });
      run_.part("layers", [&](const Progress& p) {
        join_groups_layer(p);
        if (plan_.options.outlines) join_polygons(p);
        if (plan_.options.observer) join_viewshed_layer(p);
      });
      run_.part("preview", [&](const Progress&) { draw(ground_for_picture(), {}); });
    }
    write_report();
    run_.writer().finish(description());
  }

 private:
  /// The only tile and its samples, for what is made of the whole raster.
  void open_raster() {
    const std::string name = name_of(TileId{});
    tin_ = read_tin(*run_.open(tile_file_name(name, "tin")));
    groups_ = read_groups(*run_.open(tile_file_name(name, "groups")));
    index_.emplace(tin_);
    grid_ = place_window(source_.dem(),
                         source_.read({0, 0, source_.dem().columns, source_.dem().rows}));
    choose_observer();
  }

  /// Where the eye of the viewshed layer stands: as typed, or over the highest vertex.
  void choose_observer() {
    const BuildOptions& options = plan_.options;
    if (options.observer) {
      observer_ = resolve(*options.observer, options.crs, frame_, *index_);
    } else {
      const json highest = run_.facts_of(StepKind::kMesh, TileId{})["highest"];
      observer_ = MapPoint{highest[0].get<double>(), highest[1].get<double>(),
                           highest[2].get<double>() + TypedPosition{}.height_m};
    }
  }

  /// A sample of what `scarp verify` prints, for the report.
  void verify(const Progress& progress) {
    const auto methods = culling_methods(groups_, has_stewart(plan_.options.horizon));
    verified_ = verify_culling(*index_, groups_, frame_, methods,
                               sampled_plan(tin_.triangles.size()), progress);
  }

  /// The same for a scene of several tiles: an eye in each of some blocks of tiles, which judges
  /// the ground of its block. Lines between places of a rectangle stay in it.
  void verify_blocks(const Progress& progress) {
    const std::vector<FinestTiles::Tile>& tiles = tiles_->tiles();
    SplitMix64 random(VerifyPlan().seed);
    constexpr int kBlocks = 3;
    for (int block = 0; block < kBlocks; ++block) {
      const auto middle =
          static_cast<std::size_t>(random.unit() * static_cast<double>(tiles.size()));
      const std::vector<std::size_t> numbers = tiles_->tiles_around(middle);
      const Tin ground = tiles_->ground_of(numbers);
      const Groups groups = tiles_->groups_of(numbers);
      const TinIndex index(ground);
      VerifyPlan plan = sampled_plan(ground.triangles.size());
      plan.eyes = 1;
      plan.seed += static_cast<std::uint64_t>(block);
      add(verified_,
          verify_culling(index, groups, frame_, culling_methods(groups, false), plan, {}));
      verified_tiles_ += numbers.size();
      if (progress) progress(static_cast<double>(block + 1) / kBlocks);
    }
  }

  /// The group tree across tiles, from what each tile left of its groups.
  void write_tree_over_tiles() {
    std::vector<TileNode> nodes;
    for (const FinestTiles::Tile& tile : tiles_->tiles())
      if (const auto file = run_.open(tree_node_file_name(tile.id)))
        for (TileNode& node : read_tree(*file).nodes) nodes.push_back(std::move(node));
    const TileTree tree = tree_over(std::move(nodes));
    tree_ = run_.make(tree_file_name(), "tree",
                      [&](const std::string& path) { write_tree(path, tree, Existing::kReplace); });
  }
  static std::string tree_file_name() { return tile_file_name(name_of(TileId{}), "tree"); }

  RasterLayer groups_layer() const {
    RasterLayer layer = layer_over(source_.dem(), std::span<const std::int32_t>(), "group");
    layer.nodata = kVoidGroupValue;
    layer.metadata["ACCURACY"] = name_of(plan_.options.accuracy);
    layer.metadata["ORPHAN"] = std::to_string(kOrphanValue);
    return layer;
  }

  void write_groups_layer() {
    const std::vector<std::int32_t> values =
        group_of_samples(triangle_of_samples(grid_, *index_), groups_);
    RasterLayer layer = groups_layer();
    layer.samples = std::span(values);
    add_layer("layers/groups.tif", "cog",
              [&](const std::string& path) { write_geotiff_cog(path, layer, Existing::kReplace); });
  }

  /// The same from the tiles' rasters, one at a time, with the groups' numbers in the scene.
  void join_groups_layer(const Progress& progress) {
    const std::vector<TileId> tiles = plan_.scheme.tiles(plan_.scheme.finest_level());
    const auto give = [&](const TakePiece& take) {
      std::int32_t first_group = 0;
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        const json facts = run_.facts_of(StepKind::kGroups, tiles[i]);
        if (progress) progress(static_cast<double>(i) / static_cast<double>(tiles.size()));
        const auto file = run_.open(group_raster_file_name(tiles[i]));
        if (!file) continue;
        TileRaster raster = read_tile_raster(*file);
        for (std::int32_t& value : raster.values)
          if (value >= 0) value += first_group;
        const TileWindow own = plan_.scheme.window(tiles[i]);
        take(own.first_column, own.first_row, raster.columns, raster.rows, raster.values);
        if (facts.contains("groups")) first_group += facts["groups"].get<std::int32_t>();
      }
    };
    add_layer("layers/groups.tif", "cog", [&](const std::string& path) {
      write_geotiff_cog_in_pieces(path, run_.writer().path_for("work/groups.tif"), groups_layer(),
                                  give, Existing::kReplace);
    });
  }

  void write_viewshed_layer(const Progress& progress) {
    const Position eye = GeoFrame::Placer(frame_).place(*observer_);
    const std::vector<std::uint8_t> seen =
        viewshed_of_samples(ground_placement(source_.dem()), source_.dem().columns,
                            plan_.scheme.window(TileId{}), *index_, eye, progress);
    RasterLayer layer = viewshed_layer();
    layer.samples = std::span(seen);
    add_layer("layers/viewshed.tif", "cog",
              [&](const std::string& path) { write_geotiff_cog(path, layer, Existing::kReplace); });
  }

  /// The same from tile to tile, each with the tiles between it and the eye: what lies in the way
  /// of a line is all that its answer depends on.
  void join_viewshed_layer(const Progress& progress) {
    const json at = run_.facts_of(StepKind::kRanges, {})["observer"];
    observer_ = MapPoint{at[0].get<double>(), at[1].get<double>(), at[2].get<double>()};
    const Position eye = GeoFrame::Placer(frame_).place(*observer_);
    const GroundGrid::Placement places = ground_placement(source_.dem());
    const std::vector<FinestTiles::Tile>& tiles = tiles_->tiles();
    const auto give = [&](const TakePiece& take) {
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Tin ground = tiles_->ground_of(tiles_->tiles_towards(eye, i));
        const TileWindow own = plan_.scheme.window(tiles[i].id);
        const std::vector<std::uint8_t> seen =
            viewshed_of_samples(places, source_.dem().columns, own, TinIndex(ground), eye, {});
        const std::vector<std::int32_t> values(seen.begin(), seen.end());
        take(own.first_column, own.first_row, own.columns, own.rows, values);
        if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(tiles.size()));
      }
    };
    add_layer("layers/viewshed.tif", "cog", [&](const std::string& path) {
      write_geotiff_cog_in_pieces(path, run_.writer().path_for("work/viewshed.tif"),
                                  viewshed_layer(), give, Existing::kReplace);
    });
  }

  /// Without its samples.
  RasterLayer viewshed_layer() const {
    RasterLayer viewshed = layer_over(source_.dem(), std::span<const std::uint8_t>(), "visible");
    viewshed.nodata = kUnknownValue;
    viewshed.colours = {{{70, 80, 96, 255}, {250, 196, 60, 255}}};
    viewshed.metadata["SURFACE"] = "tin";
    viewshed.metadata["OBSERVER"] =
        fmt::format("{:.10g},{:.10g},{:.3f}asl", observer_->x, observer_->y, observer_->height_m);
    viewshed.metadata["TARGET_HEIGHT_M"] = "0";
    viewshed.metadata["REFRACTION"] = fmt::format("{:g}", plan_.options.dem.refraction);
    viewshed.metadata["EARTH"] = is_flat() ? "flat" : "ellipsoid";
    viewshed.metadata["VALUES"] = "1 visible, 0 hidden, 255 unknown";
    return viewshed;
  }

  void write_polygons() {
    add_layer("layers/groups.gpkg", "gpkg", [&](const std::string& path) {
      write_group_polygons(path,
                           group_polygons(tin_, groups_, vertex_heights_m(tin_, frame_), frame_),
                           frame_.description().crs_wkt, Existing::kReplace);
    });
  }

  /// The same from tile to tile, with the groups' numbers in the scene.
  void join_polygons(const Progress& progress) {
    const std::vector<FinestTiles::Tile>& tiles = tiles_->tiles();
    const auto give = [&](const TakeGroups& take) {
      std::int64_t first_group = 0;
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Tin tin = tiles_->ground_of({i});
        const Groups groups = tiles_->groups_of({i});
        std::vector<GroupPolygon> polygons =
            group_polygons(tin, groups, vertex_heights_m(tin, frame_), frame_);
        for (GroupPolygon& polygon : polygons) {
          polygon.group += first_group;
          polygon.parent = -1;  // nodes above groups are numbered in each tile for itself
        }
        take(polygons);
        first_group += groups.leaf_count;
        if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(tiles.size()));
      }
    };
    add_layer("layers/groups.gpkg", "gpkg", [&](const std::string& path) {
      write_group_polygons_in_pieces(path, run_.writer().path_for("work/groups.gpkg"), give,
                                     frame_.description().crs_wkt, Existing::kReplace);
    });
  }

  /// The finest level that is not too large for a picture, its tiles beside each other.
  Tin ground_for_picture() {
    const TileScheme& scheme = plan_.scheme;
    for (std::int32_t level = scheme.finest_level();; --level) {
      const StepKind kind = level == scheme.finest_level() ? StepKind::kMesh : StepKind::kLevel;
      std::size_t triangles = 0;
      for (const TileId& tile : scheme.tiles(level)) {
        const json facts = run_.facts_of(kind, tile);
        if (facts.contains("triangles")) triangles += facts["triangles"].get<std::size_t>();
      }
      // Near the root of a narrow scene there may be no tile: the next finer level has all.
      const bool is_last = level == 0 || scheme.tiles(level - 1).empty();
      if (triangles > kMostDrawnTriangles && !is_last) continue;
      std::vector<Tin> tins;
      for (const TileId& tile : scheme.tiles(level))
        if (const auto file = run_.open(tile_file_name(name_of(tile), "tin")))
          tins.push_back(read_tin(*file));
      std::vector<const Tin*> parts;
      for (const Tin& tin : tins) parts.push_back(&tin);
      return weld(parts).tin;
    }
  }

  void draw(const Tin& tin, const Groups& groups) {
    PreviewOptions options;
    const std::vector<double> heights_m = vertex_heights_m(tin, frame_);
    options.heights_m = heights_m;
    fit_to(bounds_of(tin.vertices), options);
    const Picture above = preview_from_above(tin, groups, options);
    add_picture("preview.png", above);
    options.height_px = options.width_px * 9 / 16;
    const View view = default_view(tin.vertices, options.width_px, options.height_px);
    add_picture("preview-3d.png", preview_3d(tin, groups, view, options));
  }

  void add_picture(const std::string& name, const Picture& picture) {
    add_layer(name, "png", [&](const std::string& path) {
      write_png(path, picture.width_px, picture.height_px, picture.rgb, Existing::kReplace);
    });
  }

  void write_report() {
    json report = build_report(run_, observer_);
    report["verify"] = to_json(verified_);
    if (verified_tiles_ > 0) report["verified_tiles"] = verified_tiles_;
    const std::string text = report.dump(2) + "\n";
    add_layer("report.json", "json", [&](const std::string& path) {
      write_file(path, std::as_bytes(std::span(text)), Existing::kReplace);
    });
  }

  SceneDescription description() const {
    const Dem& dem = source_.dem();
    const FrameDescription& frame = frame_.description();
    SceneDescription scene;
    scene.made_by = "scarp " SCARP_VERSION;
    scene.crs_wkt = frame.crs_wkt;
    scene.earth.shape = is_flat() ? EarthShape::kFlat : EarthShape::kEllipsoid;
    scene.earth.refraction = frame.refraction;
    scene.earth.geoid = frame.geoid_file;
    scene.earth.centre = {frame.centre_x, frame.centre_y, 0};
    scene.raster = {dem.columns, dem.rows, dem.geotransform};
    scene.parameters = parameters();
    for (const json& input : run_.facts_of(StepKind::kSource, {})["inputs"])
      scene.sources.push_back({input["name"].get<std::string>(), input["size"].get<std::uint64_t>(),
                               checksum_from_hex(input["xxh3"].get<std::string>()).value()});
    scene.tiles = tiles();
    scene.layers = layers_;
    return scene;
  }

  std::map<std::string, ParameterValue> parameters() const {
    const BuildOptions& options = plan_.options;
    std::map<std::string, ParameterValue> parameters = {
        {"accuracy", name_of(options.accuracy)},
        {"horizon", horizon_name(options.horizon)},
        {"growth", growth_name(options.growth)},
        {"group_triangles", std::int64_t{options.group_triangles}},
        {"min_group_triangles", std::int64_t{options.min_group_triangles}},
        {"seed", static_cast<std::int64_t>(options.seed)},
        {"tile_samples", std::int64_t{plan_.scheme.tile_samples()}}};
    for (const PlanStep& step : plan_.steps) {
      if (step.kind != StepKind::kGroups) continue;
      const json facts = run_.facts_of(StepKind::kGroups, step.tile);
      if (!facts.contains("certified")) continue;
      const json& settings = facts["certified"];
      parameters["sectors"] = settings["sectors"].get<std::int64_t>();
      parameters["fans"] = settings["fans"].get<std::int64_t>();
      parameters["patch"] = settings["patch"].get<double>();
      break;
    }
    const SectorLayout layout = stewart_layout(options);
    if (!parameters.contains("sectors")) parameters["sectors"] = std::int64_t{layout.count};
    if (has_stewart(options.horizon)) parameters["subsectors"] = std::int64_t{layout.subsectors};
    if (options.seeds) parameters["seeds"] = std::int64_t{*options.seeds};
    if (options.max_groups > 0) parameters["max_groups"] = std::int64_t{options.max_groups};
    if (options.vertices)
      parameters["vertices"] = std::int64_t{*options.vertices};
    else
      parameters["max_error_m"] = plan_.max_error_m;
    return parameters;
  }

  /// Every tile that has a file, from the root on, with what it holds.
  std::vector<SceneTile> tiles() const {
    std::map<TileId, SceneTile> tiles;
    for (std::size_t i = 0; i < plan_.steps.size(); ++i) {
      if (!run_.work().is_done(i)) continue;
      const StepRecord record = run_.work().record(i);
      for (const StoredFile& file : record.outputs) {
        if (file.name.starts_with(kWorkFolder)) continue;
        const TileId id = tile_of_file(file);
        SceneTile& tile = tiles[id];
        tile.id = name_of(id);
        tile.files.push_back(file);
        if (file.kind == "tin") tile.contents = contents_of(record.facts);
        if (file.kind == "groups" && tile.contents)
          tile.contents->groups = record.facts["groups"].get<std::uint64_t>();
      }
    }
    if (tree_) {
      SceneTile& root = tiles[TileId{}];
      root.id = name_of(TileId{});
      root.files.push_back(*tree_);
    }
    std::vector<SceneTile> list;
    for (auto& [id, tile] : tiles) list.push_back(std::move(tile));
    return list;
  }

  /// From "tiles/3/0/1.tin".
  static TileId tile_of_file(const StoredFile& file) {
    const std::size_t begin = file.name.find('/') + 1;
    return tile_named(std::string_view(file.name).substr(begin, file.name.rfind('.') - begin))
        .value();
  }

  template <class Write>
  void add_layer(const std::string& name, const std::string& kind, const Write& write) {
    layers_.push_back(run_.make(name, kind, write));
  }

  bool is_flat() const { return frame_.description().earth == Earth::kFlat; }

  StepRun& run_;
  const BuildPlan& plan_;
  const DemWindows source_;
  const GeoFrame& frame_;
  std::vector<StoredFile> layers_;
  std::optional<MapPoint> observer_;
  std::vector<VerifyCounts> verified_;
  std::optional<FinestTiles> tiles_;  // of several
  std::optional<StoredFile> tree_;
  std::size_t verified_tiles_ = 0;
  // Of a scene of one tile:
  Tin tin_;
  Groups groups_;
  std::optional<TinIndex> index_;
  SampleGrid grid_;
};

}  // namespace

void finish_scene(StepRun& run) {
  Finish(run).finish();
}

}  // namespace scarp
