#pragma once

#include <functional>
#include <string>

#include "cli/build/build_plan.h"
#include "cli/build/workspace.h"
#include "core/terrain/tin.h"
#include "core/threads/progress.h"
#include "ingest/dem/dem_windows.h"
#include "ingest/mesh/mesh.h"

namespace scarp {

/// Begins a part of a step and takes its progress.
using BeginPart = std::function<Progress(const std::string& name)>;

/// What was read from files, mapped ones whole, and written to them.
struct FileBytes {
  std::uint64_t read = 0, written = 0;
};

/// One step while it is done: what it reads and makes.
class StepRun {
 public:
  StepRun(Workspace& work, std::size_t step, BeginPart begin_part);

  const BuildPlan& plan() const { return work_.plan(); }
  const PlanStep& step() const { return plan().steps[step_]; }
  const TileId& tile() const { return *step().tile; }
  const Workspace& work() const { return work_; }
  SceneWriter& writer() { return work_.writer(); }

  /// Numbers for later steps and for the report.
  nlohmann::json facts = nlohmann::json::object();

  /// Facts that a step before this one left.
  nlohmann::json facts_of(StepKind kind, const std::optional<TileId>& tile) const;

  /// Runs body(const Progress&) as a part of the step, with its seconds and its memory.
  template <class Body>
  void part(const std::string& name, Body body) {
    const Progress progress = begin_part_ ? begin_part_(name) : Progress();
    clock_.begin(name);
    body(progress);
    clock_.end();
  }
  const std::vector<StageCost>& parts() const { return clock_.costs(); }

  /// Opens a file that another step made; nothing where its tile is void.
  std::optional<SectionFile> open(const std::string& name);

  /// Makes an output of the step: write(path).
  template <class Write>
  const StoredFile& make(const std::string& name, const std::string& kind, const Write& write) {
    write(writer().path_for(name));
    record_.outputs.push_back(writer().record(name, kind));
    return record_.outputs.back();
  }

  /// The DEM, opened anew: each step has its own.
  DemWindows open_source() const { return {plan().options.dem_files, plan().options.dem}; }
  /// Throws Error{kInput} where a source is not what it was when the plan was made.
  void check_sources() const;

  /// Of this step so far, and of all that are done.
  FileBytes bytes_of_all() const;

  /// The last call: leaves the record, from which on the step is done.
  void finish();

 private:
  Workspace& work_;
  std::size_t step_;
  BeginPart begin_part_;
  StageClock clock_;
  StepRecord record_;
  FileBytes bytes() const;

  std::uint64_t mapped_bytes_ = 0;
  FileBytes before_;
};

/// The steps, each a function from files to files.
void read_source(StepRun& run);
void mesh_of_tile(StepRun& run);
void ranges_of_scene(StepRun& run);
void level_of_tile(StepRun& run);
void horizons_of_tile(StepRun& run);
void groups_of_tile(StepRun& run);
void finish_scene(StepRun& run);

/// What is recorded of a tile's mesh. Requires a triangle.
nlohmann::json facts_of_mesh(const Mesh& mesh);

/// Leaves every other sample of the step's tile for the next coarser level.
/// @param window  of the tile with its halo
void hand_on_samples(StepRun& run, const SampleGrid& window);

/// Does a step, whichever it is, and leaves its record.
void run_step(Workspace& work, std::size_t step, const BeginPart& begin_part);

}  // namespace scarp
