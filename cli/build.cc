#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/build/budget.h"
#include "cli/build/certified_settings.h"
#include "cli/build/layers.h"
#include "cli/build/report.h"
#include "cli/commands.h"
#include "cli/loaded_scene.h"
#include "cli/outputs.h"
#include "cli/picture_size.h"
#include "cli/scene_culling.h"
#include "cli/stages.h"
#include "cli/verify.h"
#include "core/error/error.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/certified/certify_groups.h"
#include "core/raster/preview.h"
#include "ingest/dem/dem.h"
#include "ingest/footprints/footprints.h"
#include "ingest/mesh/mesh.h"
#include "ingest/mesh/mesh_walls.h"
#include "tiles/layers/png_image.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/scene.h"
#include "tiles/store/tin_file.h"

namespace scarp {
namespace {

/// One build from options to a finished scene, a member function a stage.
class Build {
 public:
  explicit Build(const BuildOptions& options)
      : options_(options),
        stages_(!options.common.json),
        writer_(options.scene, existing(options.common)) {
    tile_.id = kOnlyTile;
  }

  void run() {
    stages_.run("read", [&](const Progress& p) { read(p); });
    stages_.run("place", [&](const Progress&) { grid_ = place_samples(dem_); });
    stages_.run("mesh", [&](const Progress& p) { mesh(p); });
    if (has_stewart(options_.horizon))
      stages_.run("horizons", [&](const Progress& p) { horizons(p); });
    else
      horizon_ = no_horizons(mesh_.tin.vertices.size());
    stages_.run("groups", [&](const Progress& p) { groups(p); });
    if (has_certified(options_.horizon)) {
      choose_settings();
      if (options_.budget.seconds) stages_.run("measure", [&](const Progress& p) { measure(p); });
      stages_.run("certify", [&](const Progress& p) { certify(p); });
    }
    stages_.run("verify", [&](const Progress& p) { verify(p); });
    stages_.run("layers", [&](const Progress& p) {
      write_group_file();
      layers(p);
    });
    stages_.run("preview", [&](const Progress&) { preview(); });
    finish();
    stages_.finish();
  }

  const nlohmann::json& report() const { return report_; }

 private:
  void read(const Progress& progress) {
    DemOptions dem = options_.dem;
    dem.memory_budget_bytes = options_.common.memory_budget_bytes;
    dem_ = read_dem(options_.dem_files, dem, progress);
  }

  void mesh(const Progress& progress) {
    if (options_.vertices)
      mesh_options_.vertex_budget = options_.vertices;
    else
      mesh_options_.max_error_m = options_.max_error_m.value_or(default_error_m());
    mesh_ = mesh_with_walls(grid_, mesh_options_, walls(), progress);
    index_.emplace(mesh_.tin);
    heights_m_ = vertex_heights_m(mesh_.tin, *dem_.frame);
    choose_observer();  // before the long work: there may be no such place
    add_tile_file("tin", [&](const std::string& path) {
      write_tin(path, mesh_.tin, mesh_.sample_of_vertex, Existing::kRefuse);
    });
  }

  /// The buildings of --footprints; their walls' feet follow the ground as closely as the mesh.
  WallsAndRoofs walls() {
    if (options_.footprints_file.empty()) return {};
    const double foot_error_m = mesh_options_.max_error_m.value_or(default_error_m());
    return add_footprints(dem_, grid_, options_.footprints_file, options_.footprints_height_field,
                          foot_error_m, dem_.warnings);
  }

  double default_error_m() const {
    return kDefaultErrorCells * std::min(grid_.cell_x_m, grid_.cell_y_m);
  }

  void horizons(const Progress& progress) {
    horizon_ = stewart_horizons(mesh_.tin.vertices, stewart_layout(options_), progress);
    add_tile_file("horizon", [&](const std::string& path) {
      write_horizon(path, horizon_, Existing::kRefuse);
    });
  }

  void groups(const Progress& progress) {
    const auto group_triangles = static_cast<std::uint32_t>(options_.group_triangles);
    if (options_.growth == Growth::kHiddenTogether) {
      HiddenTogetherOptions together;
      together.seed = options_.seed;
      together.group_triangles = group_triangles;
      together.min_group_triangles = options_.min_group_triangles;
      groups_ = build_groups(mesh_.tin, horizon_, together, progress, &grouping_);
    } else {
      CrystalOptions crystals;
      crystals.seed = options_.seed;
      crystals.group_triangles = group_triangles;
      crystals.seeds = options_.seeds.value_or(0);
      crystals.min_group_triangles = options_.min_group_triangles;
      if (options_.max_groups > 0) crystals.max_groups = options_.max_groups;
      groups_ = build_groups(mesh_.tin, horizon_, crystals, progress, &grouping_);
    }
  }

  void choose_settings() {
    CertifiedSettings& settings = certified_.emplace();
    const double bytes = options_.budget.bytes_per_triangle.value_or(kCertifiedBytes);
    const std::size_t triangles = mesh_.tin.triangles.size();
    settings.sectors =
        options_.sectors.value_or(sectors_within(bytes, triangles, groups_.leaf_count));
    settings.fans = options_.fans.value_or(settings.fans);
    settings.patch = options_.patch.value_or(settings.patch);
    if (!options_.budget.bytes_per_triangle) return;
    const double least = least_bytes(groups_.leaf_count) / static_cast<double>(triangles);
    if (bytes < least)
      throw Error(ErrorCode::kUsage,
                  fmt::format("--budget {:g}B/triangle: the fewest sectors take {:.2f} in these "
                              "groups; give that, or larger --group-triangles",
                              bytes, least));
  }

  /// Chooses the fans that --budget allows.
  void measure(const Progress& progress) {
    const CertifyCost cost = measure_certify_cost(mesh_.tin, groups_, *certified_, progress);
    const double seconds = *options_.budget.seconds;
    certified_->fans = fans_within(seconds, cost);
    budget_ = BudgetChoice{seconds, cost.measured_s, cost.at(certified_->fans)};
    if (cost.measured_s + budget_->predicted_s > seconds)
      dem_.warnings.push_back(
          fmt::format("--budget {:g}s: certifying is expected to take {:.1f} s with the fewest "
                      "fans, {}; give more time, or a larger --max-error",
                      seconds, cost.measured_s + budget_->predicted_s, kFewestFans));
  }

  /// A sample of what `scarp verify` prints, for the report.
  void verify(const Progress& progress) {
    const auto methods = culling_methods(groups_, has_stewart(options_.horizon));
    verified_ = verify_culling(*index_, groups_, *dem_.frame, methods,
                               sampled_plan(mesh_.tin.triangles.size()), progress);
  }

  void certify(const Progress& progress) {
    const CertifiedSettings& settings = *certified_;
    groups_.certified = certify_groups(mesh_.tin, groups_.group_of_triangle, groups_.leaf_count,
                                       hiding_options(settings), progress);
  }

  void write_group_file() {
    add_tile_file("groups",
                  [&](const std::string& path) { write_groups(path, groups_, Existing::kRefuse); });
  }

  /// Where the eye of the viewshed layer stands: as typed, or over the highest sample.
  void choose_observer() {
    if (options_.observer) {
      observer_ = resolve(*options_.observer, options_.crs, *dem_.frame, *index_);
    } else {
      const auto highest = static_cast<std::size_t>(
          std::max_element(heights_m_.begin(), heights_m_.end()) - heights_m_.begin());
      observer_ = GeoFrame::Placer(*dem_.frame).unplace(mesh_.tin.vertices[highest]);
      observer_.height_m += TypedPosition{}.height_m;
    }
    eye_ = GeoFrame::Placer(*dem_.frame).place(observer_);
  }

  void layers(const Progress& progress) {
    const std::vector<TriangleIndex> triangles = triangle_of_samples(grid_, *index_);
    const std::vector<std::int32_t> group_values = group_of_samples(triangles, groups_);
    RasterLayer groups = layer_over(dem_, std::span(group_values), "group");
    groups.nodata = kVoidGroupValue;
    groups.metadata["ORPHAN"] = std::to_string(kOrphanValue);
    add_layer("layers/groups.tif", "cog",
              [&](const std::string& path) { write_geotiff_cog(path, groups, Existing::kRefuse); });

    const std::vector<std::uint8_t> seen = viewshed_of_samples(dem_, *index_, eye_, progress);
    RasterLayer viewshed = layer_over(dem_, std::span(seen), "visible");
    viewshed.nodata = kUnknownValue;
    viewshed.colours = {{{70, 80, 96, 255}, {250, 196, 60, 255}}};
    viewshed.metadata["SURFACE"] = "tin";
    viewshed.metadata["OBSERVER"] =
        fmt::format("{:.10g},{:.10g},{:.3f}asl", observer_.x, observer_.y, observer_.height_m);
    viewshed.metadata["TARGET_HEIGHT_M"] = "0";
    viewshed.metadata["REFRACTION"] = fmt::format("{:g}", options_.dem.refraction);
    viewshed.metadata["EARTH"] = is_flat() ? "flat" : "ellipsoid";
    viewshed.metadata["VALUES"] = "1 visible, 0 hidden, 255 unknown";
    add_layer("layers/viewshed.tif", "cog", [&](const std::string& path) {
      write_geotiff_cog(path, viewshed, Existing::kRefuse);
    });

    add_layer("layers/groups.gpkg", "gpkg", [&](const std::string& path) {
      write_group_polygons(path, group_polygons(mesh_.tin, groups_, heights_m_, *dem_.frame),
                           dem_.frame->description().crs_wkt, Existing::kRefuse);
    });
  }

  void preview() {
    PreviewOptions options;
    options.heights_m = heights_m_;
    const Bounds bounds = bounds_of(mesh_.tin.vertices);
    fit_to(bounds, options);
    const Picture above = preview_from_above(mesh_.tin, groups_, options);
    add_layer("preview.png", "png", [&](const std::string& path) {
      write_png(path, above.width_px, above.height_px, above.rgb, Existing::kRefuse);
    });
    options.height_px = options.width_px * 9 / 16;
    const View view = default_view(mesh_.tin.vertices, options.width_px, options.height_px);
    const Picture tilted = preview_3d(mesh_.tin, groups_, view, options);
    add_layer("preview-3d.png", "png", [&](const std::string& path) {
      write_png(path, tilted.width_px, tilted.height_px, tilted.rgb, Existing::kRefuse);
    });
  }

  void finish() {
    report_ = build_report(options_, dem_, mesh_, mesh_options_, groups_, certified_, budget_,
                           grouping_, observer_, stages_.costs());
    report_["verify"] = to_json(verified_);
    const std::string text = report_.dump(2) + "\n";
    add_layer("report.json", "json", [&](const std::string& path) {
      write_file(path, std::as_bytes(std::span(text)), Existing::kRefuse);
    });
    const FrameDescription& frame = dem_.frame->description();
    SceneDescription scene;
    scene.made_by = "scarp " SCARP_VERSION;
    scene.crs_wkt = frame.crs_wkt;
    scene.earth.shape = is_flat() ? EarthShape::kFlat : EarthShape::kEllipsoid;
    scene.earth.refraction = frame.refraction;
    scene.earth.geoid = frame.geoid_file;
    scene.earth.centre = {frame.centre_x, frame.centre_y, 0};
    scene.raster = {dem_.columns, dem_.rows, dem_.geotransform};
    scene.parameters = {{"horizon", horizon_name(options_.horizon)},
                        {"growth", growth_name(options_.growth)},
                        {"group_triangles", std::int64_t{options_.group_triangles}},
                        {"min_group_triangles", std::int64_t{options_.min_group_triangles}},
                        {"seed", static_cast<std::int64_t>(options_.seed)}};
    if (certified_) {
      scene.parameters["sectors"] = std::int64_t{certified_->sectors};
      scene.parameters["fans"] = std::int64_t{certified_->fans};
      scene.parameters["patch"] = certified_->patch;
    } else {
      scene.parameters["sectors"] = std::int64_t{horizon_.layout.count};
    }
    if (has_stewart(options_.horizon))
      scene.parameters["subsectors"] = std::int64_t{horizon_.layout.subsectors};
    if (options_.seeds) scene.parameters["seeds"] = std::int64_t{*options_.seeds};
    if (options_.max_groups > 0) scene.parameters["max_groups"] = std::int64_t{options_.max_groups};
    if (mesh_options_.max_error_m) scene.parameters["max_error_m"] = *mesh_options_.max_error_m;
    if (mesh_options_.vertex_budget)
      scene.parameters["vertices"] = std::int64_t{*mesh_options_.vertex_budget};
    for (const DemSource& source : dem_.sources)
      scene.sources.push_back(
          {source.name, source.size_bytes, checksum_from_hex(source.checksum).value()});
    scene.tiles.push_back(tile_);
    scene.layers = layers_;
    writer_.finish(scene);
  }

  template <class Write>
  void add_tile_file(const std::string& kind, Write write) {
    const std::string name = tile_file_name(kOnlyTile, kind);
    write(writer_.path_for(name));
    tile_.files.push_back(writer_.record(name, kind));
  }

  template <class Write>
  void add_layer(const std::string& name, const std::string& kind, Write write) {
    write(writer_.path_for(name));
    layers_.push_back(writer_.record(name, kind));
  }

  bool is_flat() const { return dem_.frame->description().earth == Earth::kFlat; }

  const BuildOptions& options_;
  Stages stages_;
  SceneWriter writer_;
  SceneTile tile_;
  std::vector<StoredFile> layers_;
  Dem dem_;
  SampleGrid grid_;
  MeshOptions mesh_options_;
  Mesh mesh_;
  std::optional<TinIndex> index_;
  std::vector<double> heights_m_;
  HorizonTable horizon_;
  Groups groups_;
  std::optional<CertifiedSettings> certified_;
  std::optional<BudgetChoice> budget_;
  std::vector<VerifyCounts> verified_;
  GroupingReport grouping_;
  MapPoint observer_;
  Position eye_;
  nlohmann::json report_;
};

void print_summary(const BuildOptions& options, const nlohmann::json& report) {
  const auto& mesh = report["mesh"];
  const auto& groups = report["groups"];
  double seconds = 0;
  std::uint64_t peak_bytes = 0;
  for (const auto& stage : report["stages"]) {
    seconds += stage["seconds"].get<double>();
    peak_bytes = std::max(peak_bytes, stage["peak_memory_bytes"].get<std::uint64_t>());
  }
  for (const auto& warning : report["warnings"])
    fmt::print(stderr, "scarp: warning: {}\n", warning.get<std::string>());
  fmt::print("{}: {} x {} samples, {} vertices, {} triangles, error {:.3f} m\n", options.scene,
             report["raster"]["columns"].get<int>(), report["raster"]["rows"].get<int>(),
             mesh["vertices"].get<std::uint64_t>(), mesh["triangles"].get<std::uint64_t>(),
             mesh["error_over_surface_m"].get<double>());
  fmt::print("{} groups, {} orphans; {:.1f} s, {:.0f} MiB\n", groups["groups"].get<std::uint64_t>(),
             groups["orphans"].get<std::uint64_t>(), seconds,
             static_cast<double>(peak_bytes) / 0x1p20);
  if (!report.contains("certified")) return;
  const auto& certified = report["certified"];
  fmt::print("certified with --fans {} --sectors {} --patch {:g}: {:.1f} bytes a triangle",
             certified["fans"].get<int>(), certified["sectors"].get<int>(),
             certified["patch"].get<double>(),
             certified["bytes"].get<double>() / mesh["triangles"].get<double>());
  for (const auto& row : report["verify"])
    if (row["method"] == "certified" && !row["share"].is_null())
      fmt::print("; {:g} m up it culls {:.0f} % of the hidden groups",
                 row["eye_height_m"].get<double>(), 100 * row["share"].get<double>());
  fmt::print("\n");
}

/// Options that would have no effect are a mistake.
void refuse_idle_options(const BuildOptions& options) {
  const auto refuse = [](const char* option, const char* wants) {
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: has no effect without {}; add that, or leave {} out", option,
                            wants, option));
  };
  const bool breadth_first = options.growth == Growth::kBreadthFirst;
  if (options.seeds && !breadth_first) refuse("--seeds", "--growth breadth-first");
  if (options.max_groups > 0 && !breadth_first) refuse("--max-groups", "--growth breadth-first");
  if (breadth_first && !has_stewart(options.horizon))
    throw Error(ErrorCode::kUsage,
                "--growth breadth-first: crystals grow by the horizons of the vertices; add "
                "--horizon stewart or --horizon both");
  if (options.subsectors && !has_stewart(options.horizon))
    refuse("--subsectors", "--horizon stewart or both");
  if (options.fans && !has_certified(options.horizon))
    refuse("--fans", "--horizon certified or both");
  if ((options.budget.seconds || options.budget.bytes_per_triangle) &&
      !has_certified(options.horizon))
    refuse("--budget", "--horizon certified or both");
  if (options.budget.seconds && options.fans)
    throw Error(ErrorCode::kUsage, "--fans: chosen by a --budget of time; give one of the two");
  if (options.budget.bytes_per_triangle && options.sectors)
    throw Error(ErrorCode::kUsage, "--sectors: chosen by a --budget of bytes; give one of the two");
  if (options.patch && !has_certified(options.horizon))
    refuse("--patch", "--horizon certified or both");
}

/// Rows of the thesis may be few; certified regions are kept for eighths of the circle.
void check_sectors(const BuildOptions& options) {
  if (!options.sectors || !has_certified(options.horizon)) return;
  if (*options.sectors % 8 != 0 || *options.sectors < 8)
    throw Error(ErrorCode::kUsage,
                fmt::format("--sectors {}: certified regions are kept for a multiple of 8 sectors; "
                            "give {}, or --horizon stewart",
                            *options.sectors, std::max(8, (*options.sectors + 4) / 8 * 8)));
}

}  // namespace

int run_build(const BuildOptions& options) {
  if (options.max_error_m && !(*options.max_error_m >= 0 && *options.max_error_m < kLatticeReachM))
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--max-error {}: metres, zero or more, were expected", *options.max_error_m));
  refuse_idle_options(options);
  check_sectors(options);
  Build build(options);
  build.run();
  if (options.common.json)
    fmt::print("{}\n", build.report().dump(2));
  else
    print_summary(options, build.report());
  return 0;
}

}  // namespace scarp
