#pragma once

#include <cstdint>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/build/build_plan.h"
#include "cli/stage_clock.h"
#include "tiles/store/scene.h"

namespace scarp {

/// What a finished step leaves beside its files: enough for others to go on from, and to tell
/// whether it has to be done again.
struct StepRecord {
  std::vector<StoredFile> inputs;   ///< as they were when the step read them
  std::vector<StoredFile> outputs;  ///< those that it made; fewer than planned in a void tile
  nlohmann::json facts =
      nlohmann::json::object();  ///< numbers that later steps and the report want
  std::vector<StageCost> stages;
  std::uint64_t bytes_read = 0;  ///< from files, mapped ones whole
  std::uint64_t bytes_written = 0;

  const StoredFile* output(const std::string& name) const;
};

/// The folder in which a scene grows, and how far its plan has come.
///
/// A record is written when all files of its step are whole under their names, so that a kill
/// leaves steps that are done and steps that are not. Thread-safe, but for finish().
class Workspace {
 public:
  /// @param start  as of SceneWriter. Records of other plans and files that were being written
  ///               when a build was killed are removed.
  Workspace(const BuildPlan& plan, SceneWriter::Start start);

  const BuildPlan& plan() const { return plan_; }
  SceneWriter& writer() { return writer_; }

  /// Whether a step's record and files are there and were made of what its inputs are now.
  bool is_done(std::size_t step) const;
  /// Requires is_done (asserted).
  StepRecord record(std::size_t step) const;
  void add_record(std::size_t step, const StepRecord& record);
  std::size_t done_count() const;

  /// A file that a finished step made, or nothing where its tile is void.
  std::optional<StoredFile> find(const std::string& name) const;
  /// Opens one. Errors: as Scene::open.
  SectionFile open(const StoredFile& file) const;

 private:
  std::string record_name(std::size_t step) const;
  void read_records();

  const BuildPlan& plan_;
  SceneWriter writer_;
  mutable std::mutex mutex_;
  std::vector<std::optional<StepRecord>> records_;  // [steps]
};

}  // namespace scarp
