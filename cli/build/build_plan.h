#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/terrain/tile_scheme.h"

namespace scarp {

/// What a step does, in the order in which a build takes them. Each reads files and writes files.
enum class StepKind {
  kSource,    ///< reads every height once: checks, checksums
  kMesh,      ///< a tile of the finest level: its mesh, its ranges, its samples for coarser levels
  kRanges,    ///< the minimum/maximum pyramid above the finest level, and how low the scene is
  kLevel,     ///< a coarser tile: its mesh, what hides of it, its samples for the next level
  kHorizons,  ///< horizons of the vertices, only where they are asked for
  kGroups,    ///< a tile of the finest level: groups, their certified regions
  kFinish,    ///< layers, pictures, report, scene.json, and the name
};
const char* name_of(StepKind kind);

struct PlanStep {
  StepKind kind = StepKind::kSource;
  std::optional<TileId> tile;        ///< none: the whole scene
  std::vector<std::string> inputs;   ///< files of the growing scene, made by other steps
  std::vector<std::string> outputs;  ///< those that it makes, where its tile has ground
  std::vector<std::size_t> after;    ///< steps that have to be done before, rising
  std::uint64_t memory_bytes = 0;    ///< estimated from above
  double cost_s = 0;                 ///< of one core, rough

  std::string name() const;  ///< such as "mesh 3/0/1"
};

/// A file that heights come from, as it lay on the disk when the plan was made.
struct PlanSource {
  std::string path;
  std::uint64_t size = 0;
  std::int64_t changed_ns = 0;  ///< time of its last change

  friend bool operator==(const PlanSource&, const PlanSource&) = default;
};

/// How a file lies on the disk now.
PlanSource plan_source(const std::string& path);

/// The steps from DEM files to a scene. A function of the options and the headers of the files.
struct BuildPlan {
  BuildOptions options;
  std::vector<PlanSource> sources;
  TileScheme scheme{2, 2, 2};
  double max_error_m = 0;  ///< of the finest level; of others twice that of the next finer one
  /// Tells one plan from another: same options, sources and version, same fingerprint.
  std::string fingerprint;
  std::vector<PlanStep> steps;

  bool has_one_tile() const { return scheme.finest_level() == 0; }
  double max_error_m_of(std::int32_t level) const {
    return max_error_m * static_cast<double>(scheme.stride(level));
  }
};

/// Opens the sources and lays the steps out.
/// Throws Error: kInput as read_dem does for headers; kUsage for options that need a scene of one
/// tile where that has several; kResource where a step would take more than --memory.
BuildPlan make_plan(const BuildOptions& options);

/// plan.json.
nlohmann::json to_json(const BuildPlan& plan);

/// The options of a plan.json and its fingerprint, to make the plan again.
/// Throws Error{kInput} where the file is no plan.
struct StoredPlan {
  BuildOptions options;
  std::string fingerprint;
  std::size_t steps = 0;
};
StoredPlan read_plan(const std::string& path);

/// Whether the options ask for what is made in one piece only: see make_plan.
/// @return the first such option as it is typed, or null
const char* option_for_one_tile(const BuildOptions& options);

/// Files that steps hand on and that are no part of the finished scene: every other sample of a
/// tile, for the next coarser level; what hides of a coarser tile; the groups of a tile's samples;
/// where cameras are hidden from all of a tile's groups.
std::string samples_file_name(const TileId& tile);
std::string occluder_file_name(const TileId& tile);
std::string group_raster_file_name(const TileId& tile);
std::string tree_node_file_name(const TileId& tile);

/// The smallest tiles that there may be, cells along a side.
inline constexpr std::int32_t kLeastTileSamples = 64;

/// `scarp preview` draws the finest level that has no more triangles.
inline constexpr std::size_t kMostPreviewTriangles = 2'000'000;

/// The same for the pictures that a build makes of several tiles. They have two million pixels and
/// show no groups, and more triangles would take more memory than any other step.
inline constexpr std::size_t kMostDrawnTriangles = 500'000;

}  // namespace scarp
