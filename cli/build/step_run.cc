#include "cli/build/step_run.h"

#include <fmt/format.h>

#include <cassert>
#include <filesystem>
#include <fstream>

#include "core/error/error.h"

namespace scarp {
namespace {

/// Of this thread since it began, by calls.
FileBytes thread_bytes() {
  FileBytes bytes;
  std::ifstream io("/proc/thread-self/io");
  for (std::string word; io >> word;) {
    if (word == "rchar:") io >> bytes.read;
    if (word == "wchar:") io >> bytes.written;
  }
  return bytes;
}

}  // namespace

StepRun::StepRun(Workspace& work, std::size_t step, BeginPart begin_part)
    : work_(work), step_(step), begin_part_(std::move(begin_part)), before_(thread_bytes()) {}

FileBytes StepRun::bytes() const {
  const FileBytes now = thread_bytes();
  return {now.read - before_.read + mapped_bytes_, now.written - before_.written};
}

FileBytes StepRun::bytes_of_all() const {
  FileBytes all = bytes();
  for (std::size_t i = 0; i < plan().steps.size(); ++i) {
    if (!work_.is_done(i)) continue;
    const StepRecord record = work_.record(i);
    all.read += record.bytes_read;
    all.written += record.bytes_written;
  }
  return all;
}

nlohmann::json StepRun::facts_of(StepKind kind, const std::optional<TileId>& tile) const {
  for (std::size_t i = 0; i < plan().steps.size(); ++i)
    if (plan().steps[i].kind == kind && plan().steps[i].tile == tile) return work_.record(i).facts;
  assert(false);
  return {};
}

std::optional<SectionFile> StepRun::open(const std::string& name) {
  const std::optional<StoredFile> file = work_.find(name);
  if (!file) return {};
  record_.inputs.push_back(*file);
  mapped_bytes_ += file->size;
  return work_.open(*file);
}

void StepRun::check_sources() const {
  for (const PlanSource& source : plan().sources) {
    if (plan_source(source.path) == source) continue;
    std::error_code none;
    const bool exists = std::filesystem::exists(source.path, none);
    throw Error(ErrorCode::kInput,
                fmt::format("'{}': {}; a file that stays as it is was expected; put it back and "
                            "give --resume, or begin anew",
                            source.path,
                            exists ? "changed while the scene was built from it"
                                   : "no such file any more, while the scene is built from it"));
  }
}

void StepRun::finish() {
  record_.facts = std::move(facts);
  record_.stages = clock_.costs();
  const FileBytes moved = bytes();
  record_.bytes_read = moved.read;
  record_.bytes_written = moved.written;
  work_.add_record(step_, record_);
}

void run_step(Workspace& work, std::size_t step, const BeginPart& begin_part) {
  StepRun run(work, step, begin_part);
  switch (run.step().kind) {
    case StepKind::kSource:
      read_source(run);
      break;
    case StepKind::kMesh:
      mesh_of_tile(run);
      break;
    case StepKind::kRanges:
      ranges_of_scene(run);
      break;
    case StepKind::kLevel:
      level_of_tile(run);
      break;
    case StepKind::kHorizons:
      horizons_of_tile(run);
      break;
    case StepKind::kGroups:
      groups_of_tile(run);
      break;
    case StepKind::kFinish:
      finish_scene(run);  // renames the folder, with its records
      return;
  }
  run.finish();
}

}  // namespace scarp
