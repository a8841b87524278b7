#include <fmt/format.h>

#include "cli/build/budget.h"
#include "cli/build/certified_settings.h"
#include "cli/build/layers.h"
#include "cli/build/report.h"
#include "cli/build/step_run.h"
#include "cli/verify.h"
#include "core/error/error.h"
#include "core/horizon/stewart.h"
#include "core/occlusion/build_groups.h"
#include "core/occlusion/certified/tile_tree.h"
#include "core/occlusion/certified/tile_view.h"
#include "tiles/store/groups_file.h"
#include "tiles/store/horizon_file.h"
#include "tiles/store/tile_raster_file.h"
#include "tiles/store/tin_file.h"
#include "tiles/store/tree_file.h"

namespace scarp {
namespace {

Groups grow(const BuildOptions& options, const Tin& tin, const HorizonTable& horizon,
            const Progress& progress, GroupingReport& report) {
  const auto group_triangles = static_cast<std::uint32_t>(options.group_triangles);
  if (options.growth == Growth::kHiddenTogether) {
    HiddenTogetherOptions together;
    together.seed = options.seed;
    together.group_triangles = group_triangles;
    together.min_group_triangles = options.min_group_triangles;
    return build_groups(tin, horizon, together, progress, &report);
  }
  CrystalOptions crystals;
  crystals.seed = options.seed;
  crystals.group_triangles = group_triangles;
  crystals.seeds = options.seeds.value_or(0);
  crystals.min_group_triangles = options.min_group_triangles;
  if (options.max_groups > 0) crystals.max_groups = options.max_groups;
  return build_groups(tin, horizon, crystals, progress, &report);
}

/// Tiles share their sectors, so that their regions can be asked as one: in a scene of several, as
/// many as groups of the size that is aimed at can have.
CertifiedSettings settings_for(const BuildPlan& plan, const Groups& groups) {
  const BuildOptions& options = plan.options;
  const double bytes = options.budget.bytes_per_triangle.value_or(kCertifiedBytes);
  constexpr std::uint32_t kMany = 1000;
  const std::uint32_t leaves = plan.has_one_tile() ? groups.leaf_count : kMany;
  const std::size_t triangles =
      plan.has_one_tile() ? groups.group_of_triangle.size()
                          : std::size_t{kMany} * static_cast<std::size_t>(options.group_triangles);
  CertifiedSettings settings;
  settings.sectors = options.sectors.value_or(sectors_within(bytes, triangles, leaves));
  settings.fans = options.fans.value_or(build_accuracy(options.accuracy).fans);
  settings.patch = options.patch.value_or(settings.patch);
  const double least = least_bytes(leaves) / static_cast<double>(triangles);
  if (options.budget.bytes_per_triangle && bytes < least)
    throw Error(ErrorCode::kUsage,
                fmt::format("--budget {:g}B/triangle: the fewest sectors take {:.2f} in these "
                            "groups; give that, or larger --group-triangles",
                            bytes, least));
  return settings;
}

/// Chooses the fans that --budget allows.
void measure(StepRun& run, const Tin& tin, const Groups& groups, CertifiedSettings& settings,
             const Progress& progress) {
  const CertifyCost cost = measure_certify_cost(tin, groups, settings, progress);
  const double seconds = *run.plan().options.budget.seconds;
  settings.fans = fans_within(seconds, cost);
  const double predicted_s = cost.at(settings.fans);
  run.facts["budget"] = {
      {"seconds", seconds}, {"measured_s", cost.measured_s}, {"predicted_s", predicted_s}};
  if (cost.measured_s + predicted_s > seconds)
    run.facts["warnings"] = {
        fmt::format("--budget {:g}s: certifying is expected to take {:.1f} s with the fewest "
                    "fans, {}; give more time, or a larger --max-error",
                    seconds, cost.measured_s + predicted_s, kFewestFans)};
}

/// Meshes of the finest level and what hides of coarser ones, in the order of seen_from.
class SeenGround {
 public:
  SeenGround(StepRun& run, Tin own) {
    const TileScheme& scheme = run.plan().scheme;
    ids_.push_back(run.tile());
    meshes_.push_back({std::move(own), {}});
    for (const TileId& id : scheme.seen_from(run.tile())) {
      if (id == run.tile()) continue;
      const bool is_fine = id.level == scheme.finest_level();
      const auto file =
          run.open(is_fine ? tile_file_name(name_of(id), "tin") : occluder_file_name(id));
      if (!file) continue;
      ids_.push_back(id);
      meshes_.push_back(read_sampled_tin(*file));
    }
  }

  const Tin& own() const { return meshes_.front().tin; }

  TileView view(const TileScheme& scheme) const {
    std::vector<SeenTile> seen;
    for (std::size_t i = 0; i < ids_.size(); ++i)
      seen.push_back({ids_[i], &meshes_[i].tin, meshes_[i].sample_of_vertex});
    return view_of_tile(scheme, seen);
  }

 private:
  std::vector<TileId> ids_;
  std::vector<SampledTin> meshes_;
};

void certify(StepRun& run, Tin own, Groups& groups) {
  CertifiedSettings settings = settings_for(run.plan(), groups);
  if (run.plan().options.budget.seconds)
    run.part("measure", [&](const Progress& p) { measure(run, own, groups, settings, p); });
  run.part("certify", [&](const Progress& progress) {
    // The tiles around are gone again before the long work.
    const TileView view = SeenGround(run, std::move(own)).view(run.plan().scheme);
    groups.certified = certify_tile(view, groups.group_of_triangle, groups.leaf_count,
                                    hiding_options(settings), progress);
    run.facts["seen_triangles"] = view.tin.triangles.size();
  });
  run.facts["certified"] = {{"sectors", settings.sectors},
                            {"fans", settings.fans},
                            {"patch", settings.patch},
                            {"bytes", kept_bytes(groups.certified)}};
}

/// The groups of a tile's own samples, for the layer of the whole raster.
void hand_on_groups(StepRun& run, const Tin& tin, const Groups& groups) {
  const TileWindow own = run.plan().scheme.window(run.tile());
  const DemWindows source = run.open_source();
  const SampleGrid grid = place_window(
      source.dem(), source.read({own.first_column, own.first_row, own.columns, own.rows}));
  const TileRaster raster{own.columns, own.rows,
                          group_of_samples(triangle_of_samples(grid, TinIndex(tin)), groups)};
  run.make(group_raster_file_name(run.tile()), "raster",
           [&](const std::string& path) { write_tile_raster(path, raster, Existing::kReplace); });
  run.check_sources();
}

}  // namespace

void horizons_of_tile(StepRun& run) {
  run.part("horizons", [&](const Progress& progress) {
    const std::string name = name_of(run.tile());
    const Tin tin = read_tin(*run.open(tile_file_name(name, "tin")));
    const HorizonTable horizon =
        stewart_horizons(tin.vertices, stewart_layout(run.plan().options), progress);
    run.make(tile_file_name(name, "horizon"), "horizon",
             [&](const std::string& path) { write_horizon(path, horizon, Existing::kReplace); });
  });
}

void groups_of_tile(StepRun& run) {
  const BuildPlan& plan = run.plan();
  const std::string name = name_of(run.tile());
  const auto tin_file = run.open(tile_file_name(name, "tin"));
  if (!tin_file) return;  // void
  Tin tin = read_tin(*tin_file);
  GroupingReport grouping;
  Groups groups;
  run.part("groups", [&](const Progress& progress) {
    const HorizonTable horizon = has_stewart(plan.options.horizon)
                                     ? read_horizon(*run.open(tile_file_name(name, "horizon")))
                                     : no_horizons(tin.vertices.size());
    groups = grow(plan.options, tin, horizon, progress, grouping);
    if (!plan.has_one_tile()) hand_on_groups(run, tin, groups);
  });
  const Bounds bounds = bounds_of(tin.vertices);
  if (has_certified(plan.options.horizon)) certify(run, std::move(tin), groups);
  if (!plan.has_one_tile())
    run.part("tree", [&](const Progress&) {
      const TileTree node{{tile_node(run.tile(), bounds, groups)}};
      run.make(tree_node_file_name(run.tile()), "tree",
               [&](const std::string& path) { write_tree(path, node, Existing::kReplace); });
    });
  run.make(tile_file_name(name, "groups"), "groups",
           [&](const std::string& path) { write_groups(path, groups, Existing::kReplace); });
  const GroupFigures figures = figures_of(groups);
  run.facts["groups"] = groups.leaf_count;
  run.facts["nodes"] = groups.nodes.size();
  run.facts["orphans"] = grouping.orphans;
  run.facts["passes"] = grouping.passes;
  run.facts["sizes"] = {figures.least, figures.median, figures.most};
}

}  // namespace scarp
